#include <gtest/gtest.h>

#include <cmath>

#include "apps/diameters.hpp"
#include "vessels/error.hpp"

namespace vstent::apps {
namespace {

TEST(Diameters, AreReadAsRangeOrList) {
  EXPECT_EQ(parse_diameters("6mm:12mm:7"), (std::vector<double>{6, 7, 8, 9, 10, 11, 12}));
  EXPECT_EQ(parse_diameters("0.8cm,9mm"), (std::vector<double>{8, 9}));
  for (const char* wrong : {"6:12:7", "6mm:12mm", "6mm:12mm:1", "12mm:6mm:3", "6mm:12mm:x",
                            "8mm,8mm", "9mm,8mm", "-1mm,8mm", "", "6mm:6.01mm:9"})
    EXPECT_THROW(parse_diameters(wrong), Error) << wrong;
}

TEST(Diameters, TheFirstPairAroundTheTargetIsTaken) {
  const std::vector<Trial> trials{{6, 40}, {8, 12}, {10, 5}, {12, 1}};
  const auto found = bracket(trials, 10);
  ASSERT_TRUE(found);
  EXPECT_EQ(found->above.diameter, 8);
  EXPECT_EQ(found->below.diameter, 10);
  EXPECT_FALSE(bracket(trials, 0.5));  // none reaches it
  EXPECT_FALSE(bracket(trials, 50));   // the first does
}

TEST(Diameters, TheSearchEndsAtTheTarget) {
  // A drop that goes with the inverse fourth power is met at once; others within a few trials.
  for (const double power : {1.0, 4.0, 9.0}) {
    const auto drop = [&](double d) { return 100 * std::pow(6 / d, power); };
    Bracket b{{6, drop(6)}, {14, drop(14)}};
    const double target = std::sqrt(b.above.drop * b.below.drop) * 1.1;
    int count = 0;
    for (; count < 20; ++count) {
      const auto next = next_diameter(b, target);
      if (!next) break;
      ASSERT_GT(*next, b.above.diameter);
      ASSERT_LT(*next, b.below.diameter);
      (drop(*next) > target ? b.above : b.below) = {*next, drop(*next)};
    }
    EXPECT_LE(count, 8) << power;
    EXPECT_LT(b.below.diameter - b.above.diameter, 0.1) << power;
    EXPECT_GT(b.above.drop, target);
    EXPECT_LE(b.below.drop, target);
  }
}

}  // namespace
}  // namespace vstent::apps
