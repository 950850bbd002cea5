#include <gtest/gtest.h>
#include <sys/resource.h>
#include <sys/wait.h>

#include <bit>
#include <csignal>

#include "tests/data.hpp"
#include "tests/vessels/shapes.hpp"
#include "tests/vessels/surface_files.hpp"
#include "vessels/error.hpp"
#include "vessels/polydata.hpp"
#include "vessels/surface.hpp"

namespace vstent::vessels {
namespace {

using tests::binary_stl;
using tests::found;
using tests::none_moved;
using tests::refusal;
using tests::rich_tube;
using tests::shared_data;
using tests::TemporaryFolder;
using tests::tube;
using tests::written;

void expect_same_arrays(vtkFieldData* before, vtkFieldData* after) {
  for (int a = 0; a < before->GetNumberOfArrays(); ++a) {
    vtkDataArray* expected = before->GetArray(a);
    vtkDataArray* actual = after->GetArray(expected->GetName());
    ASSERT_NE(actual, nullptr) << expected->GetName();
    ASSERT_EQ(actual->GetDataType(), expected->GetDataType());
    ASSERT_EQ(actual->GetNumberOfValues(), expected->GetNumberOfValues());
    const auto size =
        static_cast<std::size_t>(expected->GetNumberOfValues() * expected->GetDataTypeSize());
    EXPECT_EQ(std::memcmp(expected->GetVoidPointer(0), actual->GetVoidPointer(0), size), 0)
        << expected->GetName();
  }
}

TEST(WriteSurface, ArraysComeOutUntouchedAndUnmovedPointsBitIdentical) {
  const TemporaryFolder folder;
  TriangleMesh mesh = tests::turned(tube(0.25, 2, 16, 11), 3);  // cm
  for (Vec3& x : mesh.points) x += Vec3(0.1, 1.0 / 3.0, -7.7);  // no coordinate is exact in binary
  vtkSmartPointer<vtkPolyData> data = rich_tube(mesh);
  using Xml = vtkXMLPolyDataWriter;
  const auto path =
      folder.write("in.vtp", written<Xml>(data, [](Xml& w) { w.SetDataModeToBinary(); }));
  const Surface surface = read_surface(path, LengthUnit::cm);
  EXPECT_EQ(surface.face_of_triangle.size(), mesh.triangles.size());

  std::vector<Vec3> points = surface.mesh.points;
  std::vector<char> moved = none_moved(surface);
  for (std::size_t v = 0; v < points.size(); ++v) {
    points[v] += Vec3(0.01, 0.02, 0.03);  // only the marked ones may show
    moved[v] = v % 4 == 0;
  }
  std::vector<double> magnitude(points.size()), vectors(3 * points.size()),
      faces(mesh.triangles.size());
  for (std::size_t v = 0; v < points.size(); ++v) magnitude[v] = static_cast<double>(v) / 7;
  for (std::size_t t = 0; t < faces.size(); ++t) faces[t] = static_cast<double>(t) / 9;
  const Fields vertex_fields = {{"Displacement", vectors}, {"Magnitude", magnitude}};
  write_surface(surface, points, moved, folder / "out.vtp", vertex_fields, {{"Strain", faces}});
  write_surface(surface, points, moved, folder / "again.vtp", vertex_fields, {{"Strain", faces}});
  EXPECT_TRUE(tests::file_bytes(folder / "out.vtp") == tests::file_bytes(folder / "again.vtp"));
  EXPECT_EQ(folder.entries(), 3U);

  const auto back = read_polydata(folder / "out.vtp");
  expect_same_arrays(data->GetPointData(), back->GetPointData());
  expect_same_arrays(data->GetCellData(), back->GetCellData());
  expect_same_arrays(data->GetFieldData(), back->GetFieldData());
  EXPECT_NE(back->GetPointData()->GetNormals(), nullptr);
  ASSERT_EQ(back->GetPoints()->GetDataType(), VTK_FLOAT);
  const auto* before = static_cast<float*>(data->GetPoints()->GetVoidPointer(0));
  const auto* after = static_cast<float*>(back->GetPoints()->GetVoidPointer(0));
  for (std::size_t v = 0; v < moved.size(); ++v) {
    for (std::size_t k = 0; k < 3; ++k) {
      const float expected = moved[v] != 0
                                 ? static_cast<float>(points[v][static_cast<Eigen::Index>(k)] * 0.1)
                                 : before[3 * v + k];
      EXPECT_EQ(std::bit_cast<std::uint32_t>(after[3 * v + k]),
                std::bit_cast<std::uint32_t>(expected));
    }
    EXPECT_EQ(
        back->GetPointData()->GetArray("Magnitude")->GetComponent(static_cast<vtkIdType>(v), 0),
        magnitude[v]);
  }
  const Surface again = read_surface(folder / "out.vtp", LengthUnit::cm);
  EXPECT_EQ(found(again, "orientation"), 0U) << "turned triangles are written turned";
  EXPECT_EQ(again.mesh.triangles, surface.mesh.triangles);
}

TEST(WriteSurface, StlRoundTripIsBitIdentical) {
  const TemporaryFolder folder;
  TriangleMesh mesh = tube(2.5, 20, 16, 11);
  for (Vec3& x : mesh.points) x += Vec3(0.1, 1.0 / 3.0, -7.7);
  const std::string bytes = binary_stl(mesh);
  const Surface surface = read_surface(folder.write("in.stl", bytes), LengthUnit::mm);
  write_surface(surface, surface.mesh.points, none_moved(surface), folder / "out.stl");
  const std::string back = tests::file_bytes(folder / "out.stl");
  ASSERT_EQ(back.size(), bytes.size());
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    EXPECT_EQ(back.substr(84 + 50 * t + 12, 36), bytes.substr(84 + 50 * t + 12, 36));
  }
}

TEST(WriteSurface, GeneratedMeshesAndPolylines) {
  const TemporaryFolder folder;
  const Surface surface = make_surface(tube(2.5, 20, 16, 11), "tube");
  write_surface(surface, surface.mesh.points, none_moved(surface), folder / "tube.vtp");
  const Surface back = read_surface(folder / "tube.vtp", LengthUnit::mm);
  EXPECT_EQ(back.mesh.points, surface.mesh.points);
  EXPECT_EQ(back.mesh.triangles, surface.mesh.triangles);

  const std::vector<Polyline> lines = {{{0, 0, 0}, {0, 0, 10}},
                                       {{0, 0, 10}, {5, 0, 15}, {9, 0, 20}}};
  write_polylines(lines,
                  {{"MaximumInscribedSphereRadius", {1, 2, 3, 4, 5}}, {"Kappa", {1, 2, 3, 4, 5}}},
                  {{"BranchId", {0, 1}}}, folder / "lines.vtp", 0.1);
  const auto data = read_polydata(folder / "lines.vtp");
  ASSERT_EQ(data->GetLines()->GetNumberOfCells(), 2);
  EXPECT_EQ(Vec3(data->GetPoint(4)), Vec3(9 * 0.1, 0, 20 * 0.1));
  EXPECT_DOUBLE_EQ(
      data->GetPointData()->GetArray("MaximumInscribedSphereRadius")->GetComponent(4, 0), 0.5);
  EXPECT_DOUBLE_EQ(data->GetPointData()->GetArray("Kappa")->GetComponent(4, 0), 5);
  EXPECT_DOUBLE_EQ(data->GetCellData()->GetArray("BranchId")->GetComponent(1, 0), 1);
  EXPECT_NE(refusal(folder / "lines.vtp").find("no triangles, only 2"), std::string::npos);
}

TEST(WriteSurface, FailureLeavesTheOldFile) {
  const TemporaryFolder folder;
  const Surface surface = make_surface(tube(2.5, 20, 64, 101), "tube");
  const auto attempt = [&](const std::filesystem::path& path, const std::vector<Vec3>& points,
                           char all) {
    try {
      write_surface(surface, points, std::vector<char>(points.size(), all), path);
    } catch (const Error& error) {
      EXPECT_EQ(error.code(), ExitCode::output);
      EXPECT_TRUE(std::string(error.what()).starts_with(path.string() + ": ")) << error.what();
      return true;
    }
    return false;
  };
  const std::vector<Vec3>& points = surface.mesh.points;
  EXPECT_TRUE(attempt(folder / "missing" / "out.vtp", points, 0));
  EXPECT_TRUE(attempt(folder / "out.ply", points, 0));
  EXPECT_TRUE(attempt("/dev/full.vtp/x.vtp", points, 0));
  std::filesystem::create_directory(folder / "folder.vtp");
  EXPECT_TRUE(attempt(folder / "folder.vtp", points, 0));
  EXPECT_EQ(folder.entries(), 1U);

  const auto path = folder.write("out.vtp", "the old result");
  std::vector<Vec3> broken = points;
  broken[77].x() = std::numeric_limits<double>::quiet_NaN();
  EXPECT_TRUE(attempt(path, broken, 1));
  EXPECT_EQ(tests::file_bytes(path), "the old result");

  const pid_t child = ::fork();  // a full disk, as far as write(2) can tell
  if (child == 0) {
    std::signal(SIGXFSZ, SIG_IGN);
    const rlimit limit{4096, 4096};
    ::setrlimit(RLIMIT_FSIZE, &limit);
    ::_exit(attempt(path, points, 0) ? 0 : 1);
  }
  int status = 0;
  ::waitpid(child, &status, 0);
  EXPECT_TRUE(WIFEXITED(status) && WEXITSTATUS(status) == 0);
  EXPECT_EQ(tests::file_bytes(path), "the old result");
  EXPECT_EQ(folder.entries(), 2U) << "nothing else is left behind";
  EXPECT_FALSE(attempt(path, points, 0));
  EXPECT_EQ(read_surface(path, LengthUnit::mm).mesh.points, points);
}

TEST(WriteSurface, RealVesselKeepsItsArraysAndPoints) {
  const auto path = shared_data("veingraft_stenosis/svFSI_var_wall_props.vtp");
  SKIP_WITHOUT(path);
  const TemporaryFolder folder;
  const Surface surface = read_surface(path, LengthUnit::cm);
  write_surface(surface, surface.mesh.points, none_moved(surface), folder / "out.vtp");
  const auto before = read_polydata(path), after = read_polydata(folder / "out.vtp");
  expect_same_arrays(before->GetPointData(), after->GetPointData());
  expect_same_arrays(before->GetCellData(), after->GetCellData());
  expect_same_arrays(before->GetFieldData(), after->GetFieldData());
  vtkDataArray *x = before->GetPoints()->GetData(), *y = after->GetPoints()->GetData();
  ASSERT_EQ(x->GetDataType(), y->GetDataType());
  ASSERT_EQ(x->GetNumberOfValues(), y->GetNumberOfValues());
  EXPECT_EQ(std::memcmp(x->GetVoidPointer(0), y->GetVoidPointer(0),
                        static_cast<std::size_t>(x->GetNumberOfValues() * x->GetDataTypeSize())),
            0);
}

}  // namespace
}  // namespace vstent::vessels
