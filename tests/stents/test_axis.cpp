#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <numbers>
#include <random>

#include "sdf/polyline.hpp"
#include "stents/axis.hpp"

namespace vstent::stents {
namespace {

Polyline arc(double radius, double angle, int pieces) {
  Polyline line;
  for (int i = 0; i <= pieces; ++i) {
    const double a = angle * i / pieces;
    line.emplace_back(radius * (1 - std::cos(a)), 0, radius * std::sin(a));
  }
  return line;
}

Polyline helix(double radius, double pitch, double angle, int pieces) {
  Polyline line;
  for (int i = 0; i <= pieces; ++i) {
    const double a = angle * i / pieces;
    line.emplace_back(radius * std::cos(a), radius * std::sin(a), pitch * a);
  }
  return line;
}

TEST(Straightening, ZeroGivesTheAxisBack) {
  const Polyline axis = helix(10, 3, 2, 60);
  const Polyline same = straightened(axis, 0);
  for (std::size_t i = 0; i < axis.size(); ++i) EXPECT_EQ(axis[i], same[i]);
}

TEST(Straightening, KeepsEverySegmentsLength) {
  const Polyline axis = helix(10, 3, 2, 60);
  for (const double strength : {0.25, 0.5, 1.0}) {
    const Polyline line = straightened(axis, strength);
    for (std::size_t i = 1; i < axis.size(); ++i) {
      EXPECT_NEAR((line[i] - line[i - 1]).norm(), (axis[i] - axis[i - 1]).norm(), 1e-12);
    }
  }
}

TEST(Straightening, OneIsStraight) {
  const Polyline line = straightened(helix(10, 3, 2, 60), 1);
  const Vec3 direction = (line.back() - line.front()).normalized();
  for (const Vec3& p : line) EXPECT_LT((p - line.front()).cross(direction).norm(), 1e-9);
  EXPECT_LT(end_tangent_angle(line), 1e-9);
}

// A plane arc's end tangents differ by the sum of its turns, and every turn keeps its share.
TEST(Straightening, PlaneArcLosesItsAngleInProportion) {
  const Polyline axis = arc(20, 1.2, 80);
  const double native = end_tangent_angle(axis);
  for (const double strength : {0.1, 0.5, 0.9}) {
    EXPECT_NEAR(end_tangent_angle(straightened(axis, strength)), (1 - strength) * native, 1e-10);
  }
}

TEST(Straightening, FollowsRigidMotion) {
  const Polyline axis = helix(10, 3, 2, 40);
  const Eigen::Matrix3d rotation(Eigen::AngleAxisd(0.7, Vec3(1, 2, 3).normalized()));
  const Vec3 shift(100, -50, 20);
  Polyline moved;
  for (const Vec3& p : axis) moved.push_back(rotation * p + shift);
  const Polyline line = straightened(axis, 0.6);
  const Polyline moved_line = straightened(moved, 0.6);
  for (std::size_t i = 0; i < line.size(); ++i) {
    EXPECT_LT((moved_line[i] - (rotation * line[i] + shift)).norm(), 1e-6);
  }
}

// No rigid motion of the straightened line lies closer to the axis.
TEST(Straightening, StaysAsCloseAsItCan) {
  const Polyline axis = arc(20, 1.0, 40);
  const Polyline line = straightened(axis, 1);
  const auto misfit = [&](const Polyline& candidate) {
    double sum = 0;
    for (std::size_t i = 0; i < axis.size(); ++i) sum += (candidate[i] - axis[i]).squaredNorm();
    return sum;
  };
  std::mt19937 random(7);
  std::normal_distribution<double> normal;
  const double best = misfit(line);
  for (int trial = 0; trial < 100; ++trial) {
    const Vec3 about(normal(random), normal(random), normal(random));
    const Eigen::Matrix3d rotation(Eigen::AngleAxisd(0.02 * normal(random), about.normalized()));
    const Vec3 shift = 0.05 * Vec3(normal(random), normal(random), normal(random));
    Polyline candidate;
    for (const Vec3& p : line) candidate.push_back(rotation * (p - line[20]) + line[20] + shift);
    EXPECT_GE(misfit(candidate), best - 1e-9);
  }
}

TEST(Frames, AreOrthonormal) {
  for (const Frame& frame : rotation_minimising_frames(helix(5, 1.5, 6, 50))) {
    EXPECT_NEAR(frame.tangent.norm(), 1, 1e-12);
    EXPECT_NEAR(frame.normal.norm(), 1, 1e-12);
    EXPECT_NEAR(frame.tangent.dot(frame.normal), 0, 1e-12);
  }
}

TEST(Frames, DoNotTurnOutOfAPlaneCurvesPlane) {
  const auto frames = rotation_minimising_frames(arc(10, 2, 40));
  const Vec3 out_of_plane = Vec3::UnitY();
  const double first = frames.front().normal.dot(out_of_plane);
  for (const Frame& frame : frames) EXPECT_NEAR(frame.normal.dot(out_of_plane), first, 1e-12);
}

// On a helix the frame turns against the Frenet frame by torsion times arc length; double
// reflection gets there with an error that falls with the fourth power of the spacing (tangents
// here are chords' means, second order: so at least that).
TEST(Frames, TurnOnAHelixByItsTorsion) {
  const double r = 5, c = 1.5, angle = 6;
  const auto error = [&](int pieces) {
    const auto frames = rotation_minimising_frames(helix(r, c, angle, pieces));
    const auto frenet_normal = [](double a) { return Vec3(-std::cos(a), -std::sin(a), 0); };
    // Ends have one-sided tangents, so compare from the second to the second-last point.
    const double a0 = angle / pieces;
    const double a1 = angle - angle / pieces;
    const auto phase = [&](const Frame& frame, double a) {
      const Vec3 n = frenet_normal(a);
      return std::atan2(frame.normal.dot(frame.tangent.cross(n)), frame.normal.dot(n));
    };
    const double turned =
        phase(frames[static_cast<std::size_t>(pieces) - 1], a1) - phase(frames[1], a0);
    const double torsion = c / (r * r + c * c);
    const double expected = -torsion * (a1 - a0) * std::hypot(r, c);
    return std::abs(std::remainder(turned - expected, 2 * std::numbers::pi));
  };
  EXPECT_LT(error(160), 1e-3);
  EXPECT_LT(error(160), 0.3 * error(80));
}

TEST(Polylines, SmoothingKeepsStraightLines) {
  Polyline line;
  for (int i = 0; i <= 50; ++i) line.emplace_back(0.1 * i, 0.2 * i, 0);
  const Polyline result = smooth(line, 0.7);
  for (std::size_t i = 0; i < line.size(); ++i) EXPECT_LT((result[i] - line[i]).norm(), 1e-12);
}

TEST(Polylines, ResamplingKeepsEndsAndSpacing) {
  const Polyline line = arc(10, 1.5, 31);
  const Polyline result = resample(line, 2, 12, 0.3);
  const auto arcs = arc_lengths(line);
  EXPECT_LT((result.front() - point_at(line, arcs, 2)).norm(), 1e-12);
  EXPECT_LT((result.back() - point_at(line, arcs, 12)).norm(), 1e-12);
  for (std::size_t i = 1; i < result.size(); ++i)
    EXPECT_LE((result[i] - result[i - 1]).norm(), 0.3 + 1e-12);
}

}  // namespace
}  // namespace vstent::stents
