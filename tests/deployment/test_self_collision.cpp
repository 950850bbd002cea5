// A stent in one of two vessels that lie side by side: the other one gives way and is not crossed.
#include <gtest/gtest.h>
#include <oneapi/tbb/global_control.h>

#include <map>

#include "tests/data.hpp"
#include "tests/deployment/whole_run.hpp"
#include "vessels/check.hpp"
#include "vessels/error.hpp"
#include "vessels/idealised.hpp"
#include "xpbd/lead_apart.hpp"

namespace vstent::deployment {
namespace {

using nlohmann::json;
using tests::TemporaryFolder;
using tests::WholeRun;

constexpr double kRadius = 5, kStentRadius = 6.5, kBetween = 0.6;

/// Two straight tubes side by side, the second a mirror image of the first, joined by a window far
/// from the stent: one surface, as two iliac branches are.
vessels::Surface pair_of_vessels(double edge) {
  vessels::IdealisedVessel vessel;
  vessel.radius = kRadius;
  vessel.length = 80;
  vessel.stenosis = 0;
  vessel.edge_length = edge;
  const TriangleMesh one = vessels::idealised_vessel(vessel);
  const Vec3 window(kRadius, 0, 70);
  const auto at = [&](int v) -> const Vec3& { return one.points[static_cast<std::size_t>(v)]; };
  TriangleMesh both{one.points, {}};
  const int count = static_cast<int>(one.points.size());
  for (const Vec3& p : one.points)
    both.points.push_back({2 * kRadius + kBetween - p.x(), p.y(), p.z()});
  std::map<std::pair<int, int>, int> sides;  // of the triangles that are left out
  for (const Triangle& t : one.triangles) {
    const auto in_window = [&](int v) { return (at(v) - window).norm() < 2.5; };
    if (std::all_of(t.begin(), t.end(), in_window)) {
      for (std::size_t k = 0; k < 3; ++k) ++sides[{t[k], t[(k + 1) % 3]}];
      continue;
    }
    both.triangles.push_back(t);
    both.triangles.push_back({t[0] + count, t[2] + count, t[1] + count});
  }
  for (const auto& [side, used] : sides) {
    const auto [a, b] = side;
    if (sides.contains({b, a})) continue;
    both.triangles.push_back({a, b, b + count});
    both.triangles.push_back({a, b + count, a + count});
  }
  // Vertices inside the window belong to no triangle any more.
  std::vector<int> number(both.points.size(), -1);
  TriangleMesh joined;
  for (Triangle& t : both.triangles) {
    for (int& v : t) {
      int& n = number[static_cast<std::size_t>(v)];
      if (n < 0) {
        n = static_cast<int>(joined.points.size());
        joined.points.push_back(both.points[static_cast<std::size_t>(v)]);
      }
      v = n;
    }
    joined.triangles.push_back(t);
  }
  return vessels::make_surface(joined, "pair");
}

void write(const vessels::Surface& surface, const std::filesystem::path& path) {
  vessels::write_surface(surface, surface.mesh.points,
                         std::vector<char>(surface.mesh.points.size(), 0), path);
}

Case make_case(const std::filesystem::path& surface, const json& wall) {
  json whole = {{"vessel", {{"surface", surface.string()}, {"units", "mm"}}},
                {"stent", {{"at", {0, 0, 22}}, {"length", "18mm"}, {"diameter", "13mm"}}},
                {"wall", wall}};
  return parse_case(whole, "test", "/");
}

WholeRun run(const TemporaryFolder& folder, double edge, bool kept_apart = true) {
  write(pair_of_vessels(edge), folder / "pair.vtp");
  return tests::run(folder, make_case(folder / "pair.vtp", {{"self_collision", kept_apart}}));
}

/// mm along x, away from the stented vessel, of the other one's near wall beside the stent's
/// middle.
double pushed_aside(const WholeRun& r) {
  double moved = 0, nearest = 1e9;
  for (std::size_t v = 0; v < r.outcome.positions.size(); ++v) {
    const Vec3& before = r.setup.surface.mesh.points[v];
    const double distance = (before - Vec3(kRadius + kBetween, 0, 22)).norm();
    if (before.x() < kRadius + 0.5 * kBetween || distance >= nearest) continue;
    nearest = distance;
    moved = r.outcome.positions[v].x() - before.x();
  }
  return moved;
}

// The widened wall comes to lie where the other's was: kept apart, that gives way by what the stent
// widens the vessel, less what the pressure takes of the distance they had: of a tenth of the
// modulus 1 - 1 / sqrt(1.2). Where it is dented it may lift off in the middle of the dent. Not kept
// apart, it stays, and is crossed.
TEST(SelfCollision, AStentedVesselPushesTheOneBesideItAside) {
  const TemporaryFolder folder;
  const WholeRun apart = run(folder, 0.8);
  EXPECT_TRUE(apart.outcome.converged);
  EXPECT_EQ(apart.metrics.new_self_intersections, 0u);
  EXPECT_EQ(apart.metrics.inverted_triangles, 0u);
  EXPECT_GT(apart.outcome.self_contact.places, 20);
  EXPECT_EQ(apart.outcome.self_contact.against_held, 0);
  EXPECT_GT(apart.outcome.self_contact.least_clearance, 0.8 * kBetween);
  const double widened = kStentRadius - kRadius;
  EXPECT_GE(pushed_aside(apart), widened - 0.2 * kBetween);
  EXPECT_LE(pushed_aside(apart), 1.3 * widened);
  EXPECT_GE(apart.outcome.self_contact.pushed_aside, widened - 0.2 * kBetween);

  // Edges half as long again: inscribed polygons of edge h lie h^2 / (8 R) inside their circles,
  // on both sides, and as much in where the near wall comes to rest.
  const WholeRun coarser = run(folder, 1.2);
  EXPECT_EQ(coarser.metrics.new_self_intersections, 0u);
  EXPECT_NEAR(coarser.outcome.self_contact.pushed_aside, apart.outcome.self_contact.pushed_aside,
              3 * 1.2 * 1.2 / (8 * kRadius));

  const WholeRun crossed = run(folder, 0.8, false);
  EXPECT_GT(crossed.metrics.new_self_intersections, 0u);
  EXPECT_EQ(pushed_aside(crossed), 0);
}

TEST(SelfCollision, NeedsAWallWithAThickness) {
  EXPECT_THROW(make_case("pair.vtp", {{"preset", "paper"}, {"self_collision", true}}), Error);
}

// A fine wall that would be handed a shape in which two vessels have changed places is led towards
// it until they meet.
TEST(SelfCollision, AShapeThatCrossesIsApproachedOnlyAsFarAsItGoes) {
  const TriangleMesh one = vessels::idealised_vessel({.radius = 2, .length = 8, .stenosis = 0});
  TriangleMesh both = one;
  const int count = static_cast<int>(one.points.size());
  for (const Vec3& p : one.points) both.points.push_back(p + Vec3(5, 0, 0));
  for (const Triangle& t : one.triangles)
    both.triangles.push_back({t[0] + count, t[1] + count, t[2] + count});
  xpbd::Sheet sheet =
      xpbd::make_sheet(both.points, both.triangles, std::vector<char>(both.points.size(), 0),
                       xpbd::Membrane{1, 0.1, 0.45});
  sheet.surface = xpbd::SurfaceOfWall{both.triangles, std::vector<double>(both.points.size(), 0.1),
                                      std::vector<double>(both.points.size(), 1)};
  std::vector<Vec3> target = both.points;
  for (std::size_t v = 0; v < target.size(); ++v) target[v].x() += v < one.points.size() ? 1 : -1;
  const auto crosses = [&](const std::vector<Vec3>& points) {
    return !vessels::self_intersections({points, both.triangles}).empty();
  };
  EXPECT_FALSE(crosses(both.points));
  EXPECT_TRUE(crosses(target));
  const std::vector<Vec3> reached = xpbd::lead_apart(sheet, target);
  EXPECT_FALSE(crosses(reached));
  double farthest = 0;
  for (std::size_t v = 0; v < one.points.size(); ++v)
    farthest = std::max(farthest, reached[v].x() - both.points[v].x());
  EXPECT_GT(farthest, 0.4);  // they were 1 mm apart

  for (std::size_t v = 0; v < target.size(); ++v) target[v] = both.points[v] + Vec3(0.3, 0.1, 0);
  const std::vector<Vec3> there = xpbd::lead_apart(sheet, target);
  for (std::size_t v = 0; v < target.size(); ++v) EXPECT_LT((there[v] - target[v]).norm(), 1e-6);
}

}  // namespace
}  // namespace vstent::deployment
