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

/// Seen from the axis a point lies where the bent tube's own coordinates say: the inverse is the
/// slow search that placement uses.
TEST(SurfaceMap, PointsComeToLieAtTheirAngleHeightAndRadius) {
  std::mt19937 random(3);
  std::uniform_real_distribution<double> share(0, 1);
  for (const Bend& bend : bends()) {
    const AxisWithFrames axis = with_frames(bend.axis, Vec3::UnitX());
    const double start = 2;
    std::vector<double> radii;
    for (const double s : axis.arc)
      radii.push_back(bend.proximal + s / axis.arc.back() * (bend.distal - bend.proximal));
    const SurfaceMap map(axis, start, radii, kStraightRadius);
    const BentTube tube(axis, start);
    for (int i = 0; i < 300; ++i) {
      const double radius = kStraightRadius - 0.4 * share(random), angle = 6.28 * share(random);
      const double z = 9 * share(random);
      const double outer =
          bend.proximal + (start + z) / axis.arc.back() * (bend.distal - bend.proximal);
      const PatternPoint expected{radius - kStraightRadius + outer, angle, z};
      const Vec3 x = map.placed(Vec3(radius * std::cos(angle), radius * std::sin(angle), z));
      EXPECT_LT((x - tube.point(expected)).norm(), 1e-9);
      EXPECT_NEAR(tube.coordinates(x, expected).z, z, 1e-9);
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

}  // namespace
}  // namespace vstent::stents
