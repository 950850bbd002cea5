// Measures against closed forms, on generated vessels.
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "measure/measure.hpp"
#include "sdf/polyline.hpp"
#include "vessels/idealised.hpp"

namespace vstent::measure {
namespace {

vessels::IdealisedVessel tube(double radius) {
  vessels::IdealisedVessel vessel;
  vessel.radius = radius;
  vessel.stenosis = 0;
  vessel.length = 40;
  return vessel;
}

/// A smooth stent between two arc lengths of a straight vessel along z.
StentBody stent_between(double from, double to, double radius) {
  const Polyline axis{Vec3(0, 0, from), Vec3(0, 0, 0.5 * (from + to)), Vec3(0, 0, to)};
  return StentBody(sdf::voxelise(sdf::make_tube(axis, {radius, radius, radius}), {0.2, 3}));
}

vessels::Centerline axis_of(const vessels::IdealisedVessel& vessel) {
  vessels::CenterlineBranch branch;
  branch.points = vessels::idealised_axis(vessel, 0.5);
  for (const double s : arc_lengths(branch.points))
    branch.radii.push_back(vessels::idealised_radius(vessel, s));
  return {{branch}};
}

TEST(Measure, NothingMovedGivesZeros) {
  const auto vessel = tube(5);
  const vessels::Surface surface = vessels::make_surface(vessels::idealised_vessel(vessel), "tube");
  const vessels::Centerline centerline = axis_of(vessel);
  const StentBody stent = stent_between(10, 30, 5);
  const Metrics m = measure({surface, surface, centerline, &stent}).metrics;
  EXPECT_EQ(m.moved_vertices, 0u);
  EXPECT_EQ(m.largest_displacement, 0);
  EXPECT_EQ(m.inverted_triangles, 0u);
  EXPECT_EQ(m.new_self_intersections, 0u);
  EXPECT_EQ(m.openings_before, 2u);
  EXPECT_FALSE(m.closed_after);
  EXPECT_GT(m.narrowest_before, 9.9);
  EXPECT_EQ(m.narrowest_before, m.narrowest_after);
  EXPECT_EQ(m.volume_before, m.volume_after);
  EXPECT_EQ(m.lateral_shift, 0);
  EXPECT_EQ(m.curve_before.total, m.curve_after.total);
  ASSERT_TRUE(m.wall.has_value());
  EXPECT_EQ(m.wall->circumferential.p5, 1);
  EXPECT_EQ(m.wall->circumferential.p99, 1);
  EXPECT_EQ(m.wall->area_ratio.p50, 1);
  EXPECT_EQ(m.wall->overstretched[0], 0);
}

}  // namespace
}  // namespace vstent::measure
