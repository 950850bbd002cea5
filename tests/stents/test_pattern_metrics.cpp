#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <random>

#include "stents/braid_design.hpp"
#include "stents/pattern_metrics.hpp"

namespace vstent::stents {
namespace {

constexpr double pi = std::numbers::pi;

/// Wires that do not weave: straight lines on the unrolled cylinder.
Pattern lattice(double radius, int n, double angle, int rows, double wire, double turned = 0) {
  Pattern pattern;
  pattern.section = {true, wire, wire, 0.5 * wire};
  const double turn = pi / n, height = turn * radius / std::tan(angle);
  for (const int way : {1, -1})
    for (int j = 0; j < n; ++j) {
      Member member;
      member.kind = Member::Kind::wire;
      for (int i = 0; i <= rows; ++i)
        member.points.push_back(
            {radius, way * i * turn + 2 * turn * j + turned, 0.5 * wire + i * height});
      pattern.members.push_back(member);
    }
  pattern.length = rows * height + wire;
  return pattern;
}

/// Flat rings, circles around the axis, joined by bars.
Pattern ladder(double radius, int rings, double pitch, int bars, double wire) {
  Pattern pattern;
  pattern.section = {true, wire, wire, 0.5 * wire};
  for (int ring = 0; ring < rings; ++ring) {
    Member member;
    member.closed = true;
    member.ring = ring;
    for (int i = 0; i < 60; ++i)
      member.points.push_back({radius, 2 * pi * i / 60, 0.5 * wire + ring * pitch});
    pattern.members.push_back(member);
    if (ring == 0) continue;
    for (int b = 0; b < bars; ++b) {
      Member bar{Member::Kind::connector, false, ring - 1, ring, {}};
      bar.points = {{radius, 2 * pi * b / bars, 0.5 * wire + (ring - 1) * pitch},
                    {radius, 2 * pi * b / bars, 0.5 * wire + ring * pitch}};
      pattern.members.push_back(bar);
    }
  }
  pattern.length = (rings - 1) * pitch + wire;
  return pattern;
}

// Free cell (p - d)^2 / sin 2a, circle p - d, with the perpendicular spacing p = 2 pi R cos a / n;
// cover 1 - (1 - d/p)^2 and pores sin 2a / p^2 between the end rows.
TEST(Metrics, OfALatticeAreItsClosedForms) {
  for (const double angle : {0.6, 0.9, 1.15}) {
    const double radius = 4, wire = 0.13;
    const int n = 12, rows = 30;
    const Pattern pattern = lattice(radius, n, angle, rows, wire);
    const PatternMetrics m = measure(pattern);
    const double p = 2 * pi * radius * std::cos(angle) / n;
    const double area = (p - wire) * (p - wire) / std::sin(2 * angle);
    // The bound of the header: pixel / 8 on the edge of a cell, four sides of p / sin 2a.
    const double off = m.pixel / 8 * 4 * p / std::sin(2 * angle);
    EXPECT_EQ(m.cells.size(), static_cast<std::size_t>(n * (rows - 1)));
    EXPECT_NEAR(m.median_cell, area, off);
    EXPECT_NEAR(m.smallest_cell, area, off);
    EXPECT_NEAR(m.largest_cell, area, off);
    EXPECT_NEAR(m.mean_cell, area, 0.1 * off);
    EXPECT_NEAR(m.largest_circle, p - wire, 1e-3 * m.pixel);
    for (const MeshCell& cell : m.cells) EXPECT_NEAR(cell.circle, p - wire, 1e-3 * m.pixel);
    // The margins of half a wire beyond the end rows hold little metal.
    const double margin = wire / pattern.length;
    EXPECT_NEAR(m.metal_to_artery, 1 - std::pow(1 - wire / p, 2), margin);
    EXPECT_NEAR(m.pores_per_mm2, std::sin(2 * angle) / (p * p),
                margin * std::sin(2 * angle) / (p * p));
    EXPECT_EQ(m.struts, 2 * n * rows);
    EXPECT_EQ(m.crossings, n * (rows + 1));
    EXPECT_EQ(m.crowns, 0);
    EXPECT_EQ(m.connectors, 0);
    EXPECT_NEAR(m.radius, radius, 1e-12);
  }
}

TEST(Metrics, OfALadderAreItsClosedForms) {
  const double radius = 3, pitch = 2, wire = 0.2;
  const int rings = 5, bars = 6;
  const PatternMetrics m = measure(ladder(radius, rings, pitch, bars, wire));
  const double around = 2 * pi * radius / bars;
  const double cell = (around - wire) * (pitch - wire);
  EXPECT_EQ(m.cells.size(), static_cast<std::size_t>((rings - 1) * bars));
  EXPECT_NEAR(m.smallest_cell, cell, m.pixel / 8 * 2 * (around + pitch));
  EXPECT_NEAR(m.largest_cell, cell, m.pixel / 8 * 2 * (around + pitch));
  EXPECT_NEAR(m.largest_circle, pitch - wire, 1e-3 * m.pixel);
  const double wall = 2 * pi * radius * ((rings - 1) * pitch + wire);
  EXPECT_NEAR(m.metal_to_artery, 1 - (rings - 1) * bars * cell / wall, 1e-3);
  EXPECT_EQ(m.connectors, (rings - 1) * bars);
}

// Halving pixels quarters the error, on average over cells that lie differently on the raster.
TEST(Metrics, ConvergeWithTheSquareOfThePixel) {
  const double angle = 0.83, radius = 2, wire = 0.2;
  const Pattern pattern = lattice(radius, 7, angle, 9, wire);
  const double p = 2 * pi * radius * std::cos(angle) / 7;
  const double area = (p - wire) * (p - wire) / std::sin(2 * angle);
  const auto error = [&](double pixel) {
    const PatternMetrics m = measure(pattern, pixel);
    double sum = 0;
    for (const MeshCell& cell : m.cells) sum += std::pow(cell.area - area, 2);
    return std::sqrt(sum / static_cast<double>(m.cells.size())) / area;
  };
  const double coarse = error(wire / 4), fine = error(wire / 16);
  EXPECT_LT(coarse, 2e-3);
  EXPECT_LT(fine, 0.15 * coarse);
}

TEST(Metrics, DoNotChangeWhenThePatternTurns) {
  const PatternMetrics a = measure(lattice(2, 7, 0.83, 9, 0.2, 0));
  for (const double turned : {0.1234, 3.0, -7.7}) {
    const PatternMetrics b = measure(lattice(2, 7, 0.83, 9, 0.2, turned));
    EXPECT_EQ(a.cells.size(), b.cells.size());
    EXPECT_NEAR(a.median_cell, b.median_cell, 2e-3 * a.median_cell);
    EXPECT_NEAR(a.metal_to_artery, b.metal_to_artery, 1e-3 * a.metal_to_artery);
    EXPECT_NEAR(a.largest_circle, b.largest_circle, 1e-3 * a.pixel);
    EXPECT_EQ(a.struts, b.struts);
  }
}

// Wires at uneven spacings make cells of many sizes: their largest circle against a search of the
// whole wall at a quarter of the pixel, by every wire.
TEST(Metrics, FindTheLargestCircleOfUnevenCells) {
  Pattern pattern = lattice(2, 7, 0.83, 9, 0.2);
  std::mt19937 random(11);
  std::uniform_real_distribution<double> shift(-0.12, 0.12);
  for (Member& member : pattern.members) {
    const double by = shift(random);
    for (PatternPoint& p : member.points) p.angle += by;
  }
  const PatternMetrics m = measure(pattern);
  double widest = 0;
  const double step = 0.25 * m.pixel;
  // Cells that are closed lie between the third row of crossings and the third-last.
  double low = 1e9, high = 0;
  for (const MeshCell& cell : m.cells) {
    low = std::min(low, cell.z);
    high = std::max(high, cell.z);
  }
  for (double z = low; z <= high; z += step)
    for (double x = 0; x < 2 * pi * 2; x += step) {
      double nearest = 1e9;
      for (const Member& member : pattern.members) {
        const PatternPoint &a = member.points.front(), &b = member.points.back();
        const double slope = (b.angle - a.angle) / (b.z - a.z);
        const double aside = std::remainder(x / 2 - a.angle - slope * (z - a.z), 2 * pi) * 2;
        nearest = std::min(nearest, std::abs(aside) / std::hypot(1, 2 * slope));
        if (nearest < 0.5 * widest) break;
      }
      widest = std::max(widest, 2 * nearest - 0.2);
    }
  EXPECT_GT(m.cells.back().area, 1.5 * m.cells.front().area);
  EXPECT_LE(widest, m.largest_circle + 1e-9);
  EXPECT_GE(widest, m.largest_circle - 2 * step);
}

TEST(Metrics, CountWhatIsThere) {
  // A zig-zag ring of 6 crowns: 12 struts, 12 crowns with the proximal ones, no cell.
  Pattern pattern;
  pattern.section = {true, 0.1, 0.1, 0.05};
  Member ring;
  ring.closed = true;
  ring.ring = 0;
  for (int k = 0; k < 12; ++k)
    for (int i = 0; i < 5; ++i) {
      const double t = i / 5.0, low = k % 2 == 0 ? 0.05 : 1.05, high = 1.1 - low;
      ring.points.push_back({2, (k + t) * pi / 6, (1 - t) * low + t * high});
    }
  pattern.members = {ring};
  pattern.rings = {{0.55, 1, 2}};
  pattern.length = 1.1;
  const PatternMetrics m = measure(pattern);
  EXPECT_EQ(m.struts, 12);
  EXPECT_EQ(m.crowns, 12);
  EXPECT_TRUE(m.cells.empty());
  EXPECT_EQ(m.pores_per_mm2, 0);
  EXPECT_THROW(measure(pattern, 0.05), std::invalid_argument);
  EXPECT_THROW(measure(Pattern{}), std::invalid_argument);
}

BraidDesign braid(int n, int over, double angle, double wire, double outer, double length) {
  Specification s;
  s.section = {true, wire, wire, 0.5 * wire};
  s.nominal_diameter = outer;
  s.nominal_length = length;
  s.crimped_diameter = 0.3 * outer;
  return {BraidParameters{n, over, angle, 0}, s, std::nullopt};
}

// The carotid Wallstent's free cells were measured at 1.08 mm2 (PMID 22078854); EndoBeams.jl's
// preset of it (24 wires of 0.13 mm at R = 4 mm) gives 22.8 % of cover.
TEST(Metrics, OfAWallstentAreThePublishedOnes) {
  const PatternMetrics m =
      measure(braid(12, 1, 59.3, 0.13, 8.26, 12).expanded([](double) { return 4.13; }));
  EXPECT_GE(m.median_cell, 1.0);
  EXPECT_LE(m.median_cell, 1.1);
  EXPECT_NEAR(m.metal_to_artery, 0.228, 0.005);
}

// Flow diverters of 48 wires covering 30 to 35 % have 12.5 to 20 pores per mm2 (Babiker).
TEST(Metrics, OfFlowDivertersAreThePublishedOnes) {
  for (const auto& [diameter, angle] : std::vector<std::pair<double, double>>{{4, 69.5}, {5, 74}}) {
    const PatternMetrics m =
        measure(braid(24, 2, angle, 0.03, diameter + 0.06, 2).expanded([d = diameter](double) {
          return 0.5 * d + 0.03;
        }));
    EXPECT_GE(m.metal_to_artery, 0.29) << diameter;
    EXPECT_LE(m.metal_to_artery, 0.355) << diameter;
    EXPECT_GE(m.pores_per_mm2, 12.5) << diameter;
    EXPECT_LE(m.pores_per_mm2, 20) << diameter;
  }
}

TEST(Metrics, OfTaperedPatternsUseTheRadiusOfEachPlace) {
  // Cells of a lattice on a cone grow in proportion to the radius around, and not along.
  Pattern pattern = ladder(2, 9, 1.0, 8, 0.08);
  for (Member& member : pattern.members)
    for (PatternPoint& p : member.points) p.radius = 2 + 0.125 * p.z;
  const PatternMetrics m = measure(pattern);
  ASSERT_EQ(m.cells.size(), 64u);
  for (const MeshCell& cell : m.cells) {
    // Area between rings at z0 and z0 + 1: the wall's mean width there less the bar's.
    const double z0 = 0.04 + std::floor(cell.z - 0.04);
    const double width = 2 * pi * (2 + 0.125 * (z0 + 0.5)) / 8 - 0.08;
    EXPECT_NEAR(cell.area, width * 0.92, 0.02);
  }
}

}  // namespace
}  // namespace vstent::stents
