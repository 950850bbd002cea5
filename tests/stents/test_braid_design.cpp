#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "stents/bent_tube.hpp"
#include "stents/braid_design.hpp"

namespace vstent::stents {
namespace {

constexpr double pi = std::numbers::pi;

struct Braid {
  BraidParameters parameters;
  Specification specification;
  BraidDesign design() const { return {parameters, specification, std::nullopt}; }
};

/// EndoBeams.jl's preset of the 8 mm carotid Wallstent: 12 wires of 0.13 mm each way on a mean
/// radius of 4 mm; the angle is the one at which the wires cover 22.8 %.
Braid wallstent(int over = 1) {
  Braid braid;
  braid.parameters = {12, over, 59.3, 0};
  braid.specification.section = {true, 0.13, 0.13, 0.065};
  braid.specification.nominal_diameter = 8.26;
  braid.specification.nominal_length = 30;
  braid.specification.crimped_diameter = 2;
  return braid;
}

/// A 48-wire flow diverter, covering 30 to 35 %.
Braid flow_diverter(double diameter, double angle) {
  Braid braid;
  braid.parameters = {24, 2, angle, 0};
  braid.specification.section = {true, 0.03, 0.03, 0.015};
  braid.specification.nominal_diameter = diameter;
  braid.specification.nominal_length = 20;
  braid.specification.crimped_diameter = 0.7;
  return braid;
}

RadiusProfile uniform(double diameter) {
  return [diameter](double) { return 0.5 * diameter; };
}

TEST(Braid, KeepsWireLengthsOverTheWholeExpansion) {
  for (const Braid& braid : {wallstent(1), wallstent(2), flow_diverter(4, 60)}) {
    const BraidDesign design = braid.design();
    const Limits limits = design.limits();
    std::vector<double> nominal;
    for (const Member& wire : design.expanded(uniform(limits.nominal_diameter)).members)
      nominal.push_back(arc_length(wire));
    for (int i = 0; i <= 20; ++i) {
      const double diameter =
          limits.crimped_diameter + (limits.largest_diameter - limits.crimped_diameter) * i / 20.0;
      const Pattern pattern = design.expanded(uniform(diameter));
      for (std::size_t w = 0; w < nominal.size(); ++w)
        EXPECT_NEAR(arc_length(pattern.members[w]) / nominal[w], 1, 1e-9) << diameter;
    }
  }
}

// With 12 wires each way at R = 4 mm the closed form gives 1.29, 1.65 and 1.79 of the nominal
// length at 7, 5 and 3.7 mm. The weave's share of a wire's length is below (0.13 pi / 1.2)^2 / 8 =
// 1.4 %, and changes by a part of that.
TEST(Braid, LengthensAsTheClosedFormSays) {
  const BraidDesign design = wallstent().design();
  const double length = design.expanded(uniform(8.26)).length - 0.13;
  const double sine = std::sin(59.3 * pi / 180);
  for (const auto& [diameter, published] :
       std::vector<std::pair<double, double>>{{7, 1.29}, {5, 1.65}, {3.7, 1.79}}) {
    const double ratio = (design.expanded(uniform(diameter + 0.26)).length - 0.13) / length;
    const double exact = std::sqrt((1 - std::pow(sine * diameter / 8, 2)) / (1 - sine * sine));
    EXPECT_NEAR(exact, published, 0.01);
    EXPECT_NEAR(ratio, exact, 0.005) << diameter;
  }
}

// A wire of a hundredth of the diameter hardly weaves: the closed form to (0.01)^2 or so.
TEST(Braid, OfThinWiresIsTheClosedForm) {
  Braid braid = wallstent();
  braid.specification.section = {true, 0.004, 0.004, 0.002};
  braid.specification.nominal_diameter = 8.008;
  const BraidDesign design = braid.design();
  const double sine = std::sin(59.3 * pi / 180);
  const double length = design.expanded(uniform(8.008)).length - 0.004;
  for (const double diameter : {3.0, 6.0, 8.5}) {
    const double ratio = (design.expanded(uniform(diameter + 0.008)).length - 0.004) / length;
    EXPECT_NEAR(ratio, std::sqrt((1 - std::pow(sine * diameter / 8, 2)) / (1 - sine * sine)), 2e-5);
  }
}

TEST(Braid, LiesBetweenItsRadii) {
  for (const double diameter : {2.0, 5.0, 8.26}) {
    const Pattern pattern = wallstent(2).design().expanded(uniform(diameter));
    double least = 1e9, most = 0, first = 1e9, last = 0;
    for (const Member& wire : pattern.members)
      for (const PatternPoint& p : wire.points) {
        least = std::min(least, p.radius);
        most = std::max(most, p.radius);
        first = std::min(first, p.z);
        last = std::max(last, p.z);
      }
    EXPECT_NEAR(most, 0.5 * diameter - 0.065, 1e-12);
    EXPECT_NEAR(least, 0.5 * diameter - 0.195, 1e-12);
    EXPECT_NEAR(first, 0.065, 1e-12);
    EXPECT_NEAR(last, pattern.length - 0.065, 1e-9);
  }
}

// At every crossing one wire is outside and the other inside; along a wire they alternate by ones
// or by twos.
TEST(Braid, WeavesWithoutConflict) {
  for (const int over : {1, 2}) {
    const BraidDesign design = wallstent(over).design();
    const int n = 12;
    for (int row = 0; row <= design.rows(); ++row)
      for (int j = 0; j < n; ++j) {
        EXPECT_NE(design.runs_over(1, row, j), design.runs_over(-1, row, (j + row) % n));
        for (const int way : {1, -1})
          EXPECT_NE(design.runs_over(way, row, j), design.runs_over(way, row + over, j));
      }
    const Pattern pattern = design.expanded(uniform(8.26));
    int crossings = 0;
    for (int a = 0; a < n; ++a)
      for (int b = n; b < 2 * n; ++b)
        for (const PatternPoint& p : pattern.members[static_cast<std::size_t>(a)].points)
          for (const PatternPoint& q : pattern.members[static_cast<std::size_t>(b)].points) {
            if (std::abs(p.z - q.z) > 1e-9 ||
                std::abs(std::remainder(p.angle - q.angle, 2 * pi)) > 1e-9)
              continue;
            ++crossings;
            EXPECT_NEAR(std::abs(p.radius - q.radius), 0.13, 1e-12);
          }
    EXPECT_EQ(crossings, n * (design.rows() + 1));
  }
}

double distance(const Vec3& a0, const Vec3& a1, const Vec3& b0, const Vec3& b1) {
  // Convex in both parameters: alternate to the minimum.
  double s = 0.5, t = 0.5;
  const Vec3 u = a1 - a0, v = b1 - b0;
  for (int i = 0; i < 200; ++i) {
    t = std::clamp((a0 + s * u - b0).dot(v) / v.squaredNorm(), 0.0, 1.0);
    s = std::clamp((b0 + t * v - a0).dot(u) / u.squaredNorm(), 0.0, 1.0);
  }
  return (a0 + s * u - b0 - t * v).norm();
}

// Centre lines stay a wire's diameter apart, less twice the sag of the chords drawn (2 % of it).
TEST(Braid, WiresNeverRunIntoEachOther) {
  for (const int over : {1, 2}) {
    Braid braid = wallstent(over);
    braid.specification.crimped_diameter = 1.32;
    braid.specification.nominal_length = over == 1 ? 10 : 16;
    const BraidDesign design = braid.design();
    const Limits limits = design.limits();
    for (const double diameter :
         {limits.crimped_diameter, 1.6, 2.5, 5.0, 8.26, limits.largest_diameter}) {
      const Pattern pattern = design.expanded(uniform(diameter));
      const Member& first = pattern.members[0];
      double closest = 1e9;
      for (std::size_t w = 1; w < pattern.members.size(); ++w) {
        const Member& second = pattern.members[w];
        for (std::size_t i = 1; i < first.points.size(); ++i)
          for (std::size_t j = 1; j < second.points.size(); ++j) {
            if (std::abs(first.points[i].z - second.points[j].z) > 2) continue;
            const Vec3 a = straight_point(first.points[i]), b = straight_point(second.points[j]);
            if ((a - b).norm() > 0.6) continue;
            closest = std::min(closest, distance(straight_point(first.points[i - 1]), a,
                                                 straight_point(second.points[j - 1]), b));
          }
      }
      EXPECT_GT(closest, 0.13 * 0.96) << over << "x" << over << " at " << diameter;
    }
  }
}

TEST(Braid, NamesItsLimits) {
  const BraidDesign design = wallstent().design();
  const double largest = design.limits().largest_diameter;
  EXPECT_NO_THROW(design.expanded(uniform(largest)));
  try {
    design.expanded(uniform(1.001 * largest));
    ADD_FAILURE();
  } catch (const std::invalid_argument& error) {
    EXPECT_NE(std::string(error.what()).find(std::to_string(largest).substr(0, 4)),
              std::string::npos);
  }
  // At the largest diameter crossings lie a little more than a wire apart along the axis.
  EXPECT_NEAR(design.lattice(largest).height, 1.0567 * 0.13, 1e-6);
  Braid crowded = wallstent();
  crowded.specification.crimped_diameter = 1.2;
  EXPECT_THROW(crowded.design(), std::invalid_argument);
}

TEST(Braid, CountsRowsOutToTheLengthAskedFor) {
  const Braid braid = wallstent();
  for (const double length : {15.0, 30.0, 47.0}) {
    const BraidDesign design(braid.parameters, braid.specification, length);
    const double row = design.lattice(8.26).height;
    EXPECT_LE(std::abs(design.expanded(uniform(8.26)).length - length), 0.5 * row + 1e-9);
  }
}

TEST(Braid, BelowCrimpedIsTheCrimpedPatternOnASmallerCylinder) {
  const BraidDesign design = wallstent().design();
  const Pattern crimped = design.expanded(uniform(2)), small = design.expanded(uniform(1));
  EXPECT_DOUBLE_EQ(small.length, crimped.length);
  for (std::size_t i = 0; i < crimped.members[3].points.size(); ++i) {
    const PatternPoint &p = crimped.members[3].points[i], &q = small.members[3].points[i];
    EXPECT_DOUBLE_EQ(q.radius, 0.5 * p.radius);
    EXPECT_DOUBLE_EQ(q.angle, p.angle);
    EXPECT_DOUBLE_EQ(q.z, p.z);
  }
}

// Tapered, each place has its own angle; wires keep their lengths, inner and outer halves on
// average over neighbouring rows, whose radii differ by 0.2 %.
TEST(Braid, TapersWithItsWiresLengthsKept) {
  for (const int over : {1, 2}) {
    const BraidDesign design = wallstent(over).design();
    const double nominal = arc_length(design.expanded(uniform(8.26)).members[0]);
    const Pattern pattern = design.expanded([](double share) { return 4.0 - 1.0 * share; });
    for (const Member& wire : pattern.members)
      EXPECT_NEAR(arc_length(wire) / nominal, 1, over == 1 ? 1e-5 : 1e-4);
    for (const Member& wire : pattern.members)
      for (const PatternPoint& p : wire.points) {
        const double outer = 4.0 - p.z / pattern.length;
        EXPECT_LE(p.radius, outer - 0.065 + 1e-9);
        EXPECT_GE(p.radius, outer - 0.195 - 1e-9);
      }
  }
}

}  // namespace
}  // namespace vstent::stents
