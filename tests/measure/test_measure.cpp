// Measures against closed forms, on generated vessels.
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "measure/measure.hpp"
#include "sdf/polyline.hpp"
#include "vessels/idealised.hpp"

namespace vstent::measure {
namespace {

vessels::IdealisedVessel tube(double radius) {
  vessels::IdealisedVessel vessel;
  vessel.radius = radius;
  vessel.stenosis = 0;
  vessel.length = 40;
  return vessel;
}

Comparison comparison_for(const vessels::Surface& surface, const Polyline& axis, double target) {
  Comparison comparison;
  comparison.axis_before = comparison.axis_after = axis;
  comparison.target.assign(axis.size(), target);
  comparison.reference_diameter = target;
  comparison.stent = sdf::make_tube(axis, std::vector<double>(axis.size(), 0.5 * target));
  comparison.movable.assign(surface.mesh.points.size(), 1);
  comparison.patch_triangles.assign(surface.mesh.triangles.size(), 1);
  return comparison;
}

Polyline middle(const vessels::IdealisedVessel& vessel, double from, double to) {
  return resample(vessels::idealised_axis(vessel, 0.1), from, to, 0.5);
}

TEST(Measure, NothingMovedGivesZeros) {
  const auto vessel = tube(5);
  const vessels::Surface surface = vessels::make_surface(vessels::idealised_vessel(vessel), "tube");
  const Metrics m = measure(surface, surface, comparison_for(surface, middle(vessel, 10, 30), 10));
  EXPECT_EQ(m.moved_vertices, 0u);
  EXPECT_EQ(m.largest_displacement, 0);
  EXPECT_EQ(m.inverted_triangles, 0u);
  EXPECT_EQ(m.new_self_intersections, 0u);
  EXPECT_EQ(m.openings_before, 2u);
  EXPECT_EQ(m.narrowest_before, m.narrowest_after);
  EXPECT_FALSE(m.closed_after);
}

// A cut through a tube of n facets is a polygon between the inscribed n-gon and the circle: its
// area falls short of the circle's by at most a factor sin(2 pi/n) / (2 pi/n) for a cut through
// vertices; staggered rows add 2n corners between.
TEST(Measure, TubeDiametersBeforeAndAfterAConcentricExpansion) {
  const vessels::Surface before =
      vessels::make_surface(vessels::idealised_vessel(tube(5)), "before");
  TriangleMesh mesh = before.mesh;
  for (Vec3& p : mesh.points) p.head<2>() *= 6.0 / 5.0;
  const vessels::Surface after = vessels::make_surface(mesh, "after");
  const Polyline axis = middle(tube(5), 10, 30);
  const Metrics m = measure(before, after, comparison_for(before, axis, 12));
  const double n = std::round(2 * std::numbers::pi * 5 / 0.5);
  const double chord = 2 * std::numbers::pi / n;
  const double shortfall = 1 - std::sqrt(std::sin(chord) / chord);
  EXPECT_NEAR(m.narrowest_before, 10, 10 * shortfall + 1e-9);
  EXPECT_NEAR(m.narrowest_after, 12, 12 * shortfall + 1e-9);
  EXPECT_NEAR(m.opened_mean_over_target, 1, shortfall + 1e-9);
  EXPECT_NEAR(m.largest_displacement, 1, 1e-9);
  EXPECT_NEAR(*m.stenosis_before, 100.0 * (1 - 10.0 / 12), 100 * shortfall);
  EXPECT_EQ(m.moved_vertices, before.mesh.points.size());
  EXPECT_EQ(m.inverted_triangles, 0u);
}

TEST(Measure, SeesInvertedTrianglesCrossingsAndStrays) {
  const auto vessel = tube(5);
  const vessels::Surface before =
      vessels::make_surface(vessels::idealised_vessel(vessel), "before");
  TriangleMesh mesh = before.mesh;
  std::size_t victim = 0;
  for (std::size_t v = 0; v < mesh.points.size(); ++v) {
    if (std::abs(mesh.points[v].z() - 20) < std::abs(mesh.points[victim].z() - 20)) victim = v;
  }
  mesh.points[victim].head<2>() *= -1.3;  // through the lumen and out of the other side
  const vessels::Surface after = vessels::make_surface(mesh, "after");
  Comparison comparison = comparison_for(before, middle(vessel, 10, 30), 10);
  comparison.movable[victim] = 0;
  const Metrics m = measure(before, after, comparison);
  EXPECT_GT(m.new_self_intersections, 0u);
  EXPECT_EQ(m.moved_vertices, 1u);
  EXPECT_EQ(m.changed_outside_patch, 1u);
}

TEST(Measure, StenosisOfTheIdealVesselIsWhatItWasMadeWith) {
  vessels::IdealisedVessel vessel;
  vessel.stenosis = 0.6;
  const vessels::Surface surface =
      vessels::make_surface(vessels::idealised_vessel(vessel), "stenosed");
  const Metrics m = measure(surface, surface, comparison_for(surface, middle(vessel, 20, 40), 10));
  EXPECT_NEAR(*m.stenosis_before, 60,
              0.5);  // percent; the section halfway along an edge row is up to 0.3 % wider
}

}  // namespace
}  // namespace vstent::measure
