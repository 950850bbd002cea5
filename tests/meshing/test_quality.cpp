#include <gtest/gtest.h>

#include "meshing/crossings.hpp"
#include "meshing/edge_lengths.hpp"
#include "meshing/quality.hpp"
#include "tests/meshing/models.hpp"
#include "tests/sdf/meshes.hpp"
#include "tests/sdf/shapes.hpp"
#include "vessels/error.hpp"

namespace vstent::meshing {
namespace {

TEST(Quality, OfTrianglesWithClosedForms) {
  const TriangleMesh equilateral{{{0, 0, 0}, {2, 0, 0}, {1, std::sqrt(3.0), 0}}, {{0, 1, 2}}};
  const SurfaceQuality best = measure_quality(equilateral);
  EXPECT_NEAR(best.smallest_angle, 60, 1e-12);
  EXPECT_NEAR(best.largest_aspect_ratio, 1, 1e-12);
  const TriangleMesh right{{{0, 0, 0}, {4, 0, 0}, {0, 3, 0}}, {{0, 1, 2}}};  // inscribed radius 1
  const SurfaceQuality quality = measure_quality(right);
  EXPECT_NEAR(quality.smallest_angle, std::atan2(3, 4) * 180 / std::numbers::pi, 1e-12);
  EXPECT_NEAR(quality.largest_aspect_ratio, 5 / (2 * std::sqrt(3.0)), 1e-12);
  EXPECT_EQ(quality.area, 6);
  EXPECT_EQ(quality.mean_edge, 4);
  std::size_t edges = 0;
  for (const auto& bin : quality.edge_lengths) edges += bin.edges;
  EXPECT_EQ(edges, 3u);
}

TEST(Quality, DistanceAndVolumeOfSpheres) {
  const TriangleMesh inner = tests::icosphere(2, 4), outer = tests::icosphere(2.5, 4);
  EXPECT_NEAR(one_way_distance(inner, outer), 0.5,
              0.01);  // edges of 0.15 mm: 0.15^2 / (6 R) = 0.002
  EXPECT_LT(one_way_distance(inner, inner), 1e-12);
  const double ball = 4.0 / 3 * std::numbers::pi * 8;
  EXPECT_NEAR(enclosed_volume(inner), ball, 0.005 * ball);
}

TEST(Quality, CrossingsAreRefusedWithPlacesInTheFilesUnit) {
  TriangleMesh mesh = tests::icosphere(5, 2);
  const TriangleMesh other = tests::icosphere(5, 2, {9.9, 0, 0});
  const int first = static_cast<int>(mesh.points.size());
  mesh.points.insert(mesh.points.end(), other.points.begin(), other.points.end());
  for (const auto& [a, b, c] : other.triangles)
    mesh.triangles.push_back({a + first, b + first, c + first});
  ASSERT_FALSE(crossings(mesh).empty());
  for (const Vec3& place : crossings(mesh)) EXPECT_NEAR(place.x(), 4.95, 1.5);
  try {
    require_no_crossings(mesh, vessels::LengthUnit::cm, "two balls");
    FAIL();
  } catch (const Error& error) {
    const std::string line = error.what();
    EXPECT_EQ(line.find("two balls: "), 0u);
    EXPECT_NE(line.find(" mm = ("), std::string::npos) << line;
    EXPECT_EQ(error.code(), ExitCode::geometry);
  }
}

TEST(EdgeLengths, CurvatureOfSphereAndCylinder) {
  const TriangleMesh ball = tests::icosphere(4, 4);
  for (const double k : curvatures(ball, std::vector<int>(ball.triangles.size(), 1)))
    EXPECT_NEAR(k, 0.25, 0.05 * 0.25);
  const TriangleMesh pipe = tests::tube(4, 12, 80, 39);
  const std::vector<double> bent = curvatures(pipe, std::vector<int>(pipe.triangles.size(), 1));
  for (std::size_t p = 0; p < bent.size(); ++p)
    if (std::abs(pipe.points[p].z() - 6) < 4) {
      EXPECT_NEAR(bent[p], 0.25, 0.05 * 0.25);
    }
}

TEST(EdgeLengths, GradedFromEdgesThatStayLikeTheSlowTwin) {
  // Rims of 0.1 mm and of 1 mm edges; in between 0.4 mm is wanted.
  TriangleMesh mesh = tests::tube(3, 10, 188, 2);
  TriangleMesh coarse = tests::tube(3, 10, 19, 2);
  for (Vec3& p : coarse.points) p.z() += 20;
  const int first = static_cast<int>(mesh.points.size());
  mesh.points.insert(mesh.points.end(), coarse.points.begin(), coarse.points.end());
  for (const auto& [a, b, c] : coarse.triangles)
    mesh.triangles.push_back({a + first, b + first, c + first});
  const std::vector<int> face(mesh.triangles.size(), 1);
  EdgeLengths wanted;
  wanted.everywhere = 0.4;
  const LengthField field(mesh, face, std::vector<char>(mesh.points.size(), 1), wanted);
  const double fine_edge = 6 * std::sin(std::numbers::pi / 188);
  const double coarse_edge = 6 * std::sin(std::numbers::pi / 19);
  tests::Random random(3);
  for (int i = 0; i < 500; ++i) {
    const Vec3 x = random.in_box({-3, -3, -2}, {3, 3, 32});
    double most = 1e9, least = 0;
    for (std::size_t p = 0; p < mesh.points.size(); ++p) {
      const double rim = static_cast<int>(p) < first ? fine_edge : coarse_edge;
      const double change = wanted.grading * (mesh.points[p] - x).norm();
      most = std::min(most, rim + change);
      least = std::max(least, rim - change);
    }
    EXPECT_NEAR(field.at(x, 0.4), std::max(std::min(0.4, most), least), 1e-12);
  }
}

}  // namespace
}  // namespace vstent::meshing
