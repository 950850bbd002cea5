// Generated vessels: stenosed tubes along a straight or curved axis, as in the paper's Figure 4.
#pragma once

#include "sdf/geometry.hpp"

namespace vstent::vessels {

/// A tube whose axis is straight, turns through an arc, and is straight again; with a cosine-shaped
/// narrowing in the middle. Lengths in mm.
struct IdealisedVessel {
  double radius = 5;
  double length = 60;           ///< of the axis
  double bend_angle = 0;        ///< rad turned over the middle half of the axis; 0: straight
  double stenosis = 0.5;        ///< share of the diameter lost at the tightest place
  double stenosis_length = 20;  ///< over which the narrowing extends
  double eccentricity = 0;      ///< 0 concentric .. 1: all of the narrowing comes from one side
  double edge_length = 0.5;     ///< target, of near-equilateral triangles
};

/// An open, outward oriented tube of staggered rings; the axis lies in the x-z plane and starts at
/// the origin along z. \throws std::invalid_argument for values that make no vessel
TriangleMesh idealised_vessel(const IdealisedVessel& vessel);

/// Its axis, at `spacing` (mm) or closer.
Polyline idealised_axis(const IdealisedVessel& vessel, double spacing);

/// Its lumen radius (mm) at arc length s, without eccentricity.
double idealised_radius(const IdealisedVessel& vessel, double s);

}  // namespace vstent::vessels
