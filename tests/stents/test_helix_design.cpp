#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "stents/helix_design.hpp"
#include "stents/strut_network.hpp"

namespace vstent::stents {
namespace {

constexpr double pi = std::numbers::pi;

struct Helix {
  HelixParameters parameters;
  Specification specification;
  HelixDesign design(std::optional<double> length = std::nullopt) const {
    return {parameters, specification, length};
  }
};

/// One wire of 0.08 mm, 7.5 waves to a turn, joined at every fifth.
Helix single() {
  Helix helix;
  helix.parameters.units_per_turn = 7.5;
  helix.parameters.strut_length = 1.06;
  helix.parameters.pitch = 1.0;
  helix.parameters.join_every = 5;
  helix.specification.section = {true, 0.08, 0.08, 0.04};
  helix.specification.nominal_diameter = 3;
  helix.specification.nominal_length = 15;
  helix.specification.crimped_diameter = 1;
  return helix;
}

/// Two strands of 0.06 mm with S joints and flat ends.
Helix twofold() {
  Helix helix = single();
  helix.parameters.strands = 2;
  helix.parameters.units_per_turn = 7;
  helix.parameters.strut_length = 1.17;
  helix.parameters.pitch = 3;
  helix.parameters.join_every = 2;
  helix.parameters.joint = Link::s;
  helix.parameters.joint_length = 1.2;
  helix.parameters.end_ring = 0.5;
  helix.specification.section = {false, 0.06, 0.06, 0.01};
  return helix;
}

Helix flat_ended() {
  Helix helix = single();
  helix.parameters.end_ring = 0.25;
  return helix;
}

RadiusProfile uniform(double diameter) {
  return [diameter](double) { return 0.5 * diameter; };
}

/// Lengths of the wires' half waves, crown to crown.
std::vector<double> strut_lengths(const Pattern& pattern) {
  std::vector<double> lengths;
  for (const Member& member : pattern.members) {
    if (member.kind == Member::Kind::connector) continue;
    std::vector<int> ends = crowns_of(member);
    ends.insert(ends.begin(), 0);
    ends.push_back(static_cast<int>(member.points.size()) - 1);
    for (std::size_t k = 1; k < ends.size(); ++k) {
      Member part;
      part.points.assign(member.points.begin() + ends[k - 1], member.points.begin() + ends[k] + 1);
      lengths.push_back(arc_length(part));
    }
  }
  return lengths;
}

TEST(Helix, KeepsEveryStrutOverTheWholeExpansion) {
  for (const Helix& helix : {single(), twofold(), flat_ended()}) {
    const HelixDesign design = helix.design();
    const Limits limits = design.limits();
    EXPECT_GT(limits.largest_diameter, 3.2);
    const Pattern at_nominal = design.expanded(uniform(3));
    const std::vector<double> nominal = strut_lengths(at_nominal);
    for (int i = 0; i <= 12; ++i) {
      const double diameter =
          limits.crimped_diameter + (limits.largest_diameter - limits.crimped_diameter) * i / 12.0;
      const Pattern pattern = design.expanded(uniform(diameter));
      const std::vector<double> lengths = strut_lengths(pattern);
      ASSERT_EQ(lengths.size(), nominal.size()) << diameter;
      for (std::size_t k = 0; k < lengths.size(); ++k)
        EXPECT_NEAR(lengths[k] / nominal[k], 1, 1e-9) << diameter;
      for (const Member& member : pattern.members) {
        if (member.kind != Member::Kind::connector) continue;
        EXPECT_NEAR(arc_length(member) / arc_length(at_nominal.members.back()), 1, 1e-9)
            << diameter;
      }
    }
  }
}

// The pitch follows h = s d - g with the gap kept.
TEST(Helix, AdvancesWithTheHeightOfItsWaves) {
  const HelixDesign design = single().design();
  const auto nominal = design.winding(3);
  EXPECT_NEAR(nominal.advance * 7.5, 1.0, 1e-9);
  const double gap = nominal.advance * 7.5 - nominal.height;
  EXPECT_GT(gap, 0);
  for (const double diameter : {1.0, 2.0, 3.5}) {
    const auto w = design.winding(diameter);
    EXPECT_NEAR(w.advance * 7.5 - w.height, gap, 1e-9);
    // Crowns of neighbouring turns face each other.
    EXPECT_NEAR(w.unit_angle * (7.5 - 0.5 * w.skew), 2 * pi, 1e-9);
  }
}

TEST(Helix, JoinsFacingCrowns) {
  const Pattern pattern = single().design().expanded(uniform(3));
  int joints = 0;
  for (const Member& member : pattern.members) {
    if (member.kind != Member::Kind::connector) continue;
    ++joints;
    EXPECT_NEAR(std::remainder(member.points.front().angle - member.points.back().angle, 2 * pi), 0,
                1e-9);
    for (const PatternPoint& end : {member.points.front(), member.points.back()}) {
      double nearest = 1e9;
      for (const PatternPoint& p : pattern.members[0].points)
        nearest =
            std::min(nearest, std::hypot(p.z - end.z, std::remainder(p.angle - end.angle, 2 * pi)));
      EXPECT_LT(nearest, 1e-9);
    }
  }
  EXPECT_GT(joints, 10);
}

// With the pitch at which crowns meet they are fused: a hundredth of their width apart at every
// expansion.
TEST(Helix, FusesCrownsThatMeet) {
  Helix helix = single();
  const auto w = helix.design().winding(3);
  helix.parameters.pitch = 0.5;
  try {
    helix.design();
    ADD_FAILURE();
  } catch (const std::invalid_argument& error) {
    const std::string text = error.what();
    helix.parameters.pitch = std::stod(text.substr(text.find("meet at ") + 8));
  }
  EXPECT_NEAR(helix.parameters.pitch, w.height, 0.02);
  const HelixDesign design = helix.design();
  for (const double diameter : {1.0, 3.0, 3.6}) {
    const Pattern pattern = design.expanded(uniform(diameter));
    const Member& wire = pattern.members[0];
    const std::vector<int> crowns = crowns_of(wire);
    int met = 0;
    for (const int a : crowns)
      for (const int b : crowns) {
        const PatternPoint &p = wire.points[static_cast<std::size_t>(a)],
                           &q = wire.points[static_cast<std::size_t>(b)];
        if (b > a + 1 && std::abs(p.z - q.z) < 0.02 * 0.08 &&
            std::abs(std::remainder(p.angle - q.angle, 2 * pi)) < 1e-6)
          ++met;
      }
    EXPECT_GT(met, 50) << diameter;
  }
}

TEST(Helix, RunsOutIntoFlatEnds) {
  const Pattern pattern = flat_ended().design().expanded(uniform(3));
  double lowest = 1e9, highest = 0;
  for (const Member& member : pattern.members)
    for (const PatternPoint& p : member.points) {
      lowest = std::min(lowest, p.z);
      highest = std::max(highest, p.z);
    }
  EXPECT_NEAR(lowest, 0.04, 1e-9);
  EXPECT_NEAR(highest, pattern.length - 0.04, 1e-9);
  // Valleys of the first turn and peaks of the last lie in one plane each.
  int first = 0, last = 0;
  for (const Member& member : pattern.members) {
    if (member.kind == Member::Kind::connector) continue;
    for (const int c : crowns_of(member)) {
      const double z = member.points[static_cast<std::size_t>(c)].z;
      first += std::abs(z - lowest) < 1e-9;
      last += std::abs(z - highest) < 1e-9;
    }
  }
  EXPECT_GE(first, 4);
  EXPECT_GE(last, 4);
}

TEST(Helix, CountsUnitsOutToTheLengthAskedFor) {
  for (const Helix& helix : {single(), twofold()})
    for (const double length : {9.0, 15.0, 23.0}) {
      const HelixDesign design = helix.design(length);
      EXPECT_LE(std::abs(design.expanded(uniform(3)).length - length),
                0.5 * design.winding(3).advance + 1e-6);
    }
}

TEST(Helix, TapersWithItsStrutsKept) {
  for (const Helix& helix : {single(), twofold()}) {
    const HelixDesign design = helix.design();
    const std::vector<double> nominal = strut_lengths(design.expanded(uniform(3)));
    const Pattern pattern = design.expanded([](double share) { return 1.55 - 0.3 * share; });
    const std::vector<double> lengths = strut_lengths(pattern);
    ASSERT_EQ(lengths.size(), nominal.size());
    for (std::size_t k = 0; k < lengths.size(); ++k) EXPECT_NEAR(lengths[k] / nominal[k], 1, 1e-9);
  }
}

TEST(Helix, NamesItsLimits) {
  const HelixDesign design = single().design();
  EXPECT_NO_THROW(design.expanded(uniform(design.limits().largest_diameter)));
  EXPECT_THROW(design.expanded(uniform(1.01 * design.limits().largest_diameter)),
               std::invalid_argument);
  Helix crowded = single();
  crowded.specification.crimped_diameter = 0.2;
  EXPECT_THROW(crowded.design(), std::invalid_argument);
  Helix short_joints = twofold();
  short_joints.parameters.joint_length = 0.1;
  EXPECT_THROW(short_joints.design(), std::invalid_argument);
}

}  // namespace
}  // namespace vstent::stents
