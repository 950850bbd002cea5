// The line a stent is threaded on: frames that do not twist, and straightening that keeps its
// length.
#pragma once

#include "sdf/geometry.hpp"

namespace vstent::stents {

/// A direction perpendicular to the tangent, carried along the axis without spinning about it.
struct Frame {
  Vec3 tangent = Vec3::UnitZ();
  Vec3 normal = Vec3::UnitX();
  Vec3 binormal() const { return tangent.cross(normal); }
};

/// Rotation-minimising frames at the points of an axis by double reflection (Wang, Juettler, Zheng,
/// Liu 2008), whose error falls with the fourth power of the spacing.
std::vector<Frame> rotation_minimising_frames(const Polyline& axis);

/// The axis with every turn between its segments reduced to (1 - strength) of itself: 0 gives the
/// axis back, 1 a straight line. Segment lengths, and so the arc length, stay. The result is moved
/// rigidly onto the axis as closely as least squares allow, so that straightening displaces the
/// vessel no more than it must. \pre strength in [0, 1]; at least two points, none repeated
Polyline straightened(const Polyline& axis, double strength);

/// The largest curvature (1/mm) at an inner point: the turn over half of both its segments.
double largest_curvature(const Polyline& axis);

/// Angle (rad) between the directions at the two ends.
double end_tangent_angle(const Polyline& axis);

}  // namespace vstent::stents
