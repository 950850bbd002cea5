#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <numbers>
#include <set>

#include "tests/data.hpp"
#include "tests/vessels/shapes.hpp"
#include "tests/vessels/surface_files.hpp"
#include "vessels/check.hpp"
#include "vessels/error.hpp"
#include "vessels/polydata.hpp"
#include "vessels/refine.hpp"

namespace vstent::vessels {
namespace {

using tests::none_moved;
using tests::rich_tube;
using tests::TemporaryFolder;
using tests::tube;
using tests::written;

constexpr double kAny = std::numeric_limits<double>::infinity();
constexpr std::size_t kPlenty = 10'000'000;

double area(const TriangleMesh& mesh, std::size_t t) {
  const auto& p = mesh.points;
  const auto corner = [&](std::size_t k) {
    return p[static_cast<std::size_t>(mesh.triangles[t][k])];
  };
  return 0.5 * (corner(1) - corner(0)).cross(corner(2) - corner(0)).norm();
}

double smallest_angle(const TriangleMesh& mesh, std::size_t t) {
  double smallest = std::numbers::pi;
  for (std::size_t k = 0; k < 3; ++k) {
    const auto corner = [&](std::size_t i) -> const Vec3& {
      return mesh.points[static_cast<std::size_t>(mesh.triangles[t][(k + i) % 3])];
    };
    const Vec3 a = corner(1) - corner(0), b = corner(2) - corner(0);
    smallest = std::min(smallest, std::atan2(a.cross(b).norm(), a.dot(b)));
  }
  return smallest;
}

double longest_edge(const TriangleMesh& mesh, std::size_t t) {
  double longest = 0;
  for (std::size_t k = 0; k < 3; ++k) {
    longest =
        std::max(longest, (mesh.points[static_cast<std::size_t>(mesh.triangles[t][k])] -
                           mesh.points[static_cast<std::size_t>(mesh.triangles[t][(k + 1) % 3])])
                              .norm());
  }
  return longest;
}

TEST(Refine, ObeysTheLimitKeepsAreaShapeTopologyAndHalvesAnglesAtMost) {
  const TriangleMesh coarse = tests::turned(tube(2, 20, 12, 15), 3);
  const auto limit = [](int, const Vec3& x) { return x.norm() < 6 ? 0.3 : kAny; };
  const RefinedMesh fine = refine(coarse, limit, kPlenty);
  ASSERT_GT(fine.parents.size(), 500u);
  std::vector<double> areas(coarse.triangles.size(), 0);
  double coarse_angle = 4, fine_angle = 4;
  for (std::size_t t = 0; t < coarse.triangles.size(); ++t)
    coarse_angle = std::min(coarse_angle, smallest_angle(coarse, t));
  for (std::size_t t = 0; t < fine.mesh.triangles.size(); ++t) {
    areas[static_cast<std::size_t>(fine.origin[t])] += area(fine.mesh, t);
    fine_angle = std::min(fine_angle, smallest_angle(fine.mesh, t));
  }
  for (std::size_t t = 0; t < areas.size(); ++t)
    EXPECT_NEAR(areas[t], area(coarse, t), 1e-12 * area(coarse, t));
  EXPECT_GE(fine_angle, 0.5 * coarse_angle * (1 - 1e-9));  // Rosenberg and Stenger 1975
  for (std::size_t v = 0; v < coarse.points.size(); ++v)
    EXPECT_EQ(fine.mesh.points[v], coarse.points[v]);
  for (std::size_t i = 0; i < fine.parents.size(); ++i) {
    const Vec3& a = fine.mesh.points[static_cast<std::size_t>(fine.parents[i][0])];
    const Vec3& b = fine.mesh.points[static_cast<std::size_t>(fine.parents[i][1])];
    EXPECT_EQ(fine.mesh.points[coarse.points.size() + i], Vec3(0.5 * (a + b)));
  }
  const Topology before = topology(coarse), after = topology(fine.mesh);
  EXPECT_EQ(after.boundary_loops.size(), before.boundary_loops.size());
  EXPECT_TRUE(after.non_manifold_edges.empty());
  std::size_t long_ones = 0;
  for (std::size_t t = 0; t < fine.mesh.triangles.size(); ++t) {
    Vec3 middle = Vec3::Zero();
    for (const int v : fine.mesh.triangles[t])
      middle += fine.mesh.points[static_cast<std::size_t>(v)] / 3;
    long_ones += middle.norm() < 5.7 && longest_edge(fine.mesh, t) > 0.3;
  }
  EXPECT_EQ(long_ones, 0u);
}

TEST(Refine, AClosedSurfaceStaysClosedAndManifold) {
  TriangleMesh coarse;  // an octahedron
  for (int axis = 0; axis < 3; ++axis) {
    coarse.points.push_back(3 * Vec3::Unit(axis));
    coarse.points.push_back(-3 * Vec3::Unit(axis));
  }
  for (int x = 0; x < 2; ++x) {
    for (int y = 2; y < 4; ++y) {
      for (int z = 4; z < 6; ++z)
        coarse.triangles.push_back((x + y + z) % 2 == 0 ? Triangle{x, y, z} : Triangle{x, z, y});
    }
  }
  const RefinedMesh fine = refine(
      coarse, [](int, const Vec3& x) { return x.x() > 0 ? 0.2 : kAny; }, kPlenty);
  const Topology found = topology(fine.mesh);
  EXPECT_TRUE(found.boundary_loops.empty());
  EXPECT_TRUE(found.non_manifold_edges.empty());
  // Euler: V - E + F = 2 with E = 3F/2.
  EXPECT_EQ(2 * fine.mesh.points.size(), fine.mesh.triangles.size() + 4);
}

TEST(Refine, RefusesMoreVerticesThanAllowed) {
  const TriangleMesh coarse = tube(2, 20, 12, 15);
  try {
    refine(
        coarse, [](int, const Vec3&) { return 0.05; }, 5000);
    FAIL();
  } catch (const Error& error) {
    EXPECT_EQ(error.code(), ExitCode::resources);
    EXPECT_NE(std::string(error.what()).find("5000"), std::string::npos);
  }
}

TEST(Refine, ArraysAreInheritedAndTheWrittenFileReadsBackTheSame) {
  const TemporaryFolder folder;
  const TriangleMesh mesh = tube(0.25, 2, 16, 11);  // cm
  using Xml = vtkXMLPolyDataWriter;
  const auto path = folder.write(
      "in.vtp", written<Xml>(rich_tube(mesh), [](Xml& w) { w.SetDataModeToBinary(); }));
  const Surface coarse = read_surface(path, LengthUnit::cm);
  const Surface fine = refine(
      coarse, [](int, const Vec3& x) { return x.z() < 8 ? 0.5 : kAny; }, kPlenty);
  ASSERT_GT(fine.mesh.points.size(), coarse.mesh.points.size() + 100);
  ASSERT_EQ(fine.face_of_triangle.size(), fine.mesh.triangles.size());
  write_surface(fine, fine.mesh.points, none_moved(fine), folder / "out.vtp");
  const Surface again = read_surface(folder / "out.vtp", LengthUnit::cm);
  EXPECT_EQ(again.mesh.points, fine.mesh.points);
  EXPECT_EQ(again.face_of_triangle, fine.face_of_triangle);
  EXPECT_EQ(again.mesh.triangles, fine.mesh.triangles);
  vtkPolyData* before = coarse.source->data;
  vtkPolyData* after = again.source->data;
  const auto expect_old_values_first = [](vtkFieldData* old_fields, vtkFieldData* new_fields) {
    ASSERT_GT(old_fields->GetNumberOfArrays(), 0);
    for (int a = 0; a < old_fields->GetNumberOfArrays(); ++a) {
      vtkDataArray* expected = old_fields->GetArray(a);
      vtkDataArray* actual = new_fields->GetArray(expected->GetName());
      ASSERT_NE(actual, nullptr) << expected->GetName();
      ASSERT_EQ(actual->GetDataType(), expected->GetDataType());
      for (vtkIdType i = 0; i < expected->GetNumberOfTuples(); ++i) {
        for (int k = 0; k < expected->GetNumberOfComponents(); ++k)
          ASSERT_EQ(actual->GetComponent(i, k), expected->GetComponent(i, k));
      }
    }
  };
  expect_old_values_first(before->GetPointData(), after->GetPointData());
  expect_old_values_first(before->GetCellData(), after->GetCellData());
  std::set<double> numbers;  // stay unique
  vtkDataArray* nodes = after->GetPointData()->GetArray("GlobalNodeID");
  for (vtkIdType i = 0; i < nodes->GetNumberOfTuples(); ++i)
    numbers.insert(nodes->GetComponent(i, 0));
  std::set<double> old_numbers;
  vtkDataArray* old_nodes = before->GetPointData()->GetArray("GlobalNodeID");
  for (vtkIdType i = 0; i < old_nodes->GetNumberOfTuples(); ++i)
    old_numbers.insert(old_nodes->GetComponent(i, 0));
  EXPECT_EQ(numbers.size() - old_numbers.size(),
            fine.mesh.points.size() - coarse.mesh.points.size());
}

}  // namespace
}  // namespace vstent::vessels
