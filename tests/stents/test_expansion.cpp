// Dog-boning, recoil and the history of an expansion.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "stents/catalogue.hpp"
#include "stents/expansion.hpp"

namespace vstent::stents {
namespace {

const Inflation kInflation{1.0, 3.0, 0.3, 3};

TEST(DogBone, StartsCrimpedAndEndsInflatedEverywhere) {
  for (const double share : {0.0, 0.2, 0.5, 0.9, 1.0}) {
    EXPECT_DOUBLE_EQ(dog_bone(kInflation, 0)(share), 0.5) << share;
    EXPECT_DOUBLE_EQ(dog_bone(kInflation, 1)(share), 1.5) << share;
  }
}

TEST(DogBone, EndsLeadAndNothingShrinks) {
  double before_end = 0, before_middle = 0;
  for (int i = 0; i <= 100; ++i) {
    const RadiusProfile profile = dog_bone(kInflation, i / 100.0);
    EXPECT_GE(profile(0), profile(0.2));
    EXPECT_GE(profile(0.2), profile(0.5));
    EXPECT_DOUBLE_EQ(profile(0.2), profile(0.8));
    EXPECT_GE(profile(0), before_end);
    EXPECT_GE(profile(0.5), before_middle);
    before_end = profile(0), before_middle = profile(0.5);
    EXPECT_GE(dog_boning(profile), 0);
  }
}

TEST(DogBone, HasItsClosedFormInTheMiddleOfTheTime) {
  // ends at x = 0.5 / 0.7, the middle at (0.5 - 0.3) / 0.7, opened 3 x^2 - 2 x^3
  const auto opened = [](double x) { return 3 * x * x - 2 * x * x * x; };
  const double end = 1 + 2 * opened(0.5 / 0.7), middle = 1 + 2 * opened(0.2 / 0.7);
  EXPECT_NEAR(dog_boning(dog_bone(kInflation, 0.5)), (end - middle) / end, 1e-15);
}

TEST(DogBone, WithoutDelayItIsUniform) {
  const Inflation uniform{1.0, 3.0, 0.0, 3};
  for (const double moment : {0.1, 0.5, 0.8}) {
    EXPECT_EQ(dog_boning(dog_bone(uniform, moment)), 0) << moment;
  }
  EXPECT_THROW(dog_bone({1.0, 3.0, 1.0, 3}, 0.5), std::invalid_argument);
}

TEST(ExpansionHistory, RecoilsByItsShareAndShortensAsTheDesignDoes) {
  const auto design = make_design(*find_preset("palmaz_l"));
  const Inflation inflation{3.4, 12.0, 0.3, 3};
  const auto history = expansion_history(*design, inflation, 10, 0.07);
  ASSERT_EQ(history.size(), 12u);
  EXPECT_EQ(history.front().foreshortening, 0);
  for (std::size_t i = 1; i < 11; ++i) EXPECT_LE(history[i].length, history[i - 1].length) << i;
  EXPECT_NEAR(history[10].length, design->expanded(12.0).length, 1e-12);
  EXPECT_NEAR(history[10].foreshortening, foreshortening(*design, 3.4, 12.0), 1e-12);
  EXPECT_NEAR(history[11].end_diameter, 0.93 * 12, 1e-12);
  EXPECT_NEAR(history[11].length, design->expanded(0.93 * 12).length, 1e-12);
  EXPECT_GT(
      std::max_element(history.begin(), history.end(),
                       [](const auto& a, const auto& b) { return a.dog_boning < b.dog_boning; })
          ->dog_boning,
      0.1);
}

TEST(ExpansionHistory, EveryPresetOpensEndsFirst) {
  for (const Specification& s : catalogue()) {
    const auto design = make_design(s);
    const Limits limits = design->limits();
    const auto history =
        expansion_history(*design, {limits.crimped_diameter, limits.nominal_diameter}, 4, s.recoil);
    EXPECT_NEAR(history[4].length, design->expanded(limits.nominal_diameter).length, 1e-9)
        << s.name;
  }
}

}  // namespace
}  // namespace vstent::stents
