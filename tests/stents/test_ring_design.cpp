// Rings in sequence: their struts keep their length, they close around the circumference, and
// their pitch follows the attachment of their connectors.
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <set>

#include "stents/catalogue.hpp"
#include "stents/expansion.hpp"
#include "stents/ring_design.hpp"

namespace vstent::stents {
namespace {

using std::numbers::pi;

/// Chords of sag s on an arc of radius rho are shorter than the arc by the share s / (3 rho). With
/// sags of 1e-6 strut widths, which are below the crowns' radii, all lengths are within 4e-7.
constexpr double kFine = 1e-6;
constexpr double kConserved = 1e-6;

Specification finely_drawn(Specification s) {
  s.largest_sag = kFine;
  return s;
}

Specification ring_specification(RingParameters p) {
  Specification s{.name = "test",
                  .description = "",
                  .pattern = p,
                  .section = {false, 0.08, 0.08, 0.01},
                  .nominal_diameter = 3.0,
                  .nominal_length = 10,
                  .crimped_diameter = 1.1};
  s.largest_sag = kFine;
  return s;
}

RingParameters zig_zag(Connectors connectors) {
  return {.wave = Wave::zig_zag,
          .crowns = 6,
          .rings = 3,
          .straight_length = 0.8,
          .crown_arc = 0.19,
          .strut_length = 0,
          .connectors = connectors};
}

RingParameters sinusoid(Connectors connectors) {
  return {.wave = Wave::sinusoid,
          .crowns = 6,
          .rings = 3,
          .straight_length = 0,
          .crown_arc = 0,
          .strut_length = 1.18,
          .connectors = connectors};
}

const Connectors kFacing{.phase = Phase::facing, .count = 6, .length = 0.5};
const Connectors kInPhase{.phase = Phase::in_phase, .count = 3, .shift = 1, .length = 1.4};
const Connectors kFarPeak{.phase = Phase::far_peak, .count = 2, .length = 2.4};
const Connectors kOffset{.phase = Phase::offset,
                         .count = 2,
                         .shift = 1,
                         .alternate = false,
                         .length = 0.4,
                         .span = 0.2,
                         .absorption = 1};
Connectors bent(Link shape) {
  return {.shape = shape,
          .phase = Phase::facing,
          .count = 6,
          .length = 1.2,
          .span = 0.5,
          .absorption = 1};
}

std::vector<std::pair<std::string, RingParameters>> every_kind() {
  std::vector<std::pair<std::string, RingParameters>> kinds;
  const std::vector<std::pair<std::string, Connectors>> connectors = {
      {"facing", kFacing},  {"in_phase", kInPhase}, {"far_peak", kFarPeak}, {"offset", kOffset},
      {"u", bent(Link::u)}, {"n", bent(Link::n)},   {"s", bent(Link::s)}};
  for (const auto& [name, c] : connectors) {
    kinds.emplace_back("zig_zag " + name, zig_zag(c));
    kinds.emplace_back("sinusoid " + name, sinusoid(c));
  }
  return kinds;
}

std::vector<double> diameters(const Design& design) {
  const Limits limits = design.limits();
  std::vector<double> result;
  for (int i = 0; i <= 8; ++i) {
    result.push_back(limits.crimped_diameter +
                     i / 8.0 * (limits.largest_diameter - limits.crimped_diameter));
  }
  return result;
}

double metal_end(const Pattern& pattern, bool distal) {
  double end = distal ? -1e9 : 1e9;
  for (const Member& member : pattern.members) {
    for (const PatternPoint& p : member.points)
      end = distal ? std::max(end, p.z) : std::min(end, p.z);
  }
  return end + (distal ? 0.5 : -0.5) * pattern.section.width;
}

TEST(RingDesign, StrutsAndConnectorsKeepTheirLengthFromCrimpedToTheLimit) {
  for (const auto& [name, parameters] : every_kind()) {
    const RingDesign design(parameters, ring_specification(parameters));
    const double strut = parameters.wave == Wave::zig_zag ? 0.8 + 2 * 0.19 : 1.18;
    for (const double d : diameters(design)) {
      const Pattern pattern = design.expanded(d);
      for (const Member& member : pattern.members) {
        const bool ring = member.kind == Member::Kind::strut;
        const double expected = ring ? 12 * strut : parameters.connectors.length;
        EXPECT_NEAR(arc_length(member) / expected, 1, kConserved) << name << " at " << d;
      }
    }
  }
}

TEST(RingDesign, LimitIsWhereHalfWavesAreStraight) {
  for (const auto& [name, parameters] : every_kind()) {
    const RingDesign design(parameters, ring_specification(parameters));
    const double limit = 2 * 6 * 1.18 / pi + 0.08;
    EXPECT_NEAR(design.limits().largest_diameter, limit, 1e-12) << name;
    // h falls to zero there like the square root of what is left
    EXPECT_LT(design.ring_length(limit), 1e-6) << name;
    try {
      design.expanded(limit + 0.01);
      FAIL() << name;
    } catch (const std::invalid_argument& error) {
      EXPECT_NE(std::string(error.what()).find("4.587 mm"), std::string::npos) << error.what();
    }
  }
}

/// The height of a zig-zag by integrating its slope angle along the arc: the slow twin of the
/// closed form.
double integrated_height(double straight, double crown, double half_width) {
  const int steps = 2000;
  const auto run = [&](double t, bool width) {
    double sum = width ? straight * std::cos(t) : straight * std::sin(t);
    for (int i = 0; i < steps; ++i) {
      const double turned = t * (i + 0.5) / steps;
      sum += 2 * crown / steps * (width ? std::cos(turned) : std::sin(turned));
    }
    return sum;
  };
  double low = 0, high = 2;
  for (int i = 0; i < 60; ++i) {
    const double middle = 0.5 * (low + high);
    (run(middle, true) > half_width ? low : high) = middle;
  }
  return run(low, false);
}

TEST(RingDesign, RingLengthIsTheIntegralOfItsSlope) {
  const RingDesign design(zig_zag(kInPhase), ring_specification(zig_zag(kInPhase)));
  for (const double d : diameters(design)) {
    // the midpoint rule's error: t^2 / (24 steps^2) of the crown arcs
    EXPECT_NEAR(design.ring_length(d), integrated_height(0.8, 0.19, pi * 0.5 * (d - 0.08) / 6),
                1e-6)
        << d;
  }
}

TEST(RingDesign, PitchFollowsTheAttachment) {
  const auto pitch_of = [](const Connectors& c, double d) {
    return RingDesign(zig_zag(c), ring_specification(zig_zag(c))).pitch(d);
  };
  const RingDesign any(zig_zag(kFacing), ring_specification(zig_zag(kFacing)));
  Connectors follows = bent(Link::s);
  follows.absorption = 0;
  Connectors half = follows;
  half.absorption = 0.5;
  const double nominal = any.ring_length(3.0);
  for (const double d : diameters(any)) {
    const double h = any.ring_length(d);
    EXPECT_NEAR(pitch_of(kFacing, d), 0.5 + h, 1e-12) << d;
    EXPECT_NEAR(pitch_of(kInPhase, d), 1.4, 1e-12) << d;
    EXPECT_NEAR(pitch_of(kFarPeak, d), 2.4 - h, 1e-12) << d;
    EXPECT_NEAR(pitch_of(follows, d), 0.5 + h, 1e-12) << d;
    EXPECT_NEAR(pitch_of(half, d), 0.5 + 0.5 * (h + nominal), 1e-12) << d;
    // a link of 1.2 mm that gives back everything is taut where the gap has grown by 0.7 mm
    EXPECT_NEAR(pitch_of(bent(Link::s), d), std::min(0.5 + nominal, 1.2 + h), 1e-12) << d;
  }
}

TEST(RingDesign, LengthSpansTheMetal) {
  for (const auto& [name, parameters] : every_kind()) {
    const RingDesign design(parameters, ring_specification(parameters));
    for (const double d : diameters(design)) {
      const Pattern pattern = design.expanded(d);
      EXPECT_NEAR(metal_end(pattern, false), 0, 1e-12) << name << " at " << d;
      EXPECT_NEAR(metal_end(pattern, true), pattern.length, 1e-12) << name << " at " << d;
    }
  }
}

TEST(RingDesign, ConnectorsEndOnPointsOfTheirRings) {
  for (const auto& [name, parameters] : every_kind()) {
    const RingDesign design(parameters, ring_specification(parameters));
    for (const double d : {0.7, 1.1, 2.5, 3.4}) {
      const Pattern pattern = design.expanded([d](double share) { return 0.5 * d + 0.03 * share; });
      int connectors = 0;
      for (const Member& member : pattern.members) {
        if (member.kind != Member::Kind::connector) continue;
        ++connectors;
        const auto lies_on = [&](const PatternPoint& end, int ring) {
          for (const PatternPoint& p : pattern.members[static_cast<std::size_t>(ring)].points) {
            if (p.radius == end.radius && p.z == end.z &&
                std::abs(std::remainder(p.angle - end.angle, 2 * pi)) < 1e-14) {
              return true;
            }
          }
          return false;
        };
        EXPECT_TRUE(lies_on(member.points.front(), member.ring)) << name << " at " << d;
        EXPECT_TRUE(lies_on(member.points.back(), member.next_ring)) << name << " at " << d;
      }
      EXPECT_EQ(connectors, 2 * parameters.connectors.count) << name;
    }
  }
}

TEST(RingDesign, EveryRingClosesAroundItsOwnCircumference) {
  RingParameters p = zig_zag({.phase = Phase::facing, .count = 9, .length = 1.0});
  p.crowns = 9;
  p.rings = 6;
  p.straight_length = 2.0;
  p.crown_arc = 0.4;
  Specification s = ring_specification(p);
  s.nominal_diameter = 10;
  s.crimped_diameter = 2.0;
  s.largest_sag = 0.02;
  const RingDesign design(p, s);
  const auto taper = [](double share) { return 5.0 - 1.5 * share; };
  const Pattern pattern = design.expanded(taper);
  const double nominal_length = design.expanded(10).length;
  double height_before = 0, z_before = 0, radius_before = 0;
  for (std::size_t i = 0; i < pattern.rings.size(); ++i) {
    const Ring& ring = pattern.rings[i];
    // each ring lies at its share of the nominal length, its radius follows the taper there
    const double h = design.ring_length(10);
    const double share =
        (0.5 * (h + 0.08) + static_cast<double>(i) * design.pitch(10)) / nominal_length;
    EXPECT_NEAR(ring.radius, taper(share) - 0.04, 1e-12);
    // its half widths, crown to crown, sum up to half its circumference
    const std::vector<PatternPoint>& points = pattern.members[i].points;
    const std::size_t per_crown = points.size() / 18;
    double half_widths = 0;
    for (std::size_t c = 0; c < 9; ++c) {
      half_widths +=
          ring.radius * (points[(c + 1) * per_crown].angle - points[c * per_crown].angle);
      EXPECT_NEAR(points[2 * c * per_crown].z, ring.z + 0.5 * ring.length, 1e-12);
    }
    EXPECT_NEAR(half_widths, pi * ring.radius, 1e-12);
    EXPECT_NEAR(ring.length, design.ring_length(2 * ring.radius + 0.08), 1e-12);
    if (i > 0) {
      const double step = ring.radius - radius_before;
      EXPECT_NEAR(ring.z - z_before,
                  0.5 * (ring.length + height_before) + std::sqrt(1 - step * step), 1e-12);
    }
    height_before = ring.length, z_before = ring.z, radius_before = ring.radius;
  }
}

TEST(RingDesign, BelowCrimpedTheCrimpedPatternIsDrawnSmaller) {
  const RingDesign design(zig_zag(bent(Link::n)), ring_specification(zig_zag(bent(Link::n))));
  const Pattern crimped = design.expanded(1.1), smaller = design.expanded(0.5);
  ASSERT_EQ(crimped.members.size(), smaller.members.size());
  EXPECT_EQ(crimped.length, smaller.length);
  for (std::size_t m = 0; m < crimped.members.size(); ++m) {
    ASSERT_EQ(crimped.members[m].points.size(), smaller.members[m].points.size());
    for (std::size_t i = 0; i < crimped.members[m].points.size(); ++i) {
      const PatternPoint &a = crimped.members[m].points[i], &b = smaller.members[m].points[i];
      EXPECT_EQ(a.angle, b.angle);
      EXPECT_EQ(a.z, b.z);
      EXPECT_NEAR(b.radius, 0.21, 1e-15);
    }
  }
  EXPECT_THROW(design.expanded(0.05), std::invalid_argument);
  EXPECT_THROW(design.expanded(-1.0), std::invalid_argument);
}

TEST(RingDesign, IsDrawnByTheSamePointsAtEveryExpansion) {
  for (const auto& [name, parameters] : every_kind()) {
    Specification s = ring_specification(parameters);
    s.largest_sag = 0.02;
    const RingDesign design(parameters, s);
    const Pattern reference = design.expanded(3.0);
    for (const double d : diameters(design)) {
      const Pattern pattern = design.expanded(d);
      ASSERT_EQ(pattern.members.size(), reference.members.size()) << name;
      for (std::size_t m = 0; m < pattern.members.size(); ++m) {
        EXPECT_EQ(pattern.members[m].points.size(), reference.members[m].points.size()) << name;
      }
    }
  }
}

TEST(RingDesign, ChordsStayCloseToTheirArcs) {
  // three neighbours on an arc of radius rho, chords s: the middle one lies s^2 / (2 rho) off the
  // line through its neighbours, four times the sag of either chord
  for (const auto& [name, parameters] : every_kind()) {
    Specification s = ring_specification(parameters);
    s.largest_sag = 0.02;
    const RingDesign design(parameters, s);
    for (const double d : diameters(design)) {
      const Pattern pattern = design.expanded(d);
      const std::vector<PatternPoint>& p = pattern.members[0].points;
      for (std::size_t i = 1; i + 1 < p.size(); ++i) {
        const double r = p[i].radius;
        const Eigen::Vector2d a(r * (p[i + 1].angle - p[i - 1].angle), p[i + 1].z - p[i - 1].z);
        const Eigen::Vector2d b(r * (p[i].angle - p[i - 1].angle), p[i].z - p[i - 1].z);
        const double off = std::abs(a.x() * b.y() - a.y() * b.x()) / a.norm();
        EXPECT_LT(off, 1.2 * 4 * 0.02 * 0.08) << name << " at " << d << ", point " << i;
        const double turn = p[i + 1].angle - p[i].angle;
        EXPECT_LT(r * (1 - std::cos(0.5 * turn)), 1.2 * 0.02 * 0.08) << name << " at " << d;
      }
    }
  }
}

TEST(RingDesign, ConnectorsMoveOnAsToldFromGapToGap) {
  const auto joined = [](Connectors c, int gap) {
    RingParameters p = zig_zag(c);
    p.rings = 5;
    const RingDesign design(p, ring_specification(p));
    std::set<long> crowns;
    for (const Member& m : design.expanded(3.0).members) {
      if (m.kind == Member::Kind::connector && m.ring == gap)
        crowns.insert(std::lround(m.points.front().angle / (2 * pi / 6)));
    }
    return crowns;
  };
  EXPECT_EQ(joined(kInPhase, 0), (std::set<long>{0, 2, 4}));
  EXPECT_EQ(joined(kInPhase, 1), (std::set<long>{1, 3, 5}));
  EXPECT_EQ(joined(kInPhase, 2), (std::set<long>{0, 2, 4}));
  Connectors spiral = kInPhase;
  spiral.count = 2;
  spiral.alternate = false;
  EXPECT_EQ(joined(spiral, 0), (std::set<long>{0, 3}));
  EXPECT_EQ(joined(spiral, 1), (std::set<long>{1, 4}));
  EXPECT_EQ(joined(spiral, 2), (std::set<long>{2, 5}));
}

TEST(RingDesign, RingsAreCountedOutToTheNearestLength) {
  const RingParameters p = zig_zag(kInPhase);
  const Specification s = ring_specification(p);
  for (const double asked : {0.5, 5.0, 8.1, 12.0, 18.0, 40.0}) {
    const RingDesign design(p, s, asked);
    const double length = design.expanded(3.0).length;
    ASSERT_GE(design.rings(), 1);
    if (design.rings() > 1) {
      EXPECT_LE(std::abs(length - asked), 0.5 * 1.4 + 1e-9) << asked;
    }
  }
}

TEST(RingDesign, AllCrownsJoinedMakeClosedCells) {
  EXPECT_EQ(RingDesign(zig_zag(kFacing), ring_specification(zig_zag(kFacing))).cell(),
            Cell::closed);
  EXPECT_EQ(RingDesign(zig_zag(kInPhase), ring_specification(zig_zag(kInPhase))).cell(),
            Cell::open);
}

TEST(RingDesign, RefusesWhatNoStentCanBe) {
  const auto refused = [](const RingParameters& p, const std::string& part) {
    try {
      const RingDesign design(p, ring_specification(p));
      ADD_FAILURE() << part;
    } catch (const std::invalid_argument& error) {
      EXPECT_NE(std::string(error.what()).find(part), std::string::npos) << error.what();
    }
  };
  RingParameters p = zig_zag(kInPhase);
  p.crowns = 24;
  refused(p, "crimped diameter of at least");
  p = zig_zag(kInPhase);
  p.straight_length = p.crown_arc = 0;
  refused(p, "positive straight length");
  p = zig_zag(bent(Link::n));
  p.connectors.length = 0.4;
  refused(p, "cannot span");
  p = zig_zag(bent(Link::n));
  p.connectors.span = 0.1;
  refused(p, "rings would touch");
  p = zig_zag(kInPhase);
  p.connectors.absorption = 1;
  refused(p, "cannot absorb");
  p = zig_zag(kInPhase);
  p.connectors.count = 7;
  refused(p, "connectors per gap");
  p = zig_zag(kInPhase);
  p.straight_length = 0.1;
  refused(p, "more than the design's largest");
}

TEST(RingDesign, CurvedTapersNameConnectorsThatCannotReach) {
  const RingDesign design(zig_zag(kFacing), ring_specification(zig_zag(kFacing)));
  EXPECT_THROW(design.expanded([](double share) { return share < 0.3 ? 0.6 : 2.0; }),
               std::invalid_argument);
}

TEST(ZStent, IsASequenceOfBodiesOnBars) {
  const ZParameters z{
      .crowns = 8, .bodies = 3, .straight_length = 21, .crown_arc = 1.1, .pitch = 25, .bars = 4};
  Specification s = finely_drawn(*find_preset("zstent"));
  s.pattern = z;
  const auto design = make_design(s);
  for (const double d : {4.6, 15.0, 40.0}) {
    const Pattern pattern = design->expanded(d);
    ASSERT_EQ(pattern.rings.size(), 3u);
    EXPECT_NEAR(pattern.rings[1].z - pattern.rings[0].z, 25, 1e-12);
    for (const Member& m : pattern.members) {
      EXPECT_NEAR(arc_length(m) / (m.kind == Member::Kind::strut ? 16 * 23.2 : 25), 1, kConserved);
    }
  }
}

}  // namespace
}  // namespace vstent::stents
