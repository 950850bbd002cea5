// Stenosis, gain and volume of vessels that were made with them.
#include <gtest/gtest.h>

#include "tests/measure/vessels.hpp"

namespace vstent::measure {
namespace {

using std::numbers::pi;
using tests::equivalent_diameter;
using tests::polygon_area;
using tests::TestVessel;

constexpr int kAround = 60;

/// Radius 3 with a cosine narrowing to `narrowest` over 12 mm around z = 30; 4 beyond z = 40.
auto stenosed(double narrowest) {
  return [=](double z) {
    const double healthy = z < 40 ? 3 : 4;
    if (std::abs(z - 30) > 6) return healthy;
    return 3 - (3 - narrowest) * 0.5 * (1 + std::cos(pi * (z - 30) / 6));
  };
}

struct Case {
  TestVessel before = tests::lathe(60, kAround, 241, stenosed(1.5));
  TestVessel after = tests::lathe(60, kAround, 241, stenosed(2.7));
  StentBody stent = tests::straight_stent(20, 38, 2.7, 0.15);
};

double diameter(double radius) { return equivalent_diameter(polygon_area(kAround, radius)); }

TEST(Lumen, HasTheStenosisItWasMadeWith) {
  const Case c;
  const Metrics m =
      measure({c.before.surface, c.after.surface, c.before.centerline, &c.stent}).metrics;
  // Stations are 0.3 mm apart, the nearest to the narrowest place at most 0.15 mm: there the radius
  // is larger by (3 - 1.5)/4 (pi 0.15 / 6)^2, which makes 0.004 mm of the diameter.
  const double miss = 2 * 1.5 / 4 * std::pow(pi * 0.15 / 6, 2);
  EXPECT_NEAR(m.narrowest_before, diameter(1.5), miss);
  EXPECT_NEAR(m.narrowest_before_at, 30, 0.16);
  EXPECT_NEAR(m.narrowest_after, diameter(2.7), miss);
  EXPECT_NEAR(*m.reference_proximal, diameter(3), 1e-9);
  EXPECT_NEAR(*m.reference_distal, diameter(4), 1e-9);
  EXPECT_EQ(m.reference_diameter, *m.reference_proximal);
  EXPECT_NEAR(*m.stenosis_before, 50, 100 * miss / 6);
  EXPECT_NEAR(*m.stenosis_after, 10, 100 * miss / 6);
  // %AS = 100 (1 - (1 - %DS/100)^2): 50 makes 75, 10 makes 19.
  EXPECT_NEAR(*m.area_stenosis_before, 75, 200 * miss / 6);
  EXPECT_NEAR(*m.area_stenosis_after, 19, 200 * miss / 6);
  EXPECT_NEAR(*m.min_area_before, polygon_area(kAround, 1.5), 6 * miss);
  EXPECT_NEAR(*m.min_stent_area, polygon_area(kAround, 2.7), 9 * miss);
  EXPECT_NEAR(*m.expansion_of_reference, 100 * 2.7 * 2.7 / (0.5 * (3 * 3 + 4 * 4)), 1);
}

TEST(Lumen, GainsTheVolumeBetweenTheTwoProfiles) {
  const Case c;
  const Metrics m =
      measure({c.before.surface, c.after.surface, c.before.centerline, &c.stent}).metrics;
  double gain = 0;
  const int steps = 100000;
  for (int i = 0; i < steps; ++i) {
    const double z = 24 + 12 * (i + 0.5) / steps;
    gain += 12.0 / steps *
            (polygon_area(kAround, stenosed(2.7)(z)) - polygon_area(kAround, stenosed(1.5)(z)));
  }
  // The trapezoidal rule with step h on a periodic bump: far below a thousandth; rings 0.25 mm
  // apart cut corners by 0.25^2/8 of the second derivative, 0.4 mm of radius curvature 1/mm at
  // most.
  EXPECT_NEAR(*m.volume_after - *m.volume_before, gain, 0.005 * gain);
}

TEST(Lumen, TreatedLengthIsWhereItChangedWhereNoStentIsKnown) {
  const Case c;
  const Metrics m = measure({c.before.surface, c.after.surface, c.before.centerline}).metrics;
  EXPECT_TRUE(m.changed);
  EXPECT_FALSE(m.has_stent);
  // The radius differs by 2 % where 1.2 (1 + cos)/2 is 0.02 of about 3: 0.85 mm from the ends.
  const double quiet = 6 / pi * std::acos(1 - 2 * 0.06 / 1.2);
  EXPECT_NEAR(m.treated_from, 24 + quiet, 0.31);
  EXPECT_NEAR(m.treated_to, 36 - quiet, 0.31);
  EXPECT_NEAR(m.narrowest_before, diameter(1.5), 0.01);
  const Metrics same = measure({c.before.surface, c.before.surface, c.before.centerline}).metrics;
  EXPECT_FALSE(same.changed);
  EXPECT_NEAR(same.narrowest_before, diameter(1.5), 0.01);
  EXPECT_EQ(same.narrowest_before, same.narrowest_after);
}

TEST(Lumen, OfTheIdealVesselHasItsStenosis) {
  vessels::IdealisedVessel vessel;
  vessel.stenosis = 0.6;
  const TestVessel made = tests::idealised(vessel);
  const StentBody stent = tests::straight_stent(18, 42, 5);
  const Metrics m = measure({made.surface, made.surface, made.centerline, &stent}).metrics;
  // percent; halfway between rings, 0.43 mm apart, the radius is up to 0.3 % wider
  EXPECT_NEAR(*m.stenosis_before, 60, 0.5);
}

}  // namespace
}  // namespace vstent::measure
