// Apposition and penetration of stents whose distance to the wall is known.
#include <gtest/gtest.h>

#include <random>

#include "sdf/exact_field.hpp"
#include "tests/measure/vessels.hpp"

namespace vstent::measure {
namespace {

using tests::TestVessel;

constexpr double kVoxel = 0.2;
// Of level sets of radius r: h^2 / (8 r) by interpolation and as much by facets; single precision.
double field_error(double r) { return 2 * kVoxel * kVoxel / (8 * r) + 1e-4; }

TestVessel tube_of(double radius) {
  return tests::lathe(40, 120, 81, [=](double) { return radius; });
}
double sag(double radius) { return radius * (1 - std::cos(std::numbers::pi / 120)); }

TEST(StentBody, DistancesReachBeyondTheBand) {
  const Polyline axis{Vec3(0, 0, 8), Vec3(0, 0, 15), Vec3(0, 0, 22)};
  const sdf::ExactField exact(sdf::make_tube(axis, {4, 4, 4}));
  const StentBody stent = tests::straight_stent(8, 22, 4, kVoxel);
  std::mt19937 random(3);
  std::uniform_real_distribution<double> any(-12, 12);
  std::vector<Vec3> points;
  for (int i = 0; i < 2000; ++i)
    points.emplace_back(any(random), any(random), 15 + 1.5 * any(random));
  const std::vector<double> distances = stent.distances(points);
  int far = 0;
  for (std::size_t i = 0; i < points.size(); ++i) {
    const double truth = exact.sample(points[i]).distance;
    far += std::abs(truth) > 3 * kVoxel;
    // Facets bevel the caps' sharp rims by up to half a voxel's diagonal.
    EXPECT_NEAR(distances[i], truth, 0.5 * std::sqrt(3) * kVoxel) << points[i].transpose();
    EXPECT_EQ(std::signbit(distances[i]), std::signbit(truth) && std::abs(truth) > 0)
        << points[i].transpose() << " " << truth;
  }
  EXPECT_GT(far, 1000);
}

TEST(Apposition, GapOfAStentThatIsTooSmall) {
  const TestVessel tube = tube_of(5);
  const StentBody stent = tests::straight_stent(10, 30, 4.7, kVoxel);
  const Metrics m = measure({tube.surface, tube.surface, tube.centerline, &stent}).metrics;
  ASSERT_TRUE(m.apposition);
  const double tolerance = sag(5) + field_error(4.7);
  EXPECT_NEAR(m.apposition->mean_gap, 0.3, tolerance);
  EXPECT_GE(m.apposition->share_with_gap[1], 99.0);  // above 0.2 mm
  EXPECT_EQ(m.apposition->share_with_gap[2], 0);     // not above 0.4 mm
  EXPECT_EQ(m.apposition->over_openings, 0);
  EXPECT_EQ(m.deepest_penetration, 0);
  const double side = 2 * std::numbers::pi * 4.7 * 20;
  EXPECT_NEAR(m.apposition->area, side, 0.02 * side);  // rims are bevelled
  EXPECT_NEAR(m.treated_from, 10, 0.5);
  EXPECT_NEAR(m.treated_to, 30, 0.5);
}

TEST(Apposition, PenetrationOfAStentThatIsTooLarge) {
  const TestVessel tube = tube_of(5);
  const StentBody stent = tests::straight_stent(10, 30, 5.25, kVoxel);
  const Metrics m = measure({tube.surface, tube.surface, tube.centerline, &stent}).metrics;
  EXPECT_NEAR(m.deepest_penetration, 0.25, field_error(5.25));  // vertices lie on the circle
  EXPECT_EQ(m.apposition->mean_gap, 0);
}

TEST(Apposition, AStentThatHangsOutOfTheVesselIsOverAnOpening) {
  const TestVessel tube = tube_of(5);
  const StentBody stent = tests::straight_stent(30, 46, 4.95, kVoxel);
  const Metrics m = measure({tube.surface, tube.surface, tube.centerline, &stent}).metrics;
  // 6 of its 16 mm lie beyond the end, the first tenth of a millimetre not farther than that.
  EXPECT_NEAR(m.apposition->over_openings, 100 * 5.9 / 16, 3);
  EXPECT_LT(m.apposition->largest_gap, 0.1 + sag(5) + field_error(4.95));
}

TEST(Expansion, AgainstTheNominalDiameter) {
  const TestVessel tube = tube_of(5);
  const StentBody stent = tests::straight_stent(10, 30, 5, kVoxel);
  Comparison comparison{tube.surface, tube.surface, tube.centerline, &stent};
  EXPECT_FALSE(measure(comparison).metrics.expansion_mean);
  comparison.nominal_diameter = 12.5;
  const Metrics m = measure(comparison).metrics;
  const double diameter = tests::equivalent_diameter(tests::polygon_area(120, 5));
  EXPECT_NEAR(*m.expansion_mean, 100 * diameter / 12.5, 1e-6);
  EXPECT_NEAR(*m.expansion_min, 100 * diameter / 12.5, 1e-6);
  EXPECT_NEAR(m.opened_mean_over_target, diameter / 12.5, 1e-8);
  EXPECT_EQ(m.opened_share, 1);
}

}  // namespace
}  // namespace vstent::measure
