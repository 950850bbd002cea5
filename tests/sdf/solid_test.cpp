#include "sdf/solid.hpp"

#include <gtest/gtest.h>

#include "tests/sdf/shapes.hpp"

namespace vstent::sdf {
namespace {

using tests::Random;

constexpr int kPoints = 100000;

TEST(Capsule, IsTheDistanceToTheClosestPointOfItsAxis) {
  // V1a; the axis is z, so the closest point needs no projection. 1e-12 R.
  const double radius = 5;
  const Vec3 a(0, 0, -8), b(0, 0, 8);
  Random random(1);
  for (int n = 0; n < kPoints; ++n) {
    const Vec3 x = random.in_cube(15);
    const Vec3 closest(0, 0, std::clamp(x.z(), -8.0, 8.0));
    const Sample sample = capsule(x, a, b, radius);
    ASSERT_NEAR(sample.distance, (x - closest).norm() - radius, 1e-12 * radius);
    ASSERT_LT((sample.gradient - (x - closest).normalized()).norm(), 1e-12);
  }
}

TEST(Capsule, OnItsAxisIsMinusItsRadiusWithoutGradient) {
  const Sample sample = capsule({0, 0, 1}, {0, 0, -8}, {0, 0, 8}, 5);
  EXPECT_EQ(sample.distance, -5);
  EXPECT_EQ(sample.gradient, Vec3(Vec3::Zero()));
}

TEST(CappedCylinder, IsEquation18) {
  const double radius = 5;
  const double half_length = 8;
  Random random(2);
  for (int n = 0; n < kPoints; ++n) {
    const Vec3 x = random.in_cube(15);
    const double dr = std::hypot(x.x(), x.y()) - radius;
    const double dz = std::abs(x.z()) - half_length;
    const double expected =
        std::min(std::max(dr, dz), 0.0) + std::hypot(std::max(dr, 0.0), std::max(dz, 0.0));
    const Sample sample = capped_cylinder(x, {0, 0, -half_length}, {0, 0, half_length}, radius);
    ASSERT_NEAR(sample.distance, expected, 1e-12 * radius);
    ASSERT_NEAR(sample.gradient.norm(), 1, 1e-12);
  }
}

TEST(RoundCone, IsTheLeastDistanceToTheBallsThatItIsTheHullOf) {
  // d(x) = min over s of |x - c(s)| - r(s). With n samples of s the minimum is missed by at most
  // the second derivative, 1/|x - c|, times (L / 2n)^2 / 2, and never undershot.
  constexpr int kSamples = 20000;
  Random random(3);
  for (int n = 0; n < 300; ++n) {
    const Vec3 a = random.in_cube(3), b = random.in_cube(3);
    const double radius_a = random(0.1, 2), radius_b = random(0.1, 2);
    const Vec3 x = random.in_cube(6);
    double least = std::numeric_limits<double>::infinity();
    double arm = 1;
    for (int i = 0; i <= kSamples; ++i) {
      const double t = static_cast<double>(i) / kSamples;
      const double from_centre = (x - (a + t * (b - a))).norm();
      const double d = from_centre - (radius_a + t * (radius_b - radius_a));
      if (d < least) least = d, arm = from_centre;
    }
    const double step = (b - a).norm() / kSamples;
    const double d = round_cone(x, a, b, radius_a, radius_b).distance;
    EXPECT_LE(d, least + 1e-12);
    EXPECT_GE(d, least - std::min(step, step * step / (4 * arm)) - 1e-12);
  }
}

TEST(RoundCone, ClosedFormOfACone) {
  // Lateral distance of the cone tangent to both balls: with sin(alpha) = (r1 - r2) / L and x on
  // the cone's side at axial t, d = rho cos(alpha) + t sin(alpha) - r1.
  const double length = 10, r1 = 4, r2 = 1;
  const double sine = (r1 - r2) / length;
  const double cosine = std::sqrt(1 - sine * sine);
  Random random(4);
  for (int n = 0; n < kPoints; ++n) {
    const double t = random(3, 7), rho = random(0.1, 6), angle = random(0, 6);
    if (t - rho * sine / cosine < 0) continue;
    const Vec3 x(rho * std::cos(angle), rho * std::sin(angle), t);
    ASSERT_NEAR(round_cone(x, {0, 0, 0}, {0, 0, length}, r1, r2).distance,
                rho * cosine + t * sine - r1, 1e-12 * r1);
  }
}

TEST(RoundCone, WithOneBallInsideTheOtherIsTheLargerBall) {
  Random random(5);
  for (int n = 0; n < 1000; ++n) {
    const Vec3 x = random.in_cube(5);
    EXPECT_NEAR(round_cone(x, {0, 0, 0}, {1, 0, 0}, 3, 1).distance, x.norm() - 3, 1e-12);
    EXPECT_NEAR(round_cone(x, {1, 0, 0}, {0, 0, 0}, 1, 3).distance, x.norm() - 3, 1e-12);
    EXPECT_NEAR(round_cone(x, {0, 0, 0}, {0, 0, 0}, 3, 1).distance, x.norm() - 3, 1e-12);
  }
}

TEST(RoundCone, GradientIsTheSlope) {
  // Central differences of step e miss by e^2/6 times the third derivative, about 2 / arm^2; plus
  // rounding 1e-15 / e.
  Random random(6);
  constexpr double e = 1e-5;
  for (int n = 0; n < 2000; ++n) {
    const Vec3 a = random.in_cube(3), b = random.in_cube(3);
    const double radius_a = random(0.5, 2), radius_b = random(0.5, 2);
    const Vec3 x = random.in_cube(6);
    const auto d = [&](const Vec3& at) {
      return round_cone(at, a, b, radius_a, radius_b).distance;
    };
    if (d(x) < -0.4) continue;
    for (int axis = 0; axis < 3; ++axis) {
      const Vec3 step = e * Vec3::Unit(axis);
      EXPECT_NEAR((d(x + step) - d(x - step)) / (2 * e),
                  round_cone(x, a, b, radius_a, radius_b).gradient[axis], 1e-6);
    }
  }
}

/// Straight tube along z with flat ends: exactly eq. 18's cylinder, however it is divided.
class FlatTube : public testing::TestWithParam<std::pair<double, int>> {};
INSTANTIATE_TEST_SUITE_P(LengthAndSegments, FlatTube,
                         testing::Values(std::pair(30.0, 1), std::pair(30.0, 40), std::pair(4.0, 1),
                                         std::pair(4.0, 9), std::pair(0.5, 1), std::pair(0.5, 3),
                                         std::pair(9.9, 50)));

TEST_P(FlatTube, IsACappedCylinder) {
  const auto [length, segments] = GetParam();
  const double radius = 5;
  const Vec3 a(0, 0, -length / 2), b(0, 0, length / 2);
  const Solid tube = tests::uniform_tube(tests::straight_axis(a, b, segments), radius);
  Random random(7);
  for (int n = 0; n < 5000; ++n) {
    const Vec3 x = random.in_box({-8, -8, -length / 2 - 4}, {8, 8, length / 2 + 4});
    const Sample expected = capped_cylinder(x, a, b, radius);
    const Sample sample = distance_brute_force(tube, x);
    ASSERT_NEAR(sample.distance, expected.distance, 1e-12 * radius);
    if (std::abs(expected.distance) < 0.1) {
      ASSERT_LT((sample.gradient - expected.gradient).norm(), 1e-10);
    }
  }
  for (const double angle : {0.0, 1.0, 2.5}) {
    const Vec3 rim(radius * std::cos(angle), radius * std::sin(angle), length / 2);
    EXPECT_NEAR(distance_brute_force(tube, rim).distance, 0, 1e-12 * radius);
  }
}

TEST(FlatTube, TaperedIsTheConeCutByTheEndPlanes) {
  // On the cut cone's side d = rho cos(alpha) + t sin(alpha) - r1 while the foot is between the
  // planes; inside, the larger of that and the plane's; beyond a plane, the distance to the disc
  // whose rim is on the cone.
  const double length = 10, r1 = 3, r2 = 2;
  const double sine = (r1 - r2) / length, cosine = std::sqrt(1 - sine * sine);
  const Solid tube =
      tests::tapered_tube(tests::straight_axis(Vec3::Zero(), {0, 0, length}, 25), r1, r2);
  const double narrow_rim = r2 / cosine;
  Random random(8);
  for (int n = 0; n < 20000; ++n) {
    const Vec3 x = random.in_box({-5, -5, 4}, {5, 5, 13});
    const double rho = std::hypot(x.x(), x.y());
    const double side = rho * cosine + x.z() * sine - r1;
    const double z = x.z() - length;
    const double foot = x.z() - side * sine;
    const double expected = side <= 0 && z <= 0 ? std::max(side, z)
                            : side > 0 && foot <= length
                                ? side
                                : std::hypot(std::max(rho - narrow_rim, 0.0), z);
    ASSERT_NEAR(distance_brute_force(tube, x).distance, expected, 1e-11) << x.transpose();
  }
}

TEST(Tube, OfATorusArcFollowsTheTorus) {
  // V1a torus arc: |(hypot(x, y) - Rb, z)| - R; a chord of length s leaves the arc by s^2 / (8 Rb).
  const double bend = 20, radius = 3, angle = 1.2;
  const int segments = 600;
  const double sagitta = std::pow(bend * angle / segments, 2) / (8 * bend);
  const Solid tube = tests::uniform_tube(tests::arc_axis(bend, angle, segments), radius);
  Random random(9);
  for (int n = 0; n < 3000; ++n) {
    const double t = random(0.2, 1.0), rho = random(0, 5), turn = random(0, 6.28);
    const double along = bend + rho * std::cos(turn);
    const Vec3 x(along * std::cos(t), along * std::sin(t), rho * std::sin(turn));
    ASSERT_NEAR(distance_brute_force(tube, x).distance, rho - radius, sagitta * 1.001 + 1e-12);
  }
  for (const double end :
       {0.0, angle}) {  // the discs: beyond the end, within the rim, the distance is the axial one
    for (int n = 0; n < 300; ++n) {
      const double rho = random(0, 2.9), turn = random(0, 6.28), z = random(0.01, 2);
      const Vec3 out(0, end == 0 ? -1 : 1, 0);
      const Vec3 local(bend + rho * std::cos(turn), 0, rho * std::sin(turn));
      const Vec3 x = Eigen::AngleAxisd(end, Vec3::UnitZ()) * Vec3(local + z * out);
      // The last chord is tilted by half a segment's angle.
      ASSERT_NEAR(distance_brute_force(tube, x).distance, z,
                  0.5 * angle / segments * (rho + z) + 1e-12);
    }
  }
}

TEST(Tube, OuterSideOfAJointIsRound) {
  // V1b: at any distance d_c from the surface, the contact radius over a joint is R + d_c.
  for (const double turn : {0.03, 0.17, 0.5, 1.0}) {
    const double radius = 5;
    const Polyline axis{{-20 * std::cos(turn / 2), -20 * std::sin(turn / 2), 0},
                        {0, 0, 0},
                        {20 * std::cos(turn / 2), -20 * std::sin(turn / 2), 0}};
    const Solid tube = tests::uniform_tube(axis, radius);
    for (const double d_c : {0.0, 0.25, 1.0}) {
      EXPECT_NEAR(distance_brute_force(tube, {0, radius + d_c, 0}).distance, d_c, 1e-6 * 1e-6);
    }
  }
}

std::vector<Solid> one_of_each_kind() {
  return {tests::uniform_tube(tests::straight_axis({-4, 0, 0}, {4, 1, 2}, 7), 1.5),
          tests::uniform_tube(tests::arc_axis(6, 2.0, 30), 1.5),
          tests::uniform_tube(tests::arc_axis(6, 2.0, 30), 1.5, true),
          tests::uniform_tube(tests::arc_axis(6, 0.2, 4), 1.5),
          tests::tapered_tube(tests::arc_axis(6, 2.0, 30), 2, 1),
          tests::paper_tube(tests::arc_axis(6, 2.0, 12), 1.5),
          tests::scattered_struts(60, 2, 11)};
}

TEST(Distance, GrowsNoFasterThanOneMovesOutside) {
  // V1c. The polyline's kinks leave the caps of bent tubes discontinuous far inside only: between
  // points outside, or near the surface, the bound holds to rounding.
  Random random(12);
  for (const Solid& solid : one_of_each_kind()) {
    Box box = tests::bounds(solid);
    box.pad(1);
    for (int n = 0; n < 20000; ++n) {
      const Vec3 p = random.in_box(box.lower, box.upper);
      const Vec3 q = p + random(0, 0.5) * random.direction();
      const double dp = distance_brute_force(solid, p).distance,
                   dq = distance_brute_force(solid, q).distance;
      ASSERT_LE(std::abs(dp - dq), (p - q).norm() * (1 + 1e-9) + 1e-12)
          << p.transpose() << " / " << q.transpose();
    }
  }
}

TEST(Distance, FallsAsTheRadiusGrows) {
  Random random(13);
  for (int n = 0; n < 500; ++n) {
    const Vec3 x = random.in_cube(10);
    double before = std::numeric_limits<double>::infinity();
    for (const double radius : {0.5, 1.0, 1.5, 2.0, 3.0}) {
      const double d =
          distance_brute_force(tests::uniform_tube(tests::arc_axis(6, 2.0, 20), radius, true), x)
              .distance;
      EXPECT_LE(d, before);
      before = d;
    }
    const double flat_small =
        distance_brute_force(tests::uniform_tube(tests::arc_axis(6, 2.0, 20), 1.0), x).distance;
    const double flat_large =
        distance_brute_force(tests::uniform_tube(tests::arc_axis(6, 2.0, 20), 1.3), x).distance;
    EXPECT_LE(flat_large, flat_small + 1e-12);
  }
}

TEST(Distance, OfARoundTubeIsTheDistanceToItsAxisMinusTheRadius) {
  Random random(14);
  const Polyline axis = tests::arc_axis(6, 2.0, 20);
  const Solid thin = tests::uniform_tube(axis, 1, true),
              thick = tests::uniform_tube(axis, 2.5, true);
  for (int n = 0; n < 2000; ++n) {
    const Vec3 x = random.in_cube(10);
    EXPECT_NEAR(distance_brute_force(thick, x).distance,
                distance_brute_force(thin, x).distance - 1.5, 1e-12);
  }
}

TEST(Distance, MovesWithTheSolid) {
  // V1c: rotation and translation to 1e-12, relative to the coordinates.
  Random random(15);
  const auto turn = random.rotation();
  const Vec3 shift = random.in_cube(10);
  for (const Solid& solid : one_of_each_kind()) {
    Solid moved = solid;
    for (Segment& s : moved.segments) s.a = turn * s.a + shift, s.b = turn * s.b + shift;
    for (EndCap& cap : moved.caps)
      cap.centre = turn * cap.centre + shift, cap.outward = turn * cap.outward;
    for (int n = 0; n < 2000; ++n) {
      const Vec3 x = random.in_cube(8);
      EXPECT_NEAR(distance_brute_force(moved, turn * x + shift).distance,
                  distance_brute_force(solid, x).distance, 1e-12 * 20);
    }
  }
}

TEST(MakeTube, RefusesImpossibleAxes) {
  const Polyline axis{{0, 0, 0}, {1, 0, 0}};
  EXPECT_THROW(make_tube({{0, 0, 0}}, {1}), std::invalid_argument);
  EXPECT_THROW(make_tube(axis, {1}), std::invalid_argument);
  EXPECT_THROW(make_tube(axis, {1, 0}), std::invalid_argument);
  EXPECT_THROW(make_tube(axis, {1, std::nan("")}), std::invalid_argument);
  EXPECT_THROW(make_tube({{0, 0, 0}, {0, 0, 0}}, {1, 1}), std::invalid_argument);
  EXPECT_THROW(make_tube({{0, 0, 0}, {std::nan(""), 0, 0}}, {1, 1}), std::invalid_argument);
}

}  // namespace
}  // namespace vstent::sdf
