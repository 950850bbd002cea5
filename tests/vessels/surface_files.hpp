// What the tests of reading and of writing surfaces share.
#pragma once

#include <gtest/gtest.h>
#include <vtkCellArray.h>
#include <vtkCellData.h>
#include <vtkDoubleArray.h>
#include <vtkFieldData.h>
#include <vtkFloatArray.h>
#include <vtkIntArray.h>
#include <vtkNew.h>
#include <vtkPointData.h>
#include <vtkPoints.h>
#include <vtkPolyData.h>
#include <vtkPolyDataWriter.h>
#include <vtkSmartPointer.h>
#include <vtkXMLPolyDataWriter.h>

#include <array>
#include <cstdint>
#include <cstring>
#include <filesystem>
#include <string>
#include <vector>

#include "vessels/error.hpp"
#include "vessels/surface.hpp"

namespace vstent::tests {

using vessels::Finding;
using vessels::LengthUnit;
using vessels::read_surface;
using vessels::Surface;

inline std::size_t found(const Surface& surface, const std::string& kind) {
  for (const Finding& finding : surface.findings) {
    if (finding.kind == kind) return finding.count;
  }
  return 0;
}

inline std::string refusal(const std::filesystem::path& path, LengthUnit unit = LengthUnit::mm) {
  try {
    read_surface(path, unit);
  } catch (const Error& error) {
    EXPECT_EQ(error.code(), ExitCode::input_file) << error.what();
    const std::string line = error.what();
    EXPECT_TRUE(line.starts_with(path.string() + ":")) << line;
    EXPECT_EQ(line.find('\n'), std::string::npos) << line;
    EXPECT_LT(line.size(), path.string().size() + 400) << line;
    return line.substr(path.string().size());
  }
  ADD_FAILURE() << path << " was read";
  return {};
}

#define EXPECT_REFUSED(path, words) \
  EXPECT_NE(refusal(path).find(words), std::string::npos) << refusal(path)

inline std::vector<char> none_moved(const Surface& surface) {
  return std::vector<char>(surface.mesh.points.size(), 0);
}

inline std::string binary_stl(const TriangleMesh& mesh, std::uint32_t count) {
  std::string bytes(84, ' ');
  std::memcpy(bytes.data() + 80, &count, 4);
  for (const Triangle& t : mesh.triangles) {
    std::array<float, 12> facet{};
    for (std::size_t k = 0; k < 9; ++k) {
      facet[3 + k] = static_cast<float>(
          mesh.points[static_cast<std::size_t>(t[k / 3])][static_cast<Eigen::Index>(k % 3)]);
    }
    bytes.append(reinterpret_cast<const char*>(facet.data()), 48).append(2, '\0');
  }
  return bytes;
}
inline std::string binary_stl(const TriangleMesh& mesh) {
  return binary_stl(mesh, static_cast<std::uint32_t>(mesh.triangles.size()));
}

// A tube with every kind of array a solver's surface carries; float points.
inline vtkSmartPointer<vtkPolyData> rich_tube(const TriangleMesh& mesh) {
  auto data = vtkSmartPointer<vtkPolyData>::New();
  vtkNew<vtkPoints> points;
  for (const Vec3& x : mesh.points) points->InsertNextPoint(x.data());
  points->InsertNextPoint(1, 2, 3);  // used by nothing
  vtkNew<vtkCellArray> cells;
  for (const Triangle& t : mesh.triangles)
    cells->InsertNextCell({vtkIdType{t[0]}, vtkIdType{t[1]}, vtkIdType{t[2]}});
  data->SetPoints(points);
  data->SetPolys(cells);
  const auto add = [](vtkFieldData* to, vtkDataArray* array, const char* name, vtkIdType tuples,
                      int components) {
    array->SetName(name);
    array->SetNumberOfComponents(components);
    array->SetNumberOfTuples(tuples);
    for (vtkIdType i = 0; i < tuples; ++i) {
      for (int k = 0; k < components; ++k)
        array->SetComponent(i, k, 1.0 + static_cast<double>(i) / 3.0 + k);
    }
    to->AddArray(array);
  };
  vtkNew<vtkIntArray> nodes, faces;
  vtkNew<vtkDoubleArray> thickness, field;
  vtkNew<vtkFloatArray> normals;
  add(data->GetPointData(), nodes, "GlobalNodeID", points->GetNumberOfPoints(), 1);
  add(data->GetPointData(), thickness, "Thickness", points->GetNumberOfPoints(), 1);
  add(data->GetPointData(), normals, "Normals", points->GetNumberOfPoints(), 3);
  add(data->GetCellData(), faces, "ModelFaceID", cells->GetNumberOfCells(), 1);
  add(data->GetFieldData(), field, "TimeValue", 1, 1);
  data->GetPointData()->SetActiveNormals("Normals");
  return data;
}

template <class Writer>
std::string written(vtkPolyData* data, void (*prepare)(Writer&)) {
  vtkNew<Writer> writer;
  writer->SetInputData(data);
  writer->WriteToOutputStringOn();
  prepare(*writer);
  writer->Write();
  if constexpr (std::is_same_v<Writer, vtkPolyDataWriter>) {
    return {writer->GetOutputString(), static_cast<std::size_t>(writer->GetOutputStringLength())};
  } else {
    return writer->GetOutputString();
  }
}

}  // namespace vstent::tests
