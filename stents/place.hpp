// A straight pattern bent onto the axis of a vessel.
#pragma once

#include <utility>
#include <vector>

#include "stents/axis.hpp"
#include "stents/pattern.hpp"

namespace vstent::stents {

/// How a pattern follows a bend.
/// rigid_rings: each ring stays rigid in the frame at its middle, connectors are solved anew
/// between their ends (open cells). conforming: struts keep their length and cells shear, outer
/// cells longer and narrower, until a strut would have to be longer than it is (closed cells).
/// affine: every point follows the frame of its own place, struts stretch; for pictures.
enum class Bending { rigid_rings, conforming, affine };

/// A member on the bent axis.
struct PlacedMember {
  Member::Kind kind = Member::Kind::strut;
  bool closed = false;
  int ring = -1, next_ring = -1;
  Polyline points;            ///< mm, of its centre line
  std::vector<Vec3> outward;  ///< unit, away from the axis, per point
};

struct PlacedStent {
  CrossSection section;
  std::vector<PlacedMember> members;
  std::vector<std::pair<int, int>>
      overlapping_rings;            ///< whose metal meets on the inside of a bend
  double largest_strut_strain = 0;  ///< change of length over length, of any piece between crowns,
                                    ///< welds and crossings
  double largest_connector_strain = 0;  ///< and of any connector
  double largest_gap = 0;  ///< mm, by which metal that is joined comes apart: welds of rigid rings
};

/// An axis with its frames, and the arc length of each point.
struct AxisWithFrames {
  Polyline points;
  std::vector<double> arc;
  std::vector<Frame> frames;
};

/// Frames carried from `start_normal` (made perpendicular to the first tangent), so that the
/// stent does not spin when the axis changes a little.
AxisWithFrames with_frames(Polyline axis, const Vec3& start_normal);

/// The tightest bend radius (mm, of the axis) that conforming cells can follow at this expansion;
/// 0 where any can.
double tightest_bend(const Pattern& pattern);

/// The pattern with its z = 0 at arc length `start` (mm) of the axis; the axis is continued
/// straight where the pattern reaches beyond it.
/// \throws std::invalid_argument conforming cells on a bend too tight for their struts, naming the
/// tightest bend radius (mm) that they can follow; a radius of the axis below the stent's own
PlacedStent place(const Pattern& pattern, const AxisWithFrames& axis, double start,
                  Bending bending);

}  // namespace vstent::stents
