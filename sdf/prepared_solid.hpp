// A solid's segments and struts with their constants worked out once, for the evaluators inside
// this folder that visit them many times.
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
  double smallest_radius() const { return sine >= 0 ? radius_at(length) : radius; }
};

/// A strut as a sharp-edged core that a ball of the edge radius sweeps. With rho the distance of x
/// from the axis as seen along the normal and v its height along it, q = (rho - half_width, |v| -
/// half_thickness): d = |max(q, 0)| + min(max(q), 0) - edge_radius.
struct PreparedStrut {
  Vec3 a = Vec3::Zero();
  Vec3 axis = Vec3::Zero();  ///< unit, or zero for a round plate
  Vec3 normal = Vec3::UnitZ();
  double length = 0;
  double half_width = 0, half_thickness = 0;  ///< of the core, mm
  double edge_radius = 0;

  /// Of the thinnest capsule around it.
  double outer_radius() const;
};

PreparedSegment prepare(const Segment& segment, Joints joints);
PreparedStrut prepare(const Strut& strut);

/// Signed distance to one segment, cut by its caps. |x - segment's axis| - largest_radius() is
/// never above the least distance over a tube's segments.
Sample distance_to(const PreparedSegment& segment, std::span<const EndCap> caps, Joints joints,
                   const Vec3& x);
/// And to the same segment without its caps: of a convex solid, so a convex function.
Sample uncut_distance_to(const PreparedSegment& segment, const Vec3& x);
Sample distance_to(const PreparedStrut& strut, const Vec3& x);

/// All pieces of a solid, numbered: its segments, then its struts.
class PreparedSolid {
 public:
  /// \throws std::invalid_argument as check() does
  explicit PreparedSolid(const Solid& solid);

  int size() const { return static_cast<int>(segments_.size() + struts_.size()); }
  bool is_strut(int piece) const { return piece >= static_cast<int>(segments_.size()); }
  const PreparedSegment& segment(int piece) const {
    return segments_[static_cast<std::size_t>(piece)];
  }
  const PreparedStrut& strut(int piece) const {
    return struts_[static_cast<std::size_t>(piece) - segments_.size()];
  }
  /// Of the thinnest round cone around the piece.
  double outer_radius(int piece) const {
    return is_strut(piece) ? strut(piece).outer_radius() : segment(piece).largest_radius();
  }
  Sample distance(int piece, const Vec3& x) const {
    return is_strut(piece) ? distance_to(strut(piece), x)
                           : distance_to(segment(piece), caps_, joints_, x);
  }
  bool is_cut(int piece) const {
    return !is_strut(piece) && joints_ == Joints::round &&
           (segment(piece).start_cap >= 0 || segment(piece).end_cap >= 0);
  }
  Sample uncut_distance(int piece, const Vec3& x) const {
    return is_cut(piece) ? uncut_distance_to(segment(piece), x) : distance(piece, x);
  }
  /// Of a known bend: see smallest_bend.
  bool is_convex(int piece) const {
    return is_strut(piece) || (joints_ == Joints::round && !is_cut(piece));
  }
  /// Where its distance to x is d, it bends no more than that of a ball of radius d + smallest_bend
  /// does, if that is positive.
  double smallest_bend(int piece) const {
    return is_strut(piece) ? strut(piece).edge_radius : segment(piece).smallest_radius();
  }
  /// Unit, or zero where the piece has no length.
  const Vec3& axis(int piece) const {
    return is_strut(piece) ? strut(piece).axis : segment(piece).axis;
  }
  std::pair<Vec3, Vec3> ends(int piece) const {
    const auto of = [](const auto& p) { return std::pair(p.a, Vec3(p.a + p.length * p.axis)); };
    return is_strut(piece) ? of(strut(piece)) : of(segment(piece));
  }
  std::span<const EndCap> caps() const { return caps_; }
  Joints joints() const { return joints_; }

 private:
  std::vector<PreparedSegment> segments_;
  std::vector<PreparedStrut> struts_;
  std::vector<EndCap> caps_;
  Joints joints_;
};

/// \throws std::invalid_argument neither segment nor strut; of a segment, a coordinate or radius
/// that is not finite, a negative radius, a cap that does not exist, or a flat-capped cylinder
/// without a direction; of a strut, a coordinate that is not finite, a width or thickness that is
/// not positive, edges rounder than half of either, or a normal that is not unit and perpendicular;
/// says which one
void check(const Solid& solid);

}  // namespace vstent::sdf
