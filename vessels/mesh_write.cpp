#include "vessels/mesh_write.hpp"

#include <vtkCellArray.h>
#include <vtkCellData.h>
#include <vtkCellType.h>
#include <vtkIntArray.h>
#include <vtkNew.h>
#include <vtkPointData.h>
#include <vtkPoints.h>
#include <vtkUnstructuredGrid.h>
#include <vtkXMLUnstructuredGridReader.h>
#include <vtkXMLUnstructuredGridWriter.h>

#include <stdexcept>

#include "vessels/error.hpp"
#include "vessels/file_guard.hpp"
#include "vessels/polydata.hpp"
#include "vessels/vtk_exchange.hpp"

namespace vstent::vessels {
namespace {

vtkSmartPointer<vtkPoints> vtk_points(const std::vector<Vec3>& points) {
  auto result = vtkSmartPointer<vtkPoints>::New();
  result->SetDataTypeToDouble();
  result->SetNumberOfPoints(static_cast<vtkIdType>(points.size()));
  for (std::size_t i = 0; i < points.size(); ++i) {
    if (!points[i].allFinite()) throw std::invalid_argument("a point that is not finite");
    result->SetPoint(static_cast<vtkIdType>(i), points[i].data());
  }
  return result;
}

template <std::size_t N>
vtkSmartPointer<vtkCellArray> vtk_cells(const std::vector<std::array<int, N>>& cells) {
  auto result = vtkSmartPointer<vtkCellArray>::New();
  result->AllocateExact(static_cast<vtkIdType>(cells.size()),
                        static_cast<vtkIdType>(N * cells.size()));
  for (const auto& cell : cells) {
    result->InsertNextCell(static_cast<int>(N));
    for (const int corner : cell) result->InsertCellPoint(corner);
  }
  return result;
}

void add_arrays(vtkDataSetAttributes* attributes, const IdArrays& arrays, std::size_t items) {
  for (const auto& [name, values] : arrays) {
    if (values.size() != items)
      throw std::invalid_argument("array " + name + ": " + std::to_string(values.size()) +
                                  " values for " + std::to_string(items));
    vtkNew<vtkIntArray> array;
    array->SetName(name.c_str());
    array->SetNumberOfValues(static_cast<vtkIdType>(values.size()));
    std::copy(values.begin(), values.end(), array->GetPointer(0));
    attributes->AddArray(array);
  }
  if (!arrays.empty()) attributes->SetActiveScalars(arrays.front().first.c_str());
}

/// Empty, or why `bytes` are not `grid`.
std::string difference(vtkUnstructuredGrid* grid, const std::string& bytes) {
  Listening listening;
  vtkNew<vtkXMLUnstructuredGridReader> reader;
  listening.listen_to(reader);
  reader->ReadFromInputStringOn();
  reader->SetInputString(bytes);
  reader->Update();
  vtkUnstructuredGrid* back = reader->GetOutput();
  if (!listening.message().empty()) return essence(listening.message());
  if (reader->GetErrorCode() != 0 || back == nullptr || back->GetPoints() == nullptr)
    return "VTK's reader failed";
  const bool same = same_values(grid->GetPoints()->GetData(), back->GetPoints()->GetData()) &&
                    same_cells(grid->GetCells(), back->GetCells()) &&
                    same_values(grid->GetCellTypesArray(), back->GetCellTypesArray()) &&
                    same_arrays(grid->GetPointData(), back->GetPointData()) &&
                    same_arrays(grid->GetCellData(), back->GetCellData());
  return same ? std::string() : "it differs from what was written";
}

}  // namespace

void write_triangles(const TriangleMesh& mesh, const IdArrays& of_points,
                     const IdArrays& of_triangles, const std::filesystem::path& path) {
  vtkNew<vtkPolyData> data;
  data->SetPoints(vtk_points(mesh.points));
  data->SetPolys(vtk_cells(mesh.triangles));
  add_arrays(data->GetPointData(), of_points, mesh.points.size());
  add_arrays(data->GetCellData(), of_triangles, mesh.triangles.size());
  write_whole(path, vtp_bytes(data, path.string()));
}

void write_tetrahedra(const std::vector<Vec3>& points,
                      const std::vector<std::array<int, 4>>& tetrahedra, const IdArrays& of_points,
                      const IdArrays& of_tetrahedra, const std::filesystem::path& path) {
  vtkNew<vtkUnstructuredGrid> grid;
  grid->SetPoints(vtk_points(points));
  grid->SetCells(VTK_TETRA, vtk_cells(tetrahedra));
  add_arrays(grid->GetPointData(), of_points, points.size());
  add_arrays(grid->GetCellData(), of_tetrahedra, tetrahedra.size());
  forget_ranges(grid);
  vtkNew<vtkXMLUnstructuredGridWriter> writer;
  writer->SetInputData(grid);
  const std::string bytes = written_bytes(writer, path.string());
  forget_ranges(grid);
  try {
    if (const std::string why = difference(grid, bytes); !why.empty())
      throw Error(ExitCode::output,
                  path.string() + ": could not be written, reading it back: " + why);
  } catch (const std::bad_alloc&) {
    throw Error(ExitCode::resources, path.string() + ": could not be written, not enough memory");
  }
  write_whole(path, bytes);
}

}  // namespace vstent::vessels
