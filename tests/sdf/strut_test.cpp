// Laser-cut struts: the closed form against its definition, slopes and formulas of Steiner.
#include <gtest/gtest.h>

#include <numbers>

#include "sdf/exact_field.hpp"
#include "sdf/level_set.hpp"
#include "tests/sdf/shapes.hpp"

namespace vstent::sdf {
namespace {

using tests::Random;

/// Width 0.12, thickness 0.08 mm about the x axis, flat side up.
Strut straight_strut(double edge_radius) {
  return {.a = {-0.3, 0, 0},
          .b = {0.3, 0, 0},
          .normal = Vec3::UnitZ(),
          .width = 0.12,
          .thickness = 0.08,
          .edge_radius = edge_radius};
}

class StrutOf : public testing::TestWithParam<double> {};
INSTANTIATE_TEST_SUITE_P(EdgeRadius, StrutOf, testing::Values(0.0, 0.01, 0.04));

/// The closest point of a sharp-edged core to x, coordinate by coordinate.
Vec3 closest_in_core(const Vec3& x, double half_length, double half_width, double half_thickness) {
  const Vec3 on_axis(std::clamp(x.x(), -half_length, half_length), 0, 0);
  const Vec3 aside(x.x() - on_axis.x(), x.y(), 0);
  const double scale = std::min(1.0, half_width / std::max(aside.norm(), 1e-300));
  return on_axis + scale * aside + Vec3(0, 0, std::clamp(x.z(), -half_thickness, half_thickness));
}

TEST_P(StrutOf, OutsideIsTheDistanceToItsCoreLessTheEdgeRadius) {
  const Strut strut = straight_strut(GetParam());
  const double rc = strut.edge_radius;
  Random random(51);
  for (int n = 0; n < 20000; ++n) {
    const Vec3 x = random.in_box({-0.6, -0.3, -0.3}, {0.6, 0.3, 0.3});
    const Vec3 core = closest_in_core(x, 0.3, 0.06 - rc, 0.04 - rc);
    const Sample sample = flat_strut(x, strut);
    if ((x - core).norm() < 1e-9) continue;
    ASSERT_NEAR(sample.distance, (x - core).norm() - rc, 1e-14);
    ASSERT_LT((sample.gradient - (x - core).normalized()).norm(), 1e-6);
  }
}

TEST_P(StrutOf, InsideIsTheDepthOfTheLargestBallAroundThePoint) {
  // The nearest of the two flat faces, the flat or round sides and the round edges: the foot on the
  // surface along the gradient is a point of the surface, and no point of the surface is nearer.
  const Strut strut = straight_strut(GetParam());
  Random random(52);
  std::vector<Vec3> surface;
  for (int n = 0; n < 4000; ++n) {
    Vec3 x = random.in_box({-0.6, -0.3, -0.3}, {0.6, 0.3, 0.3});
    const Sample sample = flat_strut(x, strut);
    surface.push_back(x - sample.distance * sample.gradient);
    ASSERT_NEAR(flat_strut(surface.back(), strut).distance, 0, 1e-14);
  }
  for (int n = 0; n < 500; ++n) {
    const Vec3 x = random.in_box({-0.36, -0.06, -0.04}, {0.36, 0.06, 0.04});
    const double depth = -flat_strut(x, strut).distance;
    if (depth <= 0) continue;
    for (const Vec3& p : surface) ASSERT_GE((p - x).norm(), depth - 1e-14);
  }
}

TEST_P(StrutOf, GradientIsTheSlopeAndTheDistanceGrowsNoFasterThanOneMoves) {
  // Central differences of step e err by e^2/6 times the third derivative, below 2 / arm^2 at least
  // arm = 0.01 mm from edges and the axis: 4e-9 / 1e-4; rounding adds 1e-16 / e.
  constexpr double e = 1e-6;
  Random random(53);
  for (int n = 0; n < 3000; ++n) {
    Strut strut = straight_strut(GetParam());
    const auto turn = random.rotation();
    const Vec3 shift = random.in_cube(1);
    strut.a = turn * strut.a + shift, strut.b = turn * strut.b + shift;
    strut.normal = turn * strut.normal;
    const auto d = [&](const Vec3& at) { return flat_strut(at, strut).distance; };
    const Vec3 x = shift + random.in_cube(0.5), y = x + random(0, 0.3) * random.direction();
    ASSERT_LE(std::abs(d(x) - d(y)), (x - y).norm() + 1e-14);
    const Vec3 gradient = flat_strut(x, strut).gradient;
    ASSERT_NEAR(gradient.norm(), 1, 1e-12);
    if (d(x) < 0.02) continue;
    for (int axis = 0; axis < 3; ++axis) {
      const Vec3 step = e * Vec3::Unit(axis);
      ASSERT_NEAR((d(x + step) - d(x - step)) / (2 * e), gradient[axis], 1e-7);
    }
  }
}

TEST(Strut, OfFullyRoundEdgesAndSquareSectionIsACapsule) {
  Strut strut = straight_strut(0.04);
  strut.width = strut.thickness = 0.08;
  Random random(54);
  for (int n = 0; n < 5000; ++n) {
    const Vec3 x = random.in_cube(0.6);
    ASSERT_NEAR(flat_strut(x, strut).distance, capsule(x, strut.a, strut.b, 0.04).distance, 1e-15);
  }
}

TEST(Strut, OfNoLengthIsARoundPlate) {
  Strut strut = straight_strut(0);
  strut.a = strut.b = {0.1, 0.2, 0.3};
  Random random(55);
  for (int n = 0; n < 5000; ++n) {
    const Vec3 x = strut.a + random.in_cube(0.3);
    ASSERT_NEAR(
        flat_strut(x, strut).distance,
        capped_cylinder(x, strut.a - Vec3(0, 0, 0.04), strut.a + Vec3(0, 0, 0.04), 0.06).distance,
        1e-14);
  }
}

TEST(Strut, ImpossibleOnesAreRefused) {
  const auto refused = [](auto&& change) {
    Strut strut = straight_strut(0.01);
    change(strut);
    EXPECT_THROW(ExactField(tests::solid_of(strut)), std::invalid_argument);
    EXPECT_THROW(voxelise(tests::solid_of(strut), {.voxel_size = 0.02}), std::invalid_argument);
  };
  refused([](Strut& s) { s.width = 0; });
  refused([](Strut& s) { s.thickness = -1; });
  refused([](Strut& s) { s.thickness = std::nan(""); });
  refused([](Strut& s) { s.edge_radius = 0.041; });
  refused([](Strut& s) { s.edge_radius = -0.001; });
  refused([](Strut& s) { s.normal *= 1.01; });
  refused([](Strut& s) { s.normal = {0.6, 0, 0.8}; });
  refused([](Strut& s) { s.b.y() = std::numeric_limits<double>::infinity(); });
  EXPECT_NO_THROW(ExactField(tests::solid_of(straight_strut(0.04))));
}

}  // namespace
}  // namespace vstent::sdf
