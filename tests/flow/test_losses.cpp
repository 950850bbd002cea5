// The reduced model's losses against closed forms.
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "flow/losses.hpp"

namespace vstent::flow {
namespace {

constexpr double kPi = std::numbers::pi;
const Blood kBlood;

double area(double diameter) { return 0.25 * kPi * diameter * diameter; }

/// A tube of `length` cm, `diameter(s)` wide, at `points` even places.
template <class Diameter>
Lumen tube(double length, int points, Diameter&& diameter) {
  Lumen lumen;
  for (int i = 0; i < points; ++i) {
    const double s = length * i / (points - 1);
    lumen.arc.push_back(s);
    lumen.area.push_back(area(diameter(s)));
  }
  return lumen;
}

/// A plug of `throat` from `from` to `to`, with walls of one sample's width.
Lumen plug(double diameter, double throat, double length, double from, double to, int points) {
  return tube(length, points,
              [&](double s) { return s >= from - 1e-9 && s <= to + 1e-9 ? throat : diameter; });
}

TEST(Losses, AStraightTubeIsPoiseuilles) {
  // 128 mu L / (pi D^4); a sum of equal terms, so only rounding is allowed.
  const Losses losses = losses_along(tube(7, 15, [](double) { return 0.3; }), kBlood);
  const double exact = 128 * 0.04 * 7 / (kPi * std::pow(0.3, 4));
  EXPECT_NEAR(losses.viscous.back(), exact, 1e-12 * exact);
  EXPECT_NEAR(losses.inertance.back(), 1.06 * 7 / area(0.3), 1e-9);
  EXPECT_EQ(losses.separation.back(), 0);
  EXPECT_TRUE(losses.stenoses.empty());
}

TEST(Losses, ATaperIsItsIntegral) {
  // Integral of 128 mu ds / (pi D^4) with D linear from a to b over L:
  // 128 mu L (a^2 + ab + b^2) / (3 pi a^3 b^3). Exact for any number of sections.
  const double a = 1.2, b = 0.5, length = 9;
  const double exact =
      128 * 0.04 * length * (a * a + a * b + b * b) / (3 * kPi * std::pow(a * b, 3));
  for (const int points : {2, 5, 50}) {
    const Losses losses = losses_along(
        tube(length, points, [&](double s) { return a + (b - a) * s / length; }), kBlood);
    EXPECT_NEAR(losses.viscous.back(), exact, 1e-11 * exact) << points;
    EXPECT_NEAR(losses.inertance.back(), 1.06 * 4 * length / (kPi * a * b), 1e-9) << points;
    EXPECT_EQ(losses.separation.back(), 0) << points;  // blood that speeds up does not separate
  }
}

TEST(Losses, YoungAndTsaisCheckValue) {
  // Worked by hand: u = 21.221 cm/s, K_v = 1836.37, so 5196 dyn/cm2 of viscous loss; and
  // 1.52 / 2 * 1.06 * 9 * u^2 = 3265 dyn/cm2. Together 6.35 mmHg, of which 3.90 viscous.
  const YoungTsai drop = young_tsai(0.3, 0.15, 1.0, 1.5, kBlood);
  EXPECT_NEAR(drop.viscous / kDynPerCm2PerMmHg, 3.90, 0.005);
  EXPECT_NEAR((drop.viscous + drop.separation) / kDynPerCm2PerMmHg, 6.346, 0.005);
}

TEST(Losses, APlugLosesWhatYoungAndTsaiSay) {
  // The separation is theirs exactly. The viscous loss of the profile is Poiseuille's over the
  // plug's length L; theirs is over 0.83 L + 1.64 d. The plug's two walls are cones of one sample.
  const double diameter = 0.3, throat = 0.15, q = 1.5;
  const int points = 4001;
  const Lumen lumen = plug(diameter, throat, 4, 1, 2, points);
  const Losses losses = losses_along(lumen, kBlood);
  ASSERT_EQ(losses.stenoses.size(), 1u);
  EXPECT_NEAR(losses.stenoses[0].percent, 50, 1e-9);
  const YoungTsai exact = young_tsai(diameter, throat, 1, q, kBlood);
  EXPECT_NEAR(losses.separation.back() * q * q, exact.separation, 1e-9 * exact.separation);

  const auto poiseuille = [&](double d, double length) {
    return 128 * 0.04 * length / (kPi * std::pow(d, 4));
  };
  const double walls = 2 * 4.0 / (points - 1);  // no cone loses more than its throat would
  EXPECT_NEAR(losses.viscous.back(), poiseuille(throat, 1) + poiseuille(diameter, 3),
              poiseuille(throat, walls));
  // With the entrance of the published coefficients the whole formula, but for 0.17 L.
  const Losses blunt = losses_along(lumen, kBlood, {1.52, 1.64});
  EXPECT_NEAR((blunt.viscous.back() - poiseuille(diameter, 3)) * q,
              exact.viscous + poiseuille(throat, 0.17) * q, poiseuille(throat, walls) * q);
}

TEST(Losses, ASuddenWideningIsBordaAndCarnots) {
  const Losses losses =
      losses_along(tube(4, 401, [](double s) { return s < 1.2 ? 0.4 : 0.8; }), kBlood, {1, 0});
  const double step = 1 / area(0.4) - 1 / area(0.8);
  EXPECT_NEAR(losses.separation.back(), 0.5 * 1.06 * step * step, 1e-12);
}

TEST(Losses, NarrowingsInARowEachCost) {
  const auto two = [](double s) { return (s > 1 && s < 1.5) || (s > 6 && s < 6.5) ? 0.3 : 0.6; };
  const Losses one = losses_along(plug(0.6, 0.3, 10, 1, 1.5, 1001), kBlood);
  const Losses both = losses_along(tube(10, 1001, two), kBlood);
  ASSERT_EQ(both.stenoses.size(), 2u);
  EXPECT_NEAR(both.separation.back(), 2 * one.separation.back(), 1e-9 * one.separation.back());
}

TEST(Losses, RoughnessIsNoStenosis) {
  // 2 % of diameter up and down stays below the 5 % that count.
  const Losses losses = losses_along(
      tube(5, 101, [](double s) { return 0.5 * (1 + 0.01 * std::sin(40 * s)); }), kBlood);
  EXPECT_TRUE(losses.stenoses.empty());
  EXPECT_EQ(losses.separation.back(), 0);
}

TEST(Losses, ALongAneurysmDoesNotSeparateFurtherThanTenThroats) {
  // Widening goes on for 20 cm; what lies farther than 10 throat diameters behind is left out.
  const auto cone = [](double s) { return s < 1 ? 0.4 : 0.4 + 0.03 * (s - 1); };
  const Losses losses = losses_along(tube(21, 2101, cone), kBlood, {1, 0});
  ASSERT_GE(losses.stenoses.size(), 1u);
  const double end = 0.4 + 0.03 * 4;
  const double step = 1 / area(0.4) - 1 / area(end);
  EXPECT_NEAR(losses.separation[501], 0.5 * 1.06 * step * step, 0.01 * step * step);
}

}  // namespace
}  // namespace vstent::flow
