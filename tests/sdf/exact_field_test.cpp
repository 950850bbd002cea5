#include "sdf/exact_field.hpp"

#include <gtest/gtest.h>

#include "tests/sdf/shapes.hpp"

namespace vstent::sdf {
namespace {

void expect_same_bits(const Solid& solid, std::uint64_t seed) {
  const ExactField field(solid);
  Box box = tests::bounds(solid);
  box.pad(3);
  tests::Random random(seed);
  std::vector<Vec3> points;
  for (int n = 0; n < 3000; ++n) points.push_back(random.in_box(box.lower, box.upper));
  for (const Segment& s : solid.segments)
    points.insert(points.end(), {s.a, s.b, 0.5 * (s.a + s.b)});
  for (const Strut& s : solid.struts) points.insert(points.end(), {s.a, s.b, 0.5 * (s.a + s.b)});
  std::vector<Sample> samples(points.size());
  field.sample(points, samples);
  for (std::size_t i = 0; i < points.size(); ++i) {
    const Sample expected = distance_brute_force(solid, points[i]);
    ASSERT_EQ(samples[i].distance, expected.distance) << points[i].transpose();
    ASSERT_EQ(samples[i].gradient, expected.gradient) << points[i].transpose();
  }
}

TEST(ExactField, EqualsBruteForceBitForBit) {
  expect_same_bits(tests::uniform_tube(tests::arc_axis(20, 2, 200), 3), 1);
  expect_same_bits(tests::uniform_tube(tests::arc_axis(20, 2, 200), 3, true), 2);
  expect_same_bits(tests::uniform_tube(tests::straight_axis({0, 0, 0}, {2, 0, 0}, 5), 3), 3);
  expect_same_bits(tests::tapered_tube(tests::arc_axis(20, 2, 60), 3, 1.5), 4);
  expect_same_bits(tests::paper_tube(tests::arc_axis(20, 2, 60), 3), 5);
  expect_same_bits(tests::scattered_struts(1000, 3, 6), 6);
  expect_same_bits(tests::scattered_flat_struts(1000, 3, 10), 7);
  Solid mixed = tests::scattered_struts(300, 2, 11);
  mixed.struts = tests::scattered_flat_struts(300, 2, 12).struts;
  expect_same_bits(mixed, 8);
}

TEST(ExactField, EqualsBruteForceFarFromTheOrigin) {
  Solid solid = tests::scattered_struts(300, 2, 7);
  for (Segment& s : solid.segments) s.a += Vec3(4e5, -3e5, 2e5), s.b += Vec3(4e5, -3e5, 2e5);
  expect_same_bits(solid, 9);
}

TEST(ExactField, RefusesImpossibleSolids) {
  EXPECT_THROW(ExactField(Solid{}), std::invalid_argument);
  Solid solid = tests::scattered_struts(3, 1, 9);
  solid.segments[1].radius_a = -1;
  EXPECT_THROW(ExactField{solid}, std::invalid_argument);
  solid.segments[1].radius_a = 1;
  solid.segments[2].end_cap = 0;
  EXPECT_THROW(ExactField{solid}, std::invalid_argument);
  solid.segments[2].end_cap = -1;
  solid.joints = Joints::flat;
  solid.segments[0].b = solid.segments[0].a;
  EXPECT_THROW(ExactField{solid}, std::invalid_argument);
}

}  // namespace
}  // namespace vstent::sdf
