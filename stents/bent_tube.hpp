// The tube about a bent axis: where a point of a straight pattern comes to lie.
#pragma once

#include <cmath>

#include "stents/pattern.hpp"
#include "stents/place.hpp"

namespace vstent::stents {

/// The axis as a curve with continuous tangents (cubic Hermite between its points), continued
/// straight at both ends, and the cylinder coordinates about it.
class BentTube {
 public:
  /// z = 0 of the pattern lies at arc length `start`. \pre axis outlives the tube
  BentTube(const AxisWithFrames& axis, double start) : axis_(axis), start_(start) {}

  struct Place {
    Vec3 centre;
    Frame frame;
    Vec3 outward(double angle) const {
      return std::cos(angle) * frame.normal + std::sin(angle) * frame.binormal();
    }
  };
  Place at(double z) const;
  Vec3 point(const PatternPoint& p) const;

  /// The coordinates of x, found from those of a point nearby; its angle is the one within half a
  /// turn of `nearby`'s.
  PatternPoint coordinates(const Vec3& x, const PatternPoint& nearby) const;

  /// The z whose normal plane x lies in, from one near it: Newton's way, for many points. x lies
  /// nearer to the axis than its centre of curvature.
  double foot(const Vec3& x, double nearby) const;

  /// The largest curvature (1/mm) that the axis has between z0 and z1.
  double largest_curvature(double z0, double z1) const;

 private:
  std::size_t segment_at(double s) const;

  const AxisWithFrames& axis_;
  double start_;
};

/// The same point on the straight stent, whose axis is z.
Vec3 straight_point(const PatternPoint& p);

}  // namespace vstent::stents
