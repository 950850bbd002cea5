// Closed diamonds: struts keep their length on cylinders and cones, and the length of the whole
// obeys its closed form.
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "stents/catalogue.hpp"
#include "stents/diamond_design.hpp"
#include "stents/expansion.hpp"

namespace vstent::stents {
namespace {

using std::numbers::pi;

Specification specification() {
  return {.name = "test",
          .description = "",
          .pattern = DiamondParameters{},
          .section = {true, 0.3, 0.3, 0.15},
          .nominal_diameter = 12,
          .nominal_length = 30,
          .crimped_diameter = 3.4};
}

constexpr DiamondParameters kWelded{.crowns = 8, .rows = 5, .strut_length = 6, .bridge = 0};
constexpr DiamondParameters kBridged{.crowns = 8, .rows = 5, .strut_length = 6, .bridge = 0.7};

TEST(DiamondDesign, LengthObeysTheLaw) {
  // L = L_straight sqrt(1 - (D / D_max)^2) between crowns, D of the centre line, D_max = 2 N l / pi
  for (const DiamondParameters& p : {kWelded, kBridged}) {
    const DiamondDesign design(p, specification());
    const double widest = 2 * 8 * 6 / pi;
    EXPECT_NEAR(design.limits().largest_diameter, widest + 0.3, 1e-12);
    for (const double d : {3.4, 8.0, 12.0, 20.0, 28.0, 30.8}) {
      const double ratio = (d - 0.3) / widest;
      EXPECT_NEAR(design.expanded(d).length,
                  5 * 6 * std::sqrt(1 - ratio * ratio) + 4 * p.bridge + 0.3, 1e-12)
          << d;
    }
    // at the limit what is left of a strut's height is the square root of a rounding error
    EXPECT_NEAR(design.expanded(widest + 0.3).length, 4 * p.bridge + 0.3, 1e-5);
  }
}

TEST(DiamondDesign, EveryStrutKeepsItsLengthOnConesToo) {
  const std::vector<RadiusProfile> profiles = {
      [](double) { return 1.7; }, [](double) { return 15.2; },
      [](double share) { return 10 - 3 * share; },
      [](double share) { return 6 + 4 * std::abs(2 * share - 1); }};
  for (const DiamondParameters& p : {kWelded, kBridged}) {
    const DiamondDesign design(p, specification());
    for (const RadiusProfile& profile : profiles) {
      const Pattern pattern = design.expanded(profile);
      for (const Member& member : pattern.members) {
        if (member.kind == Member::Kind::connector) {
          EXPECT_NEAR(arc_length(member), 0.7, 1e-12);
          continue;
        }
        const std::size_t per_strut = member.points.size() / 16;
        for (std::size_t k = 0; k < 16; ++k) {
          Member strut{.points = {}};
          for (std::size_t i = 0; i <= per_strut; ++i) {
            PatternPoint point = member.points[(k * per_strut + i) % member.points.size()];
            if (k * per_strut + i == member.points.size()) point.angle += 2 * pi;
            strut.points.push_back(point);
          }
          EXPECT_NEAR(arc_length(strut), 6, 6e-6);
        }
      }
    }
  }
}

TEST(DiamondDesign, RowsMeetCrownToCrown) {
  const DiamondDesign design(kWelded, specification());
  const Pattern pattern = design.expanded([](double share) { return 9 - 2 * share; });
  for (std::size_t row = 0; row + 1 < pattern.rings.size(); ++row) {
    const auto &a = pattern.members[row].points, &b = pattern.members[row + 1].points;
    const std::size_t per_strut = a.size() / 16;
    int met = 0;
    for (std::size_t i = 0; i < a.size(); i += 2 * per_strut) {
      for (std::size_t j = per_strut; j < b.size(); j += 2 * per_strut) {
        met += a[i].z == b[j].z && a[i].radius == b[j].radius &&
               std::abs(std::remainder(a[i].angle - b[j].angle, 2 * pi)) < 1e-14;
      }
    }
    EXPECT_EQ(met, 8) << row;
  }
}

TEST(DiamondDesign, RowsAreCountedOut) {
  for (const double asked : {16.0, 22.0, 28.0, 34.0, 39.0, 45.0}) {
    const DiamondDesign design(kWelded, specification(), asked);
    EXPECT_LE(std::abs(design.expanded(12).length - asked), 0.5 * design.row_length(12) + 1e-9);
  }
}

TEST(DiamondDesign, NamesItsLimits) {
  const DiamondDesign design(kWelded, specification());
  try {
    design.expanded(31);
    FAIL();
  } catch (const std::invalid_argument& error) {
    EXPECT_NE(std::string(error.what()).find("30.86 mm"), std::string::npos) << error.what();
  }
  Specification tight = specification();
  tight.crimped_diameter = 1.5;
  EXPECT_THROW(DiamondDesign(kWelded, tight), std::invalid_argument);
  // between two nodes on a cone so steep that no strut spans it
  EXPECT_THROW(design.expanded([](double share) { return share < 0.5 ? 2.0 : 15.3; }),
               std::invalid_argument);
}

TEST(DiamondDesign, BelowCrimpedTheCrimpedPatternIsDrawnSmaller) {
  const DiamondDesign design(kBridged, specification());
  const Pattern crimped = design.expanded(3.4), smaller = design.expanded(1.0);
  EXPECT_EQ(crimped.length, smaller.length);
  for (std::size_t m = 0; m < crimped.members.size(); ++m) {
    for (std::size_t i = 0; i < crimped.members[m].points.size(); ++i) {
      EXPECT_EQ(crimped.members[m].points[i].z, smaller.members[m].points[i].z);
      EXPECT_NEAR(smaller.members[m].points[i].radius, 0.35, 1e-15);
    }
  }
}

}  // namespace
}  // namespace vstent::stents
