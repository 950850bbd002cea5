#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <random>

#include "sdf/polyline.hpp"
#include "stents/bent_tube.hpp"
#include "stents/place.hpp"
#include "stents/strut_network.hpp"

namespace vstent::stents {
namespace {

constexpr double pi = std::numbers::pi;

/// Rings of straight struts of length l, N crowns each, their crowns facing, `gap` mm apart and
/// joined there by straight connectors (welded where gap is 0).
Pattern closed_cells(double radius, int crowns, double strut, int rings, double gap,
                     int pieces = 4) {
  Pattern pattern;
  pattern.section = {true, 0.1, 0.1, 0.05};
  const double width = pi / crowns;
  const double height = std::sqrt(strut * strut - std::pow(radius * width, 2));
  const double pitch = height + gap;
  for (int ring = 0; ring < rings; ++ring) {
    Member member;
    member.closed = true;
    member.ring = ring;
    const double low = 0.05 + ring * pitch;
    const auto level = [&](int k) { return (k + ring) % 2 == 0 ? low : low + height; };
    for (int k = 0; k < 2 * crowns; ++k)
      for (int i = 0; i < pieces; ++i) {
        const double t = static_cast<double>(i) / pieces;
        member.points.push_back({radius, (k + t) * width, (1 - t) * level(k) + t * level(k + 1)});
      }
    pattern.members.push_back(member);
    pattern.rings.push_back({low + 0.5 * height, height, radius});
    if (gap == 0 || ring + 1 == rings) continue;
    for (int k = 0; k < 2 * crowns; ++k)
      if ((k + ring) % 2 != 0) {
        Member link{Member::Kind::connector, false, ring, ring + 1, {}};
        link.points = {{radius, k * width, low + height}, {radius, k * width, low + pitch}};
        pattern.members.push_back(link);
      }
  }
  pattern.length = 0.1 + rings * pitch - gap;
  return pattern;
}

/// In-phase rings joined crown to crown's valley by `links` connectors with a half circle in them.
Pattern open_cells(double radius, int crowns, double strut, int rings, double pitch, int links,
                   double bulge) {
  Pattern pattern = closed_cells(radius, crowns, strut, 1, 0);
  const Member first = pattern.members[0];
  const Ring first_ring = pattern.rings[0];
  const double width = pi / crowns;
  for (int ring = 1; ring < rings; ++ring) {
    Member member = first;
    member.ring = ring;
    for (PatternPoint& p : member.points) p.z += ring * pitch;
    pattern.members.push_back(member);
    pattern.rings.push_back(first_ring);
    pattern.rings.back().z += ring * pitch;
  }
  for (int ring = 0; ring + 1 < rings; ++ring)
    for (int i = 0; i < links; ++i) {
      const double angle = 2 * width * i * crowns / links;
      Member link{Member::Kind::connector, false, ring, ring + 1, {}};
      for (int j = 0; j <= 20; ++j) {
        const double t = j / 20.0;
        link.points.push_back(
            {radius, angle + bulge * std::sin(pi * t) / radius, 0.05 + (ring + t) * pitch});
      }
      pattern.members.push_back(link);
    }
  pattern.length = first_ring.length + 0.1 + (rings - 1) * pitch;
  return pattern;
}

/// n wires each way, crossing in rows; `weave` mm over and under.
Pattern lattice(double radius, int n, double angle, int rows, double weave, int pieces = 6) {
  Pattern pattern;
  pattern.section = {true, 0.1, 0.1, 0.05};
  const double turn = pi / n;
  const double height = turn * radius / std::tan(angle);
  for (const int way : {1, -1})
    for (int j = 0; j < n; ++j) {
      Member wire;
      wire.kind = Member::Kind::wire;
      for (int i = 0; i <= rows * pieces; ++i) {
        const double u = static_cast<double>(i) / pieces;
        wire.points.push_back({radius + way * weave * std::cos(pi * u),
                               way * u * turn + 2 * turn * j, 0.05 + u * height});
      }
      pattern.members.push_back(wire);
    }
  pattern.length = rows * height + 0.1;
  return pattern;
}

Polyline circle(double bend_radius, double angle, int pieces) {
  Polyline line;
  for (int i = 0; i <= pieces; ++i) {
    const double a = angle * i / pieces;
    line.emplace_back(bend_radius * (1 - std::cos(a)), 0, bend_radius * std::sin(a));
  }
  return line;
}

/// An S with torsion, whose smallest bend radius is about 12 mm.
Polyline winding(int pieces) {
  Polyline line;
  for (int i = 0; i <= pieces; ++i) {
    const double s = 30.0 * i / pieces;
    line.emplace_back(2 * std::cos(0.2 * s), 1.5 * std::sin(0.15 * s), s);
  }
  return line;
}

Polyline straight_line(double length, int pieces) {
  Polyline line;
  for (int i = 0; i <= pieces; ++i) line.emplace_back(0, 0, length * i / pieces);
  return line;
}

double length_of(const Polyline& points, bool closed) {
  double sum = closed ? (points.front() - points.back()).norm() : 0;
  for (std::size_t i = 1; i < points.size(); ++i) sum += (points[i] - points[i - 1]).norm();
  return sum;
}

double straight_length(const Member& member) {
  Polyline points;
  for (const PatternPoint& p : member.points) points.push_back(straight_point(p));
  return length_of(points, member.closed);
}

std::vector<Pattern> all_kinds() {
  return {closed_cells(2, 8, 1.2, 6, 0), closed_cells(2, 6, 1.4, 5, 0.4),
          open_cells(1.5, 6, 1.2, 8, 1.4, 3, 0.6), lattice(2, 8, 1.0, 20, 0.05)};
}

TEST(Place, OnAStraightAxisGivesTheStraightStent) {
  const AxisWithFrames axis = with_frames(straight_line(20, 37), Vec3::UnitX());
  for (const Pattern& pattern : all_kinds())
    for (const Bending bending : {Bending::rigid_rings, Bending::conforming, Bending::affine}) {
      const PlacedStent stent = place(pattern, axis, 2, bending);
      ASSERT_EQ(stent.members.size(), pattern.members.size());
      for (std::size_t m = 0; m < stent.members.size(); ++m)
        for (std::size_t i = 0; i < stent.members[m].points.size(); ++i) {
          const PatternPoint& p = pattern.members[m].points[i];
          EXPECT_LT((stent.members[m].points[i] - Vec3(0, 0, 2) - straight_point(p)).norm(), 1e-12);
          EXPECT_LT(
              (stent.members[m].outward[i] - Vec3(std::cos(p.angle), std::sin(p.angle), 0)).norm(),
              1e-12);
        }
      EXPECT_LT(stent.largest_strut_strain, 1e-11);
      EXPECT_LT(stent.largest_connector_strain, 1e-11);
      EXPECT_TRUE(stent.overlapping_rings.empty());
    }
}

TEST(Place, ContinuesTheAxisStraight) {
  const AxisWithFrames axis = with_frames(straight_line(4, 5), Vec3::UnitX());
  const Pattern pattern = closed_cells(2, 8, 1.2, 6, 0);
  for (const double start : {-3.0, 2.0}) {
    const PlacedStent stent = place(pattern, axis, start, Bending::affine);
    for (std::size_t i = 0; i < pattern.members.back().points.size(); ++i)
      EXPECT_LT((stent.members.back().points[i] - Vec3(0, 0, start) -
                 straight_point(pattern.members.back().points[i]))
                    .norm(),
                1e-12);
  }
}

TEST(RigidRings, AreCongruentWithTheirCentresOnTheAxis) {
  const Pattern pattern = open_cells(1.5, 6, 1.2, 8, 1.4, 3, 0.2);
  const Polyline line = circle(12, 1.5, 60);
  const AxisWithFrames axis = with_frames(line, Vec3::UnitY());
  const PlacedStent stent = place(pattern, axis, 1, Bending::rigid_rings);
  const auto arc = arc_lengths(line);
  for (std::size_t m = 0; m < 8; ++m) {
    const Polyline& points = stent.members[m].points;
    const std::vector<PatternPoint>& straight = pattern.members[m].points;
    Vec3 centre = Vec3::Zero();
    for (std::size_t i = 0; i < points.size(); ++i) {
      centre += points[i] / static_cast<double>(points.size());
      for (std::size_t j = 0; j < i; ++j)
        EXPECT_NEAR((points[i] - points[j]).norm(),
                    (straight_point(straight[i]) - straight_point(straight[j])).norm(), 1e-12);
    }
    // The curve through the axis' points leaves their chords (0.3 mm) by at most their sagitta,
    // and is that of the circle to the fourth power of their spacing.
    EXPECT_LT(std::sqrt(nearest_place(line, arc, centre).squared_distance), 0.3 * 0.3 / (8 * 12));
    EXPECT_NEAR((centre - Vec3(12, 0, 0)).norm(), 12, 1e-6);
  }
  EXPECT_LT(stent.largest_strut_strain, 1e-12);
}

// The connectors' half circles give way: a bend of 12 mm opens gaps of 1.4 mm by 1.5 / 12 of them.
TEST(RigidRings, KeepTheLengthOfCurvedConnectors) {
  const AxisWithFrames axis = with_frames(circle(12, 1.5, 60), Vec3::UnitX());
  const Pattern curved = open_cells(1.5, 6, 1.2, 8, 1.4, 3, 0.6);
  const PlacedStent stent = place(curved, axis, 1, Bending::rigid_rings);
  EXPECT_LT(stent.largest_connector_strain, 1e-9);
  // Connectors end where the rings have gone.
  const auto crown = [&](int ring) {
    return stent.members[static_cast<std::size_t>(ring)].points[0];
  };
  EXPECT_LT((stent.members[8].points.front() - crown(0)).norm(), 1e-12);
  EXPECT_LT((stent.members[8].points.back() - crown(1)).norm(), 1e-12);
}

// Between rings a pitch p apart on a bend, an attachment at angle theta moves by p kappa R
// cos(theta), less the second order; the strain is that over p.
TEST(RigidRings, StretchStraightConnectorsAsTheBendDoes) {
  const double bend = 30, radius = 1.5;
  const AxisWithFrames axis = with_frames(circle(bend, 0.6, 120), Vec3::UnitX());
  const Pattern straight = open_cells(radius, 6, 1.2, 8, 1.4, 3, 0);
  const PlacedStent stent = place(straight, axis, 1, Bending::rigid_rings);
  // Attached on the inside at 0 and to the outside at 120 degrees: |cos| at most 1.
  EXPECT_NEAR(stent.largest_connector_strain, radius / bend, 0.1 * radius / bend);
}

TEST(Affine, StretchesByCurvatureTimesRadius) {
  const double bend = 10, radius = 1.5;
  const int n = 12;
  Pattern ladder;
  ladder.section = {true, 0.1, 0.1, 0.05};
  for (int k = 0; k < n; ++k) {
    Member bar;
    for (int i = 0; i <= 50; ++i) bar.points.push_back({radius, 2 * pi * k / n, 0.2 * i});
    ladder.members.push_back(bar);
  }
  ladder.length = 10;
  const AxisWithFrames axis = with_frames(circle(bend, 1.2, 200), Vec3::UnitX());
  const PlacedStent stent = place(ladder, axis, 1, Bending::affine);
  for (int k = 0; k < n; ++k) {
    const double strain =
        length_of(stent.members[static_cast<std::size_t>(k)].points, false) / 10 - 1;
    // Chords of 0.2 mm on a bend of 10 mm: (0.2 / 10)^2 / 24 = 1.7e-5.
    EXPECT_NEAR(strain, -radius / bend * std::cos(2 * pi * k / n), 4e-5);
  }
  EXPECT_NEAR(stent.largest_strut_strain, radius / bend, 4e-5);
}

TEST(Conforming, KeepsEveryLength) {
  for (const Polyline& line : {circle(25, 1.2, 100), winding(200)}) {
    const AxisWithFrames axis = with_frames(line, Vec3(0.3, 1, 0));
    for (const Pattern& pattern : all_kinds()) {
      const PlacedStent stent = place(pattern, axis, 1, Bending::conforming);
      EXPECT_LT(stent.largest_strut_strain, 1e-9);
      EXPECT_LT(stent.largest_connector_strain, 1e-9);
      for (std::size_t m = 0; m < stent.members.size(); ++m)
        EXPECT_NEAR(length_of(stent.members[m].points, stent.members[m].closed) /
                        straight_length(pattern.members[m]),
                    1, 1e-9);
    }
  }
}

TEST(Conforming, KeepsWeldsAndCrossingsTogether) {
  const AxisWithFrames axis = with_frames(winding(200), Vec3::UnitX());
  const BentTube tube(axis, 1);
  for (const Pattern& pattern : {closed_cells(2, 8, 1.2, 6, 0), lattice(2, 8, 1.0, 20, 0.0)}) {
    const PlacedStent stent = place(pattern, axis, 1, Bending::conforming);
    int together = 0;
    for (std::size_t a = 0; a < stent.members.size(); ++a)
      for (std::size_t b = 0; b < a; ++b)
        for (std::size_t i = 0; i < pattern.members[a].points.size(); ++i)
          for (std::size_t j = 0; j < pattern.members[b].points.size(); ++j) {
            if ((straight_point(pattern.members[a].points[i]) -
                 straight_point(pattern.members[b].points[j]))
                    .norm() > 1e-9)
              continue;
            ++together;
            EXPECT_LT((stent.members[a].points[i] - stent.members[b].points[j]).norm(), 1e-9);
          }
    EXPECT_GT(together, 39);
  }
}

// On a circular bend every row's ends stay in planes through the centre of the bend.
TEST(Conforming, KeepsRowsPlanarOnACircularBend) {
  const double bend = 20;
  const AxisWithFrames axis = with_frames(circle(bend, 1.0, 200), Vec3::UnitX());
  const Pattern pattern = closed_cells(2, 8, 1.2, 6, 0);
  const PlacedStent stent = place(pattern, axis, 3, Bending::conforming);
  for (const PlacedMember& ring : stent.members)
    for (const int side : {0, 1}) {
      double least = 1e9, most = -1e9;
      for (std::size_t k = 0; k < 16; k += 2) {
        const Vec3& x = ring.points[4 * (k + static_cast<std::size_t>(side))];
        const double angle = std::atan2(x.z(), bend - x.x());
        least = std::min(least, angle);
        most = std::max(most, angle);
      }
      // The stretch changes along a strut; its middle stands for it in the rows, and the difference
      // of lengths, second order in the strut's length over the bend, is made up by the crowns.
      EXPECT_LT((most - least) * bend, 0.02);
    }
}

/// The bend, per radius of the stent, at which the outermost strut of a ring is axial, from the
/// formulas alone: X_k = sqrt(l^2 - (lambda_k h)^2), sum X_k = 2 pi R.
double feasible_height_excess(double radius, int crowns, double strut, double curvature) {
  const int n = 2 * crowns;
  std::vector<double> middle(static_cast<std::size_t>(n)), width(middle.size());
  for (int k = 0; k < n; ++k) middle[static_cast<std::size_t>(k)] = 2 * pi * k / n;
  double total = 0;
  for (int round = 0; round < 4; ++round) {
    double stretch = 0;
    for (const double angle : middle)
      stretch = std::max(stretch, 1 + curvature * radius * std::cos(angle));
    const auto sum_at = [&](double h) {
      double sum = 0;
      for (std::size_t k = 0; k < middle.size(); ++k) {
        const double lambda = 1 + curvature * radius * std::cos(middle[k]);
        width[k] = std::sqrt(std::max(0.0, strut * strut - lambda * lambda * h * h)) / radius;
        sum += width[k];
      }
      return sum;
    };
    total = sum_at(strut / stretch) - 2 * pi;
    if (total > 0) return total;
    double low = 0, high = strut / stretch;
    for (int i = 0; i < 100; ++i) {
      const double h = 0.5 * (low + high);
      (sum_at(h) > 2 * pi ? low : high) = h;
    }
    double at = 0, mean = 0;
    std::vector<double> joints;
    for (std::size_t k = 0; k < width.size(); ++k) {
      joints.push_back(at);
      mean += (at - 2 * pi * static_cast<double>(k) / n) / n;
      at += width[k];
    }
    for (std::size_t k = 0; k < width.size(); ++k)
      middle[k] = joints[k] - mean + 0.5 * width[k] - pi / n;
  }
  return total;
}

TEST(Conforming, IsInfeasibleWhereAStrutWouldBeTooShort) {
  for (const double strut : {0.7, 0.9, 1.2}) {
    // Struts in 30 pieces, whose chords are shorter than their arcs by (pi / 240)^2 / 24 = 7e-6.
    const Pattern pattern = closed_cells(1, 8, strut, 4, 0, 30);
    const double tightest = tightest_bend(pattern);
    ASSERT_GT(tightest, 1.05);
    double low = 1e-6, high = 0.95;
    for (int i = 0; i < 100; ++i) {
      const double middle = 0.5 * (low + high);
      (feasible_height_excess(1, 8, strut, middle) <= 0 ? low : high) = middle;
    }
    EXPECT_NEAR(tightest * low, 1, 5e-5) << strut;
    // The crown at angle 0 lies inside, the middle of a strut at pi / 16 does where it is turned.
    const Vec3 normal(std::cos(pi - pi / 16), std::sin(pi - pi / 16), 0);
    const auto placed = [&](double bend) {
      return place(pattern, with_frames(circle(bend, 6 / bend, 300), normal), 1,
                   Bending::conforming);
    };
    EXPECT_NO_THROW(placed(1.02 * tightest)) << strut;
    try {
      placed(0.98 * tightest);
      ADD_FAILURE() << "a bend too tight was followed";
    } catch (const std::invalid_argument& error) {
      EXPECT_NE(std::string(error.what()).find("bends of radius"), std::string::npos)
          << error.what();
    }
  }
}

TEST(Place, RefusesABendTighterThanTheStentItself) {
  const AxisWithFrames axis = with_frames(circle(1.9, 1.5, 60), Vec3::UnitX());
  EXPECT_THROW(place(closed_cells(2, 8, 1.2, 2, 0), axis, 0.2, Bending::affine),
               std::invalid_argument);
}

TEST(Place, MovesRigidlyWithTheAxis) {
  const Polyline line = winding(150);
  const Eigen::Matrix3d rotation(Eigen::AngleAxisd(1.1, Vec3(1, 2, -0.5).normalized()));
  const Vec3 shift(100, -40, 7);
  Polyline moved;
  for (const Vec3& p : line) moved.push_back(rotation * p + shift);
  const Vec3 normal(1, 0.2, 0);
  const AxisWithFrames axis = with_frames(line, normal);
  const AxisWithFrames moved_axis = with_frames(moved, rotation * normal);
  for (const Pattern& pattern : all_kinds())
    for (const Bending bending : {Bending::rigid_rings, Bending::conforming, Bending::affine}) {
      const PlacedStent a = place(pattern, axis, 1, bending);
      const PlacedStent b = place(pattern, moved_axis, 1, bending);
      for (std::size_t m = 0; m < a.members.size(); ++m)
        for (std::size_t i = 0; i < a.members[m].points.size(); ++i) {
          EXPECT_LT((rotation * a.members[m].points[i] + shift - b.members[m].points[i]).norm(),
                    1e-8);
          EXPECT_LT((rotation * a.members[m].outward[i] - b.members[m].outward[i]).norm(), 1e-8);
        }
    }
}

// A stent bent a little more moves a little: each point by at most the change of the axis there,
// and the turn of its frame times the radius. No frame spins.
TEST(Place, FollowsSmallChangesOfTheAxisSmoothly) {
  const double change = 1e-4;
  Polyline line = winding(150), other = line;
  for (std::size_t i = 0; i < other.size(); ++i) {
    const double s = static_cast<double>(i) / 150;
    other[i] += change * Vec3(std::sin(7 * s), std::cos(5 * s), 0);
  }
  for (const Pattern& pattern : all_kinds())
    for (const Bending bending : {Bending::rigid_rings, Bending::conforming, Bending::affine}) {
      const PlacedStent a = place(pattern, with_frames(line, Vec3::UnitX()), 1, bending);
      const PlacedStent b = place(pattern, with_frames(other, Vec3::UnitX()), 1, bending);
      for (std::size_t m = 0; m < a.members.size(); ++m)
        for (std::size_t i = 0; i < a.members[m].points.size(); ++i)
          EXPECT_LT((a.members[m].points[i] - b.members[m].points[i]).norm(), 10 * change);
    }
}

TEST(RigidRings, ReportRingsThatOverlapOnTheInside) {
  // Crowns of in-phase rings run alike, so a bend that closes the whole pitch (1 - kappa R) less
  // the strut's width makes them meet; facing crowns meet when it closes the gap between them.
  const Pattern pattern = closed_cells(2, 8, 1.2, 5, 0.3);
  const double pitch = pattern.rings[1].z - pattern.rings[0].z;
  const auto overlaps = [&](double bend) {
    const AxisWithFrames axis = with_frames(circle(bend, 14 / bend, 300), Vec3::UnitX());
    return place(pattern, axis, 1, Bending::rigid_rings).overlapping_rings;
  };
  // Crowns at the inside, at angle 0, are those of rings 0|1 and 2|3 or of 1|2 and 3|4. Their
  // distance is 2 (bend - R) tan(pitch / 2 bend) less the height of the ring, straight as it is.
  const double height = pattern.rings[0].length;
  const auto gap = [&](double bend) {
    const double a = 0.5 * pitch / bend;
    return 2 * ((bend - 2) * std::sin(a) - 0.5 * height * std::cos(a));
  };
  double low = 4, high = 200;
  for (int i = 0; i < 60; ++i) {
    const double bend = 0.5 * (low + high);
    (gap(bend) < pattern.section.width ? low : high) = bend;
  }
  EXPECT_TRUE(overlaps(1.01 * low).empty());
  EXPECT_FALSE(overlaps(0.99 * low).empty());
  for (const auto& [a, b] : overlaps(0.9 * low)) EXPECT_EQ(b, a + 1);
}

// Welds between rigid rings half a pitch h / 2 away on either side open on the outside of a bend:
// the ring's ends turn apart by h / bend, at the radius R.
TEST(RigidRings, ReportWeldsThatComeApart) {
  const Pattern pattern = closed_cells(2, 8, 1.2, 5, 0);
  const double bend = 40, height = pattern.rings[0].length;
  const AxisWithFrames axis = with_frames(circle(bend, 0.4, 200), Vec3::UnitX());
  const double gap = place(pattern, axis, 1, Bending::rigid_rings).largest_gap;
  EXPECT_NEAR(gap, 2 * height / bend, 0.05 * 2 * height / bend);
  EXPECT_LT(place(pattern, axis, 1, Bending::conforming).largest_gap, 1e-9);
  EXPECT_LT(place(pattern, axis, 1, Bending::affine).largest_gap, 1e-12);
}

TEST(Frames, StartWhereTheyAreTold) {
  const AxisWithFrames axis = with_frames(winding(50), Vec3(0.3, -1, 0.4));
  const Vec3 t = axis.frames[0].tangent;
  const Vec3 wanted = (Vec3(0.3, -1, 0.4) - t.dot(Vec3(0.3, -1, 0.4)) * t).normalized();
  EXPECT_LT((axis.frames[0].normal - wanted).norm(), 1e-12);
  EXPECT_THROW(with_frames(straight_line(3, 3), Vec3::UnitZ()), std::invalid_argument);
  EXPECT_THROW(with_frames({Vec3::Zero(), Vec3::Zero()}, Vec3::UnitX()), std::invalid_argument);
}

TEST(BentTube, CoordinatesInvertThePoint) {
  const AxisWithFrames axis = with_frames(winding(100), Vec3::UnitX());
  const BentTube tube(axis, 2);
  std::mt19937 random(3);
  std::uniform_real_distribution<double> uniform(0, 1);
  for (int i = 0; i < 200; ++i) {
    const PatternPoint p{0.5 + 3 * uniform(random), 20 * (uniform(random) - 0.5),
                         40 * uniform(random) - 5};
    const PatternPoint nearby{p.radius, p.angle + uniform(random) - 0.5,
                              p.z + uniform(random) - 0.5};
    const PatternPoint found = tube.coordinates(tube.point(p), nearby);
    EXPECT_NEAR(found.radius, p.radius, 1e-10);
    EXPECT_NEAR(found.angle, p.angle, 1e-10);
    EXPECT_NEAR(found.z, p.z, 1e-10);
  }
}

}  // namespace
}  // namespace vstent::stents
