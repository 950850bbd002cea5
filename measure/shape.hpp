// What became of the vessel's shape: bends, curvature, kinks at the stent's edges.
#pragma once

#include "measure/profile.hpp"

namespace vstent::measure {

/// Curvature of an axis over a length of it.
struct Curve {
  double mean = 0, largest = 0;  ///< 1/mm
  double total = 0;              ///< deg: the integral of the curvature
  double tortuosity = 0;         ///< length over chord, less 1
  double bend = 0;               ///< deg, between chords over the first and the last fifth
  /// Largest curvature (1/mm) within a lumen diameter of the proximal and the distal end.
  double proximal_edge = 0, distal_edge = 0;
};

/// Of the treated length.
struct ShapeMetrics {
  Curve curve_before, curve_after;
  double lateral_shift = 0;                            ///< mm, the axis's largest
  double lumen_bend_before = 0, lumen_bend_after = 0;  ///< deg, those of the curves
  /// deg, between the end tangents of the stent's own axis; nothing where that is not known
  std::optional<double> stent_bend_before, stent_bend_after;
  double bend_before = 0, bend_after = 0;  ///< the same as numbers, 0 where unknown
};

/// Stations in the stent count; `stent_axis_*` may be empty.
ShapeMetrics measure_shape(const Profile& profile, const Polyline& stent_axis_before,
                           const Polyline& stent_axis_after);

}  // namespace vstent::measure
