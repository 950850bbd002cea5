// What the deployment did, measured on the geometry that was written, never taken from the solver.
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <optional>

#include "measure/strut_metrics.hpp"
#include "sdf/solid.hpp"
#include "vessels/sections.hpp"
#include "vessels/surface.hpp"

namespace vstent::measure {

/// What to hold the written surface against. Lengths in mm.
struct Comparison {
  Polyline axis_before;               ///< of the stent's place, before straightening
  Polyline axis_after;                ///< of the stent
  std::vector<double> target;         ///< nominal lumen diameter per axis point
  double reference_diameter = 0;      ///< 0: unknown
  sdf::Solid stent;                   ///< its outer surface
  std::vector<char> movable;          ///< per mesh vertex
  std::vector<char> patch_triangles;  ///< per mesh triangle
};

/// The lumen at one place of the stented length.
struct Station {
  double arc_length = 0;  ///< from the stent's proximal end, mm
  double target = 0;      ///< mm
  std::optional<vessels::Section> before, after;
};

struct Metrics {
  std::vector<Station> stations;
  double narrowest_before = 0, narrowest_after = 0;  ///< equivalent diameter, mm
  /// Where the lumen was narrower than its target: mean equivalent diameter over target, smallest
  /// diameter of any direction (mm), and the share of the stented length that is so.
  double opened_mean_over_target = 0, opened_min_diameter = 0, opened_share = 0;
  std::optional<double> stenosis_before, stenosis_after;  ///< % of the reference diameter
  double bend_before = 0, bend_after = 0;  ///< deg, between the end tangents of the stented axis
  double lumen_bend_after = 0;             ///< deg, the same of the lumen's own section centroids
  double deepest_penetration = 0;   ///< mm, of any wall vertex into the stent's outer surface
  double largest_displacement = 0;  ///< mm
  std::size_t moved_vertices = 0, changed_outside_patch = 0;
  std::size_t inverted_triangles = 0;  ///< normals that turned by more than 90 degrees
  std::size_t self_intersections_before = 0,
              new_self_intersections = 0;  ///< pairs with a triangle of the patch
  bool closed_before = false, closed_after = false;
  std::size_t openings_before = 0, openings_after = 0;
  std::size_t non_manifold_edges_after = 0;
  std::optional<StrutMetrics> struts;  ///< nothing for a smooth tube
};

/// \throws Error (geometry) when the two surfaces do not have the same vertices and triangles
Metrics measure(const vessels::Surface& before, const vessels::Surface& after,
                const Comparison& comparison);

nlohmann::ordered_json to_json(const Metrics& metrics);

}  // namespace vstent::measure
