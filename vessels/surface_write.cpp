#include <vtkCellArray.h>
#include <vtkCellData.h>
#include <vtkDoubleArray.h>
#include <vtkIntArray.h>
#include <vtkNew.h>
#include <vtkPointData.h>
#include <vtkPoints.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <stdexcept>

#include "vessels/error.hpp"
#include "vessels/file_guard.hpp"
#include "vessels/polydata.hpp"
#include "vessels/polylines.hpp"
#include "vessels/text.hpp"

namespace vstent::vessels {
namespace {

Error unwritable(const std::filesystem::path& path, const std::string& why) {
  return Error(ExitCode::output, path.string() + ": could not be written, " + why);
}

void require_finite(const Vec3& x, std::size_t vertex, double largest,
                    const std::filesystem::path& path) {
  if (x.allFinite() && x.cwiseAbs().maxCoeff() <= largest) return;
  throw unwritable(path, "vertex " + std::to_string(vertex) + " is at " + place(x));
}

// The source's points, bit by bit, except for the moved vertices.
vtkSmartPointer<vtkPoints> moved_points(const Surface& surface, std::span<const Vec3> points,
                                        std::span<const char> moved,
                                        const std::filesystem::path& path) {
  const SourceData& source = *surface.source;
  vtkPoints* original = source.data->GetPoints();
  auto result = vtkSmartPointer<vtkPoints>::New();
  result->SetDataType(original->GetDataType());
  result->DeepCopy(original);
  const double scale = 1.0 / millimetres_per(surface.unit);
  const double largest = original->GetDataType() == VTK_FLOAT ? 1e30 : 1e300;
  for (std::size_t p = 0; p < source.vertex_of_point.size(); ++p) {
    const int vertex = source.vertex_of_point[p];
    if (vertex < 0 || moved[static_cast<std::size_t>(vertex)] == 0) continue;
    const Vec3 x = points[static_cast<std::size_t>(vertex)] * scale;
    require_finite(x, static_cast<std::size_t>(vertex), largest, path);
    result->SetPoint(static_cast<vtkIdType>(p), x.data());
  }
  return result;
}

vtkSmartPointer<vtkCellArray> turned_polygons(const SourceData& source) {
  auto result = vtkSmartPointer<vtkCellArray>::New();
  result->DeepCopy(source.data->GetPolys());
  vtkNew<vtkIdList> ids;
  for (std::size_t c = 0; c < source.polygon_turned.size(); ++c) {
    if (source.polygon_turned[c] == 0) continue;
    source.data->GetPolys()->GetCellAtId(static_cast<vtkIdType>(c), ids);
    std::reverse(ids->begin() + 1, ids->end());
    result->ReplaceCellAtId(static_cast<vtkIdType>(c), ids);
  }
  return result;
}

// Values of `items` spread over `tuples` places of the file; places that the mesh does not know
// hold 0.
vtkSmartPointer<vtkDoubleArray> spread(const std::string& name, const std::vector<double>& values,
                                       std::size_t items, const std::vector<int>& item_of_place) {
  const std::size_t components = items == 0 ? 0 : values.size() / items;
  if (components * items != values.size() || (components != 1 && components != 3)) {
    throw std::invalid_argument("field " + name + ": " + std::to_string(values.size()) +
                                " values for " + std::to_string(items) +
                                " items, need one or three each");
  }
  auto array = vtkSmartPointer<vtkDoubleArray>::New();
  array->SetName(name.c_str());
  array->SetNumberOfComponents(static_cast<int>(components));
  array->SetNumberOfTuples(static_cast<vtkIdType>(item_of_place.size()));
  for (std::size_t p = 0; p < item_of_place.size(); ++p) {
    for (std::size_t k = 0; k < components; ++k) {
      const double value =
          item_of_place[p] < 0
              ? 0.0
              : values[static_cast<std::size_t>(item_of_place[p]) * components + k];
      array->SetComponent(static_cast<vtkIdType>(p), static_cast<int>(k), value);
    }
  }
  return array;
}

std::string surface_vtp(const Surface& surface, std::span<const Vec3> points,
                        std::span<const char> moved, const std::filesystem::path& path,
                        const Fields& vertex_fields, const Fields& triangle_fields) {
  const SourceData& source = *surface.source;
  vtkNew<vtkPolyData> data;
  data->ShallowCopy(source.data);
  data->SetPoints(moved_points(surface, points, moved, path));
  if (std::find(source.polygon_turned.begin(), source.polygon_turned.end(), 1) !=
      source.polygon_turned.end()) {
    data->SetPolys(turned_polygons(source));
  }
  for (const auto& [name, values] : vertex_fields) {
    data->GetPointData()->AddArray(
        spread(name, values, surface.mesh.points.size(), source.vertex_of_point));
  }
  if (!triangle_fields.empty()) {
    const vtkIdType first =
        data->GetVerts()->GetNumberOfCells() + data->GetLines()->GetNumberOfCells();
    std::vector<int> triangle_of_cell(
        static_cast<std::size_t>(first + data->GetPolys()->GetNumberOfCells()), -1);
    for (std::size_t t = source.polygon_of_triangle.size();
         t-- > 0;) {  // a polygon shows its first triangle's value
      triangle_of_cell[static_cast<std::size_t>(first + source.polygon_of_triangle[t])] =
          static_cast<int>(t);
    }
    for (const auto& [name, values] : triangle_fields) {
      data->GetCellData()->AddArray(
          spread(name, values, surface.mesh.triangles.size(), triangle_of_cell));
    }
  }
  return vtp_bytes(data, path.string());
}

std::string surface_stl(const Surface& surface, std::span<const Vec3> points,
                        std::span<const char> moved, const std::filesystem::path& path) {
  const SourceData& source = *surface.source;
  const double scale = 1.0 / millimetres_per(surface.unit);
  std::vector<std::array<float, 3>> corners(surface.mesh.points.size());
  std::vector<char> known(corners.size(), 0);
  const auto keep = [&](std::size_t vertex, const Vec3& x) {
    if (known[vertex] != 0) return;
    known[vertex] = 1;
    require_finite(x, vertex, 1e30, path);
    for (std::size_t k = 0; k < 3; ++k)
      corners[vertex][k] = static_cast<float>(x[static_cast<Eigen::Index>(k)]);
  };
  for (std::size_t v = 0; v < corners.size(); ++v) {
    if (moved[v] != 0) keep(v, points[v] * scale);
  }
  for (std::size_t p = 0; p < source.vertex_of_point.size(); ++p) {
    if (source.vertex_of_point[p] < 0) continue;
    keep(static_cast<std::size_t>(source.vertex_of_point[p]),
         Vec3(source.data->GetPoint(static_cast<vtkIdType>(p))));
  }
  const std::size_t count = surface.mesh.triangles.size();
  std::string bytes(84 + 50 * count, '\0');
  const std::string title = "vstent, unit " + std::string(name(surface.unit));
  std::memcpy(bytes.data(), title.data(), title.size());
  const auto size = static_cast<std::uint32_t>(count);
  std::memcpy(bytes.data() + 80, &size, sizeof size);
  for (std::size_t t = 0; t < count; ++t) {
    std::array<std::array<float, 3>, 4> facet{};
    std::array<Vec3, 3> x;
    for (std::size_t k = 0; k < 3; ++k) {
      facet[k + 1] = corners[static_cast<std::size_t>(surface.mesh.triangles[t][k])];
      x[k] = Vec3(facet[k + 1][0], facet[k + 1][1], facet[k + 1][2]);
    }
    const Vec3 u = x[1] - x[0], v = x[2] - x[0];
    Vec3 normal(u.y() * v.z() - u.z() * v.y(), u.z() * v.x() - u.x() * v.z(),
                u.x() * v.y() - u.y() * v.x());
    if (const double length = normal.norm(); length > 0) normal /= length;
    for (std::size_t k = 0; k < 3; ++k)
      facet[0][k] = static_cast<float>(normal[static_cast<Eigen::Index>(k)]);
    std::memcpy(bytes.data() + 84 + 50 * t, facet.data(), sizeof facet);
  }
  return bytes;
}

// Points and lines of `data`, scaled; returns the number of points.
std::size_t set_lines(vtkPolyData* data, const std::vector<Polyline>& lines,
                      const std::filesystem::path& path, double scale) {
  if (extension(path) != ".vtp") throw unwritable(path, "polylines go to .vtp files");
  vtkNew<vtkPoints> points;
  points->SetDataType(VTK_DOUBLE);
  vtkNew<vtkCellArray> cells;
  std::size_t count = 0;
  for (const Polyline& line : lines) {
    cells->InsertNextCell(static_cast<int>(line.size()));
    for (const Vec3& x : line) {
      require_finite(x * scale, count++, 1e300, path);
      cells->InsertCellPoint(points->InsertNextPoint(Vec3(x * scale).data()));
    }
  }
  data->SetPoints(points);
  data->SetLines(cells);
  return count;
}

template <class Array, class Value>
void add_line_arrays(vtkPolyData* data, std::size_t lines,
                     const std::map<std::string, std::vector<Value>>& arrays) {
  for (const auto& [name, values] : arrays) {
    if (values.size() != lines) {
      throw std::invalid_argument("array " + name + ": " + std::to_string(values.size()) +
                                  " values for " + std::to_string(lines) + " lines");
    }
    vtkNew<Array> array;
    array->SetName(name.c_str());
    for (const Value value : values) array->InsertNextValue(value);
    data->GetCellData()->AddArray(array);
  }
}

}  // namespace

void write_surface(const Surface& surface, std::span<const Vec3> points,
                   std::span<const char> moved, const std::filesystem::path& path,
                   const Fields& vertex_fields, const Fields& triangle_fields) {
  if (points.size() != surface.mesh.points.size() || moved.size() != points.size()) {
    throw std::invalid_argument("write_surface: " + std::to_string(points.size()) + " points and " +
                                std::to_string(moved.size()) + " marks for " +
                                std::to_string(surface.mesh.points.size()) + " vertices");
  }
  const std::string format = extension(path);
  if (format == ".vtp") {
    write_whole(path, surface_vtp(surface, points, moved, path, vertex_fields, triangle_fields));
  } else if (format == ".stl") {
    if (!vertex_fields.empty() || !triangle_fields.empty())
      throw unwritable(path, "an .stl file cannot hold fields");
    write_whole(path, surface_stl(surface, points, moved, path));
  } else {
    throw unwritable(path, "\"" + format + "\" is not a format for surfaces, use .vtp or .stl");
  }
}

void write_polylines(const std::vector<Polyline>& lines,
                     const std::map<std::string, std::vector<double>>& point_arrays,
                     const std::map<std::string, std::vector<int>>& line_arrays,
                     const std::filesystem::path& path, double scale) {
  vtkNew<vtkPolyData> data;
  const std::size_t count = set_lines(data, lines, path, scale);
  for (const auto& [name, values] : point_arrays) {
    const double factor = name.find("Radius") != std::string::npos ? scale : 1.0;
    const std::size_t components = count == 0 ? 0 : values.size() / count;
    if (components == 0 || components * count != values.size()) {
      throw std::invalid_argument("array " + name + ": " + std::to_string(values.size()) +
                                  " values for " + std::to_string(count) + " points");
    }
    vtkNew<vtkDoubleArray> array;
    array->SetName(name.c_str());
    array->SetNumberOfComponents(static_cast<int>(components));
    for (const double value : values) array->InsertNextValue(value * factor);
    data->GetPointData()->AddArray(array);
  }
  add_line_arrays<vtkIntArray>(data, lines.size(), line_arrays);
  write_whole(path, vtp_bytes(data, path.string()));
}

void write_polylines_with_values(const std::vector<Polyline>& lines,
                                 const std::map<std::string, std::vector<double>>& line_values,
                                 const std::map<std::string, std::vector<int>>& line_marks,
                                 const std::filesystem::path& path, double scale) {
  vtkNew<vtkPolyData> data;
  set_lines(data, lines, path, scale);
  add_line_arrays<vtkDoubleArray>(data, lines.size(), line_values);
  add_line_arrays<vtkIntArray>(data, lines.size(), line_marks);
  write_whole(path, vtp_bytes(data, path.string()));
}

}  // namespace vstent::vessels
