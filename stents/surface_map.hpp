// Where the points of a straight stent's surface come to lie on a bent axis at another radius.
#pragma once

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

  double largest_radius() const;

 private:
  AxisWithFrames axis_;
  double start_;
  std::vector<double> radii_;
  double straight_radius_;
};

}  // namespace vstent::stents
