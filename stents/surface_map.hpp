// Where the points of a straight stent's surface come to lie on a bent axis at another radius, and
// where they come from.
#pragma once

#include <optional>
#include <vector>

#include "stents/place.hpp"

namespace vstent::stents {

/// Takes (r, angle, z) of a straight stent of outer radius R0 to the place at arc length z of an
/// axis, at r - R0 + R(z) from it and at `angle` from its frame's normal. Radial lines stay radial
/// lines at their own scale, so metal keeps its thickness; around the axis it grows by about R /
/// R0, and along the axis it follows the bend.
class SurfaceMap {
 public:
  /// z = 0 lies at arc length `start` of the axis, which should begin and end a few points beyond
  /// the stent: there its bends are known best.
  /// \param radii R (mm) at the axis's points, between which it is linear
  SurfaceMap(AxisWithFrames axis, double start, std::vector<double> radii, double straight_radius);

  Vec3 placed(const Vec3& straight) const;
  TriangleMesh placed(TriangleMesh straight) const;

  /// The line out from the axis through a place, here and on the straight stent.
  struct WayOut {
    double radius = 0, straight_radius = 0;  ///< of the place; the second may be negative
    Vec3 outward, straight_outward;          ///< unit
    double z = 0;                            ///< on the straight stent
    Vec3 straight(double height = 0) const {
      return (straight_radius + height) * straight_outward + z * Vec3::UnitZ();
    }
  };
  /// `nearby`: z of an axis point near x, within the bend's own radius. Nothing on the axis itself.
  std::optional<WayOut> way_out(const Vec3& x, double nearby) const;

  double largest_radius() const;
  double smallest_radius() const;
  double straight_radius() const { return straight_radius_; }

  /// No length along the axis or out from it shrinks by more than this factor within the outer
  /// radius; at most 1. (Around the axis lengths go with the radius.)
  double least_stretch() const;

  /// The most (mm) that a point within the outer radius moves from this state to the other one of
  /// the same axis points.
  double largest_move(const SurfaceMap& other) const;

 private:
  double radius_at(double z) const;

  AxisWithFrames axis_;
  double start_;
  std::vector<double> radii_;
  double straight_radius_;
};

}  // namespace vstent::stents
