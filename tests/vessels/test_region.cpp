#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <set>
#include <stdexcept>

#include "tests/vessels/shapes.hpp"
#include "vessels/region.hpp"

namespace vstent::vessels {
namespace {

using tests::tube;

constexpr int kAround = 24;
constexpr double kRadius = 2;

/// 41 rings, half a millimetre apart.
TriangleMesh vessel() { return tube(kRadius, 20, kAround, 41); }

Polyline axis(double from, double to) { return {Vec3(0, 0, from), Vec3(0, 0, to)}; }

std::size_t at(int index) { return static_cast<std::size_t>(index); }

std::set<int> movable(const Region& region) {
  std::set<int> result;
  for (std::size_t i = 0; i < region.vertices.size(); ++i) {
    if (!region.pinned[i]) result.insert(region.vertices[i]);
  }
  return result;
}

/// The vertices of a straight tube within `reach` of its axis between `from` and `to`, rims left
/// out.
std::set<int> within(const TriangleMesh& mesh, double from, double to, double reach) {
  std::set<int> result;
  for (std::size_t v = 0; v < mesh.points.size(); ++v) {
    const Vec3& x = mesh.points[v];
    const double beyond = std::max({from - x.z(), x.z() - to, 0.0});
    const bool rim = x.z() < 1e-9 || x.z() > 20 - 1e-9;
    if (!rim && std::hypot(x.x(), x.y(), beyond) <= reach) result.insert(static_cast<int>(v));
  }
  return result;
}

void expect_well_formed(const Region& region, const TriangleMesh& mesh) {
  ASSERT_EQ(region.vertices.size(), region.pinned.size());
  ASSERT_EQ(region.triangles.size(), region.triangle_ids.size());
  EXPECT_TRUE(std::is_sorted(region.vertices.begin(), region.vertices.end()));
  std::map<std::pair<int, int>, int> uses;
  for (std::size_t i = 0; i < region.triangles.size(); ++i) {
    for (std::size_t k = 0; k < 3; ++k) {
      const int vertex = region.vertices[at(region.triangles[i][k])];
      EXPECT_EQ(vertex, mesh.triangles[at(region.triangle_ids[i])][k]);
      const auto edge = std::minmax(region.triangles[i][k], region.triangles[i][(k + 1) % 3]);
      ++uses[{edge.first, edge.second}];
    }
  }
  // Every edge at a movable vertex has both its triangles, and so has every edge of a triangle that
  // moves: only edges between pinned vertices of support triangles are free.
  for (std::size_t i = 0; i < region.triangles.size(); ++i) {
    const Triangle& t = region.triangles[i];
    const bool moves =
        std::any_of(t.begin(), t.end(), [&](int v) { return !region.pinned[at(v)]; });
    for (std::size_t k = 0; k < 3 && moves; ++k) {
      const auto edge = std::minmax(t[k], t[(k + 1) % 3]);
      EXPECT_EQ((uses[{edge.first, edge.second}]), 2);
    }
  }
  const std::set<int> free = movable(region);
  const std::set<int> taken(region.triangle_ids.begin(), region.triangle_ids.end());
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    const Triangle& corners = mesh.triangles[t];
    if (std::any_of(corners.begin(), corners.end(), [&](int v) { return free.contains(v); })) {
      EXPECT_TRUE(taken.contains(static_cast<int>(t)));
    }
  }
}

TEST(Region, IsWhatLiesWithinReachOfTheAxis) {
  const TriangleMesh mesh = vessel();
  const Region region = find_region(mesh, {}, axis(7, 13), std::vector<double>{2.6, 2.6});
  expect_well_formed(region, mesh);
  EXPECT_EQ(movable(region), within(mesh, 7, 13, 2.6));
  EXPECT_FALSE(region.meets_opening);
  EXPECT_GT(std::count(region.pinned.begin(), region.pinned.end(), 1), 4 * kAround - 1)
      << "a pinned ring on either side, and one beyond it that supports it";
  const double chord = 2 * kRadius * std::sin(std::numbers::pi / kAround);  // 0.522 > ring spacing
  EXPECT_NEAR(region.median_edge, chord, 1e-9) << "edges along, around, across: the middle one";
}

TEST(Region, ReachVariesAlongTheAxis) {
  const TriangleMesh mesh = vessel();
  // The wall is 2 from the axis: within a reach that grows from 1 to 3 beyond the axis's middle.
  const Region region = find_region(mesh, {}, axis(5, 15), std::vector<double>{1, 3});
  expect_well_formed(region, mesh);
  for (const int v : movable(region)) EXPECT_GE(mesh.points[at(v)].z(), 10 - 1e-9);
  EXPECT_TRUE(movable(region).contains(24 * kAround));  // at 12 mm, well within
}

TEST(Region, AVesselThatMerelyLiesCloseStays) {
  TriangleMesh mesh = vessel();
  const int count = static_cast<int>(mesh.points.size());
  const TriangleMesh alone = mesh;
  for (const Vec3& x : alone.points) mesh.points.push_back(x + Vec3(2 * kRadius + 0.2, 0, 0));
  for (const Triangle& t : alone.triangles) {
    mesh.triangles.push_back({t[0] + count, t[1] + count, t[2] + count});
  }
  const double reach = 3;  // beyond the gap: the neighbour's wall begins at 2.2
  const Region region = find_region(mesh, {}, axis(7, 13), std::vector<double>{reach, reach});
  expect_well_formed(region, mesh);
  EXPECT_LT(region.vertices.back(), count);
  EXPECT_EQ(movable(region), within(alone, 7, 13, reach));
}

TEST(Region, OpenRimsNeverMove) {
  const TriangleMesh mesh = vessel();
  const Region region = find_region(mesh, {}, axis(0, 5), std::vector<double>{2.6, 2.6});
  EXPECT_TRUE(region.meets_opening);
  EXPECT_EQ(movable(region), within(mesh, 0, 5, 2.6));
  for (std::size_t i = 0; i < region.vertices.size(); ++i) {
    EXPECT_TRUE(region.vertices[i] >= kAround || region.pinned[i]);
  }
}

TEST(Region, CapsNeverMove) {
  const TriangleMesh mesh = vessel();
  std::vector<char> fixed(mesh.triangles.size(), 0);
  const std::size_t first = mesh.triangles.size() - 3 * 2 * kAround;  // the last three rows
  std::fill(fixed.begin() + static_cast<std::ptrdiff_t>(first), fixed.end(), 1);
  const Region region = find_region(mesh, fixed, axis(12, 20), std::vector<double>{2.6, 2.6});
  EXPECT_TRUE(region.meets_opening);
  std::set<int> expected = within(mesh, 12, 20, 2.6);
  for (std::size_t t = first; t < mesh.triangles.size(); ++t) {
    for (const int v : mesh.triangles[t]) expected.erase(v);
  }
  EXPECT_EQ(movable(region), expected);
}

TEST(Region, AVesselThatIsReachedGivesWayAndOneThatIsNotStays) {
  TriangleMesh mesh = vessel();
  const std::size_t own = mesh.points.size();
  const TriangleMesh beside = vessel();
  for (const Vec3& p : beside.points) mesh.points.push_back(p + Vec3(4.3, 0, 0));
  for (const Triangle& t : beside.triangles) {
    const int first = static_cast<int>(own);
    mesh.triangles.push_back({t[0] + first, t[1] + first, t[2] + first});
  }
  const std::vector<double> reach{2.6, 2.6};
  const Region alone = find_region(mesh, {}, axis(7, 13), reach);
  for (const double reached : {2.2, 2.5}) {  // the other wall begins at 2.3
    const Region both = find_region(mesh, {}, axis(7, 13), reach,
                                    {axis(7, 13), std::vector<double>{reached, reached}, 2});
    int giving_way = 0;
    for (std::size_t i = 0; i < both.vertices.size(); ++i) {
      EXPECT_EQ(both.beside[i] && !both.pinned[i], at(both.vertices[i]) >= own && !both.pinned[i]);
      giving_way += both.beside[i];
    }
    EXPECT_EQ(giving_way > 0, reached > 2.3);
    if (giving_way == 0) {
      EXPECT_EQ(both.vertices, alone.vertices);
    }
    expect_well_formed(both, mesh);
  }
}

TEST(Region, RefusesAReachThatNoWallLiesIn) {
  EXPECT_THROW(find_region(vessel(), {}, axis(7, 13), std::vector<double>{1.9, 1.9}),
               std::invalid_argument);
}

}  // namespace
}  // namespace vstent::vessels
