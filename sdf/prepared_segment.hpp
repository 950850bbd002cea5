// A segment with its constants worked out once, for the evaluators inside this folder that visit it
// many times.
#pragma once

#include <span>

#include "sdf/solid.hpp"

namespace vstent::sdf {

/// The balls of radius r(s) = radius - s sine around a + s axis, 0 <= s <= length. With t the axial
/// and rho the radial coordinate of x, the nearest ball is at s = t - rho tangent, clamped: d = |x
/// - a - s axis| - r(s).
struct PreparedSegment {
  Vec3 a = Vec3::Zero();
  Vec3 axis = Vec3::Zero();  ///< unit, or zero for a single ball
  double length = 0;         ///< 0 for a single ball
  double radius = 0;         ///< at a; of a single ball, the larger of the two
  double sine = 0;           ///< of the half angle by which the cone narrows towards b
  double tangent = 0;
  int start_cap = -1, end_cap = -1;

  double radius_at(double s) const { return radius - s * sine; }
  double largest_radius() const { return sine >= 0 ? radius : radius_at(length); }
};

PreparedSegment prepare(const Segment& segment, Joints joints);

/// Signed distance to one segment, cut by its caps. |x - segment's axis| - largest_radius() is
/// never above the least distance over a tube's segments.
Sample distance_to(const PreparedSegment& segment, std::span<const EndCap> caps, Joints joints,
                   const Vec3& x);

/// \throws std::invalid_argument no segment, a coordinate or radius that is not finite, a negative
/// radius, a cap that does not exist, or a flat-capped cylinder without a direction; says which
/// segment
void check(const Solid& solid);

/// Box of the segment's axis, without its radius.
Box axis_box(const Segment& segment);

}  // namespace vstent::sdf
