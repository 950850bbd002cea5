#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "stents/coil_design.hpp"

namespace vstent::stents {
namespace {

constexpr double pi = std::numbers::pi;

Specification wire(double diameter) {
  Specification specification;
  specification.section = {true, diameter, diameter, 0.5 * diameter};
  specification.nominal_diameter = 3;
  specification.nominal_length = 18.15;
  specification.crimped_diameter = 1.2;
  return specification;
}

CoilParameters parameters(bool spine = false, double lengthening = 0.05) {
  CoilParameters result;
  result.turns = 15;
  result.pitch = 1.2;
  result.spine = spine;
  result.lengthening = lengthening;
  return result;
}

RadiusProfile uniform(double diameter) {
  return [diameter](double) { return 0.5 * diameter; };
}

TEST(Coil, KeepsItsWireAndFollowsItsLaw) {
  for (const double lengthening : {0.0, 0.05, 0.2}) {
    const CoilDesign design(parameters(false, lengthening), wire(0.15), std::nullopt);
    const double radius = 1.425;
    const double wire_length = 15 * std::hypot(2 * pi * radius, 1.2);
    const double exponent = std::log1p(lengthening) / std::log(1.425 / 0.525);
    for (const double diameter : {1.2, 2.0, 3.0, 4.0}) {
      const Pattern pattern = design.expanded(uniform(diameter));
      EXPECT_NEAR(arc_length(pattern.members[0]) / wire_length, 1, 1e-9);
      const double r = 0.5 * (diameter - 0.15);
      EXPECT_NEAR(pattern.length - 0.15, 18 * std::pow(r / radius, exponent), 1e-9);
      const double turned = pattern.members[0].points.back().angle * 2 / (2 * pi);
      EXPECT_NEAR(turned, design.turns(diameter), 1e-9);
      // L = p n with the pitch p of a coil at that angle.
      const double pitch = 2 * pi * r * std::tan(std::asin((pattern.length - 0.15) / wire_length));
      EXPECT_NEAR(pitch * turned, pattern.length - 0.15, 1e-9);
    }
    EXPECT_NEAR(
        (design.expanded(uniform(3)).length - 0.15) / (design.expanded(uniform(1.2)).length - 0.15),
        1 + lengthening, 1e-9);
  }
}

TEST(Coil, WithASpineKeepsItsLength) {
  const CoilDesign design(parameters(true), wire(0.15), std::nullopt);
  for (const double diameter : {1.2, 3.0, 4.0}) {
    const Pattern pattern = design.expanded(uniform(diameter));
    EXPECT_NEAR(pattern.length, 18.15, 1e-9);
    ASSERT_EQ(pattern.members.size(), 2u);
    EXPECT_NEAR(arc_length(pattern.members[1]), 18, 1e-9);
  }
}

// Per piece the cone's radius is taken as linear, its rise as that of its middle.
TEST(Coil, TapersWithItsWireKept) {
  const CoilDesign design(parameters(), wire(0.15), 20);
  const double nominal = arc_length(design.expanded(uniform(3)).members[0]);
  const Pattern pattern = design.expanded([](double share) { return 1.6 - 0.4 * share; });
  EXPECT_NEAR(arc_length(pattern.members[0]) / nominal, 1, 1e-9);
  for (const PatternPoint& p : pattern.members[0].points)
    EXPECT_NEAR(p.radius, 1.6 - 0.4 * p.z / pattern.length - 0.075, 1e-9);
}

TEST(Coil, NamesItsLimits) {
  const CoilDesign design(parameters(), wire(0.15), std::nullopt);
  const double largest = design.limits().largest_diameter;
  EXPECT_NEAR(design.turns(largest), 1, 1e-9);
  EXPECT_THROW(design.expanded(uniform(1.01 * largest)), std::invalid_argument);
  EXPECT_NEAR(design.expanded(uniform(3)).length, 18.15, 1e-9);
  EXPECT_NEAR(CoilDesign(parameters(), wire(0.15), 12).expanded(uniform(3)).length, 12, 1e-9);
  Specification crowded = wire(0.15);
  crowded.crimped_diameter = 0.4;
  EXPECT_THROW(CoilDesign(parameters(), crowded, std::nullopt), std::invalid_argument);
}

}  // namespace
}  // namespace vstent::stents
