#include <gtest/gtest.h>

#include <map>

#include "meshing/cap.hpp"
#include "meshing/quality.hpp"
#include "tests/meshing/models.hpp"

namespace vstent::meshing {
namespace {

using tests::tube;

TriangleMesh appended(const TriangleMesh& mesh, std::size_t from) {
  return {mesh.points,
          {mesh.triangles.begin() + static_cast<std::ptrdiff_t>(from), mesh.triangles.end()}};
}

TEST(Cap, TrianglesAreLikeTheRims) {
  TriangleMesh mesh = tube(3, 5, 60, 17);
  const TriangleMesh before = mesh;
  const Opening opening = find_openings(mesh).front();
  EXPECT_NEAR(opening.edge, 6 * std::sin(std::numbers::pi / 60), 1e-12);
  EXPECT_LT(opening.unevenness, 1e-12);
  close(mesh, opening, vessels::LengthUnit::mm);
  for (std::size_t p = 0; p < before.points.size(); ++p)
    ASSERT_EQ(mesh.points[p], before.points[p]);
  const TriangleMesh cap = appended(mesh, before.triangles.size());
  EXPECT_NEAR(tests::area_of(cap), 30 * 9 * std::sin(2 * std::numbers::pi / 60), 1e-9);
  const SurfaceQuality quality = measure_quality(cap);
  EXPECT_NEAR(quality.mean_edge, opening.edge, 0.1 * opening.edge);
  EXPECT_GT(quality.smallest_angle, 25);
  EXPECT_LT(quality.longest_edge, 1.5 * opening.edge);
  std::map<int, int> valence;  // a fan would have a point with 60
  for (const Triangle& t : cap.triangles)
    for (const int p : t) ++valence[p];
  for (const auto& [point, triangles] : valence) EXPECT_LE(triangles, 8);
}

TEST(Cap, OutlinesThatNoCentreSeesAreCoveredExactly) {
  // A U: its centre lies outside.
  const std::vector<std::array<double, 2>> outline = {{0, 0},     {6, 0},     {6, 5},   {4.5, 5},
                                                      {4.5, 1.5}, {1.5, 1.5}, {1.5, 5}, {0, 5}};
  std::vector<Vec3> ring;
  for (std::size_t i = 0; i < outline.size(); ++i) {
    const auto &a = outline[i], &b = outline[(i + 1) % outline.size()];
    for (int k = 0; k < 10; ++k)
      ring.emplace_back(a[0] + k * (b[0] - a[0]) / 10, a[1] + k * (b[1] - a[1]) / 10, 0);
  }
  TriangleMesh mesh;
  const int n = static_cast<int>(ring.size());
  for (int z = 0; z < 2; ++z)
    for (const Vec3& p : ring) mesh.points.push_back(p + z * Vec3::UnitZ());
  for (int i = 0; i < n; ++i) {
    const int j = (i + 1) % n;
    mesh.triangles.push_back({i, j, j + n});
    mesh.triangles.push_back({i, j + n, i + n});
  }
  const std::size_t wall = mesh.triangles.size();
  for (const Opening& opening : find_openings(mesh)) close(mesh, opening, vessels::LengthUnit::mm);
  EXPECT_TRUE(tests::closed_and_oriented(mesh));
  EXPECT_TRUE(vessels::self_intersections(mesh).empty());
  EXPECT_NEAR(tests::area_of(appended(mesh, wall)), 2 * (30 - 3 * 3.5), 1e-9);
  EXPECT_NEAR(enclosed_volume(mesh), 30 - 3 * 3.5, 1e-9);
}

TEST(Cap, AnUnevenRimIsSpannedBetweenItsLowestAndHighestPoint) {
  TriangleMesh mesh = tube(3, 5, 60, 17);
  const auto lift = [](const Vec3& p) { return 0.05 * (p.x() * p.x() - p.y() * p.y()); };
  for (std::size_t j = 0; j < 60; ++j) mesh.points[j].z() += lift(mesh.points[j]);
  for (const Opening& opening : find_openings(mesh)) {
    if (opening.outward.z() > 0) continue;
    EXPECT_NEAR(opening.unevenness, 0.45, 1e-9);
    const std::size_t wall = mesh.triangles.size();
    close(mesh, opening, vessels::LengthUnit::mm);
    for (const Triangle& t : appended(mesh, wall).triangles) {
      for (const int p : t) {
        const Vec3& x = mesh.points[static_cast<std::size_t>(p)];
        EXPECT_LE(std::abs(x.z()), 0.45 + 1e-9);
        // Over a circle the harmonic height is the same saddle, as x^2 - y^2 is harmonic itself.
        EXPECT_NEAR(x.z(), lift(x), 0.1 * 0.45);
      }
    }
  }
}

}  // namespace
}  // namespace vstent::meshing
