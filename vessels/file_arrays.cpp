#include "vessels/file_arrays.hpp"

#include <vtkCellArray.h>
#include <vtkCellData.h>
#include <vtkDataArray.h>
#include <vtkIdList.h>
#include <vtkNew.h>
#include <vtkPointData.h>

#include "vessels/error.hpp"
#include "vessels/file_guard.hpp"
#include "vessels/polydata.hpp"

namespace vstent::vessels {
namespace {

/// One array per numeric array of `data`, its tuples picked by `tuples`.
Fields picked(vtkFieldData* data, const std::vector<vtkIdType>& tuples) {
  Fields fields;
  for (int a = 0; a < data->GetNumberOfArrays(); ++a) {
    vtkDataArray* array = data->GetArray(a);
    if (array == nullptr || array->GetName() == nullptr) continue;
    const int components = array->GetNumberOfComponents();
    if (components != 1 && components != 3) continue;
    std::vector<double>& values = fields[array->GetName()];
    values.clear();
    values.reserve(tuples.size() * static_cast<std::size_t>(components));
    for (const vtkIdType tuple : tuples) {
      for (int k = 0; k < components; ++k) values.push_back(array->GetComponent(tuple, k));
    }
  }
  return fields;
}

}  // namespace

Fields vertex_fields(const Surface& surface) {
  const SourceData& source = *surface.source;
  std::vector<vtkIdType> points(surface.mesh.points.size(), 0);
  for (std::size_t p = source.vertex_of_point.size(); p-- > 0;) {
    if (const int v = source.vertex_of_point[p]; v >= 0)
      points[static_cast<std::size_t>(v)] = static_cast<vtkIdType>(p);
  }
  return picked(source.data->GetPointData(), points);
}

Fields triangle_fields(const Surface& surface) {
  const SourceData& source = *surface.source;
  const vtkIdType first_polygon =
      source.data->GetVerts()->GetNumberOfCells() + source.data->GetLines()->GetNumberOfCells();
  std::vector<vtkIdType> cells;
  cells.reserve(source.polygon_of_triangle.size());
  for (const int polygon : source.polygon_of_triangle) cells.push_back(first_polygon + polygon);
  return picked(source.data->GetCellData(), cells);
}

TriangleMesh read_patch(const std::filesystem::path& path, LengthUnit unit) {
  std::size_t merged = 0;
  const vtkSmartPointer<vtkPolyData> data = extension(path) == ".stl"
                                                ? parse_stl(read_bytes(path), path.string(), merged)
                                                : read_polydata(path);
  TriangleMesh mesh;
  for (vtkIdType i = 0; i < data->GetNumberOfPoints(); ++i)
    mesh.points.push_back(millimetres_per(unit) * Vec3(data->GetPoint(i)));
  vtkNew<vtkIdList> corners;
  vtkCellArray* polygons = data->GetPolys();
  for (polygons->InitTraversal(); polygons->GetNextCell(corners);) {
    for (vtkIdType k = 2; k < corners->GetNumberOfIds(); ++k) {
      mesh.triangles.push_back({static_cast<int>(corners->GetId(0)),
                                static_cast<int>(corners->GetId(k - 1)),
                                static_cast<int>(corners->GetId(k))});
    }
  }
  if (mesh.triangles.empty())
    throw Error(ExitCode::input_file, path.string() + ": has no polygons");
  return mesh;
}

PolylineFile read_polylines(const std::filesystem::path& path, LengthUnit unit) {
  const vtkSmartPointer<vtkPolyData> data = read_polydata(path);
  const double scale = millimetres_per(unit);
  PolylineFile file;
  std::vector<vtkIdType> cells;
  vtkCellArray* lines = data->GetLines();
  for (vtkIdType c = 0; c < lines->GetNumberOfCells(); ++c) {
    vtkIdType count = 0;
    const vtkIdType* points = nullptr;
    lines->GetCellAtId(c, count, points);
    Polyline& line = file.lines.emplace_back();
    for (vtkIdType i = 0; i < count; ++i) {
      double x[3];
      data->GetPoint(points[i], x);
      line.push_back(scale * Vec3(x[0], x[1], x[2]));
    }
    cells.push_back(data->GetVerts()->GetNumberOfCells() + c);
  }
  for (auto& [name, values] : picked(data->GetCellData(), cells)) {
    if (values.size() == file.lines.size()) file.line_arrays[name] = values;
  }
  return file;
}

}  // namespace vstent::vessels
