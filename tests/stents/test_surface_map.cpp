#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <random>

#include "sdf/polyline.hpp"
#include "stents/bent_tube.hpp"
#include "stents/surface_map.hpp"
#include "tests/stents/pipes.hpp"

namespace vstent::stents {
namespace {

constexpr double kStraightRadius = 1.5;

constexpr double kStart = 2;

/// A helix of this radius and pitch, whose curvature is r / (r^2 + (p / 2 pi)^2) and which twists.
Polyline helix(double radius, double pitch, double length) {
  Polyline axis;
  const double rise = pitch / (2 * std::numbers::pi);
  const double per_angle = std::hypot(radius, rise);
  for (int i = 0; i <= 90; ++i) {
    const double angle = length * i / 90 / per_angle;
    axis.emplace_back(radius * std::cos(angle), radius * std::sin(angle), rise * angle);
  }
  return axis;
}

SurfaceMap make_map(const Polyline& axis, double proximal, double distal) {
  std::vector<double> radii;
  for (std::size_t i = 0; i < axis.size(); ++i)
    radii.push_back(proximal + (distal - proximal) * static_cast<double>(i) /
                                   static_cast<double>(axis.size() - 1));
  return {with_frames(axis, Vec3::UnitX()), kStart, radii, kStraightRadius};
}

struct Bend {
  Polyline axis;
  double proximal, distal;
};

/// Straight, a gentle and a tight bend: up to 0.9 of the curvature that folds the tube, beyond
/// which no map has an inverse.
std::vector<Bend> bends() {
  return {{{Vec3(1, 2, 3), Vec3(1, 2, 16)}, 1.2, 1.2},
          {helix(12, 20, 13), 1.0, 1.0},
          {helix(3, 8, 13), 1.6, 2.2},
          {helix(2.2, 2, 13), 2.0, 1.5}};
}

TEST(SurfaceMap, TheWayBackIsTheInverseOfTheWayThere) {
  std::mt19937 random(3);
  std::uniform_real_distribution<double> share(0, 1);
  for (const Bend& bend : bends()) {
    const SurfaceMap map = make_map(bend.axis, bend.proximal, bend.distal);
    for (int i = 0; i < 2000; ++i) {
      const double radius = kStraightRadius - 0.4 * share(random), angle = 6.3 * share(random);
      const Vec3 straight(radius * std::cos(angle), radius * std::sin(angle), 9 * share(random));
      const Vec3 x = map.placed(straight);
      const double guess = straight.z() + 0.2 * (share(random) - 0.5);
      const auto way = map.way_out(x, guess);
      ASSERT_TRUE(way.has_value());
      EXPECT_LT((way->straight() - straight).norm(), 1e-9);
      // And the line out is the same line, point by point.
      EXPECT_LT((x + 0.05 * way->outward - map.placed(way->straight(0.05))).norm(), 1e-9);
    }
  }
}

TEST(SurfaceMap, NewtonsFootIsTheSlowOne) {
  const AxisWithFrames axis = with_frames(helix(3, 8, 9), Vec3::UnitX());
  const BentTube tube(axis, 0.5);
  for (const double z : {-0.8, 0.0, 0.31, 4.2, 8.3, 9.9}) {
    for (const double angle : {0.0, 2.0, 4.0}) {
      const PatternPoint there{1.7, angle, z};
      const Vec3 x = tube.point(there);
      const double foot = tube.foot(x, z + 0.05);
      EXPECT_NEAR(foot, tube.coordinates(x, {1.7, angle, z + 0.05}).z, 1e-10);
      EXPECT_NEAR(foot, z, 1e-10);
    }
  }
}

TEST(SurfaceMap, KeepsTheMetalsThickness) {
  const tests::Pipe straight{.outer = kStraightRadius, .inner = 1.38};
  const TriangleMesh mesh = tests::pipe(straight);
  const std::size_t half = mesh.points.size() / 2;
  const auto around = static_cast<std::size_t>(straight.around);
  for (const Bend& bend : bends()) {
    const TriangleMesh placed = make_map(bend.axis, bend.proximal, bend.distal).placed(mesh);
    for (std::size_t i = 0; i < half; ++i) {
      // The profile comes back down the inside.
      const std::size_t row = i / around, column = i % around;
      const std::size_t inner = mesh.points.size() - (row + 1) * around + column;
      EXPECT_NEAR((placed.points[i] - placed.points[inner]).norm(), 0.12, 1e-12);
    }
  }
}

TEST(SurfaceMap, NoLengthShrinksByMoreThanTheLeastStretch) {
  std::mt19937 random(5);
  std::uniform_real_distribution<double> share(-1, 1);
  for (const Bend& bend : bends()) {
    const SurfaceMap map = make_map(bend.axis, bend.proximal, bend.distal);
    const double stretch = map.least_stretch();
    EXPECT_GT(stretch, 0);
    EXPECT_LE(stretch, 1);
    double least = 2;
    for (int i = 0; i < 3000; ++i) {
      const double angle = 3.1416 * share(random), z = 4.5 + 4.4 * share(random);
      const Vec3 out(std::cos(angle), std::sin(angle), 0);
      // Directions in the plane of the radial line and the axis.
      const double tilt = 3.1416 * share(random);
      const Vec3 step = 1e-5 * (std::cos(tilt) * out + std::sin(tilt) * Vec3::UnitZ());
      const Vec3 from = kStraightRadius * out + z * Vec3::UnitZ();
      least = std::min(least, (map.placed(from + step) - map.placed(from)).norm() / step.norm());
    }
    // Between axis points the Hermite curve bends a little more than its tangents' turn says.
    EXPECT_GT(least, stretch - 0.05);
  }
}

TEST(SurfaceMap, TheLargestMoveIsNoneForTheSameAndAllForATranslation) {
  const Polyline axis = helix(3, 8, 9);
  const SurfaceMap map = make_map(axis, 1, 1);
  EXPECT_EQ(map.largest_move(make_map(axis, 1, 1)), 0.0);
  EXPECT_NEAR(map.largest_move(make_map(axis, 1.1, 1.1)), 0.1, 1e-12);
  Polyline moved = axis;
  for (Vec3& p : moved) p += Vec3(0, 0.2, 0);
  EXPECT_NEAR(map.largest_move(make_map(moved, 1, 1)), 0.2, 1e-9);
}

}  // namespace
}  // namespace vstent::stents
