#include <gtest/gtest.h>

#include <cmath>
#include <map>
#include <numbers>

#include "stents/cover.hpp"

namespace vstent::stents {
namespace {

double volume(const TriangleMesh& mesh) {
  double six = 0;
  for (const Triangle& t : mesh.triangles) {
    const auto p = [&](std::size_t k) { return mesh.points[static_cast<std::size_t>(t[k])]; };
    six += p(0).dot(p(1).cross(p(2)));
  }
  return six / 6;
}

// A regular 64-gon covers n/2 sin(2 pi/n) of the squared radius, in place of pi: the shells of a
// straight tube are prisms over the difference of two such.
TEST(Cover, SleevesAreClosedShellsOfTheirThickness) {
  const Polyline axis{{0, 0, 0}, {0, 0, 2}, {0, 0, 7}};
  const std::vector<double> radii(3, 1.5);
  const TriangleMesh mesh = cover_surface({0.1, 0.2}, axis, radii, 0.3);
  const double polygon = 32 * std::sin(2 * std::numbers::pi / 64);
  const double outer = polygon * (1.7 * 1.7 - 1.5 * 1.5) * 7;
  const double inner = polygon * (1.2 * 1.2 - 1.1 * 1.1) * 7;
  EXPECT_NEAR(volume(mesh), outer + inner, 1e-9);
  std::map<std::pair<int, int>, int> edges;
  for (const Triangle& t : mesh.triangles)
    for (std::size_t k = 0; k < 3; ++k) ++edges[{t[k], t[(k + 1) % 3]}];
  for (const auto& [edge, count] : edges) {
    EXPECT_EQ(count, 1);
    EXPECT_EQ(edges.count({edge.second, edge.first}), 1u);
  }
}

TEST(Cover, NoneIsEmptyAndTooThickIsRefused) {
  const Polyline axis{{0, 0, 0}, {0, 0, 2}};
  const std::vector<double> radii(2, 1.0);
  EXPECT_TRUE(cover_surface({}, axis, radii, 0.1).points.empty());
  EXPECT_THROW(cover_surface({0.95, 0}, axis, radii, 0.1), std::invalid_argument);
}

}  // namespace
}  // namespace vstent::stents
