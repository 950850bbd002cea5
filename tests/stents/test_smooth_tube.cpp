#include <gtest/gtest.h>

#include "stents/smooth_tube.hpp"

namespace vstent::stents {
namespace {

TEST(SmoothTube, IsConstantUnlessToldOtherwise) {
  const SmoothTube tube{30, 11, 0, 0, 0};
  for (const double s : {0.0, 7.0, 30.0}) EXPECT_DOUBLE_EQ(outer_radius(tube, s), 5.5);
}

TEST(SmoothTube, TapersLinearly) {
  const SmoothTube tube{40, 10, 7, 0, 0};
  EXPECT_DOUBLE_EQ(outer_radius(tube, 0), 5);
  EXPECT_DOUBLE_EQ(outer_radius(tube, 20), 4.25);
  EXPECT_DOUBLE_EQ(outer_radius(tube, 40), 3.5);
}

TEST(SmoothTube, FlaresAtBothEndsOnly) {
  const SmoothTube tube{30, 10, 0, 13, 4};
  EXPECT_DOUBLE_EQ(outer_radius(tube, 0), 6.5);
  EXPECT_DOUBLE_EQ(outer_radius(tube, 30), 6.5);
  EXPECT_DOUBLE_EQ(outer_radius(tube, 2), 5.75);  // half a cosine: half way at half length
  EXPECT_DOUBLE_EQ(outer_radius(tube, 4), 5);
  EXPECT_DOUBLE_EQ(outer_radius(tube, 15), 5);
}

TEST(SmoothTube, ExpandsFromTheStartRadiusToNominal) {
  const SmoothTube tube{40, 10, 7, 0, 0};
  const std::vector<double> arc{0, 20, 40};
  EXPECT_EQ(expanded_radii(tube, arc, 1.5, 0), std::vector<double>(3, 1.5));
  EXPECT_EQ(expanded_radii(tube, arc, 1.5, 1), (std::vector<double>{5, 4.25, 3.5}));
  EXPECT_DOUBLE_EQ(expanded_radii(tube, arc, 1.5, 0.5)[1], 0.5 * (1.5 + 4.25));
}

}  // namespace
}  // namespace vstent::stents
