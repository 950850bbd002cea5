// A straight stent at one expansion, strut by strut: what a design gives, and what placement bends
// onto an axis.
#pragma once

#include <vector>

#include "sdf/geometry.hpp"

namespace vstent::stents {

/// Round wire, or a laser-cut strut: a rectangle of `width` along the wall by `thickness` across
/// it, its edges rounded. Lengths in mm; width, thickness and twice the edge radius of a round wire
/// are its diameter.
struct CrossSection {
  bool round = true;
  double width = 0, thickness = 0, edge_radius = 0;
};

/// A point of a member's centre line in cylindrical coordinates about the stent's axis: mm, rad,
/// and mm from the proximal end.
struct PatternPoint {
  double radius = 0, angle = 0, z = 0;
};

/// One piece of metal: a ring's closed zig-zag, a connector between rings, a wire of a braid.
struct Member {
  enum class Kind { strut, connector, wire };
  Kind kind = Kind::strut;
  bool closed = false;  ///< the last point joins the first
  int ring = -1;        ///< the ring that it belongs to, or leaves as a connector; -1: none
  int next_ring = -1;   ///< connectors: the ring at which it arrives
  std::vector<PatternPoint> points;
};

/// What moves as one rigid body in an open-cell design.
struct Ring {
  double z = 0;       ///< mm, of its middle
  double length = 0;  ///< mm, between the centre lines of its opposite crowns
  double radius = 0;  ///< mm, of its centre line
};

/// Members whose ends coincide are joined there. `length` spans the metal from end to end,
/// cross-section included: the first metal is at z = 0.
struct Pattern {
  CrossSection section;
  std::vector<Member> members;
  std::vector<Ring> rings;
  double length = 0;  ///< mm
};

/// Length (mm) of a member's centre line on its cylinder, the angles unrolled, between its points.
double arc_length(const Member& member);

}  // namespace vstent::stents
