// What a union of flat-capped cylinders does at its joints, and what round joints do instead (V1b).
#include <gtest/gtest.h>

#include "sdf/level_set.hpp"
#include "tests/sdf/shapes.hpp"

namespace vstent::sdf {
namespace {

constexpr double kRadius = 5;
constexpr double kContact = 0.25;

/// One joint at the origin that turns by delta; the outer bisector is +y.
Polyline joint(double delta) {
  const double c = 20 * std::cos(delta / 2), s = 20 * std::sin(delta / 2);
  return {{-c, -s, 0}, {0, 0, 0}, {c, -s, 0}};
}

/// The first place, coming from inside, where the distance along the outer bisector reaches d_c for
/// good: bisection between the notch's bottom and a place that is surely outside.
double contact_radius(const Solid& solid, double from) {
  double inside = from, outside = 3 * kRadius;
  for (int i = 0; i < 100; ++i) {
    const double middle = 0.5 * (inside + outside);
    (distance_brute_force(solid, {0, middle, 0}).distance < kContact ? inside : outside) = middle;
  }
  return outside;
}

class JointOf : public testing::TestWithParam<double> {};
INSTANTIATE_TEST_SUITE_P(Degrees, JointOf, testing::Values(1.0, 2.0, 5.0, 10.0, 20.0, 40.0));

TEST_P(JointOf, FlatCapsLeavesTheDimpleOfTheClosedForm) {
  const double delta = GetParam() * std::numbers::pi / 180;
  const double notch = kRadius * std::sin(delta / 2);
  const double expected = notch <= kContact ? kRadius * std::cos(delta / 2) +
                                                  std::sqrt(kContact * kContact - notch * notch)
                                            : kContact / std::sin(delta / 2);
  EXPECT_NEAR(contact_radius(tests::paper_tube(joint(delta), kRadius),
                             notch <= kContact ? 0.9 * kRadius : 1e-3),
              expected, 1e-9);
}

TEST_P(JointOf, RoundJointsLeaveNone) {
  const double delta = GetParam() * std::numbers::pi / 180;
  EXPECT_NEAR(contact_radius(tests::uniform_tube(joint(delta), kRadius), 0.9 * kRadius),
              kRadius + kContact, 1e-9);
}

TEST(PaperJoints, HaveFalseZerosInside) {
  const Solid paper = tests::paper_tube(tests::straight_axis({0, 0, 0}, {20, 0, 0}, 4), kRadius);
  for (const double x : {5.0, 10.0, 15.0})
    EXPECT_EQ(distance_brute_force(paper, {x, 1, 2}).distance, 0);
  const LevelSet level_set = voxelise(paper, {.voxel_size = 0.25});
  EXPECT_NEAR(level_set.node_value({20, 4, 4}), 0,
              1e-6);  // (5, 1, 1) mm, on the first joint's disc
}

TEST(RoundJoints, ContactSurfaceOfTheLevelSetIsTheTubeToTheSamplingError) {
  const double h = 0.1, delta = 0.3;
  const LevelSet level_set =
      voxelise(tests::uniform_tube(joint(delta), kRadius), {.voxel_size = h, .half_width = 6});
  for (const double z : {-0.7, 0.0, 0.3}) {
    const Vec3 x(0, std::sqrt(std::pow(kRadius + kContact, 2) - z * z), z);
    EXPECT_NEAR(level_set.sample(x).distance, kContact, 2.1 * h * h / (8 * kRadius));
  }
}

}  // namespace
}  // namespace vstent::sdf
