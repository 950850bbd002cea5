// What a stent is to the distance field: a union of round cones with optional flat end caps and of
// laser-cut struts, or the paper's cylinders.
#pragma once

#include <vector>

#include "sdf/geometry.hpp"

namespace vstent::sdf {

/// Signed distance (mm, negative inside) and its unit gradient; a zero gradient means "outside the
/// narrow band".
struct Sample {
  double distance = 0;
  Vec3 gradient = Vec3::Zero();
};

/// A round cone: the hull of two balls. Equal radii make a capsule. The caps name the discs that
/// cut it where its tube starts and ends, -1 for none; a short tube's segments may carry both.
struct Segment {
  Vec3 a = Vec3::Zero(), b = Vec3::Zero();
  double radius_a = 0, radius_b = 0;  ///< mm
  int start_cap = -1, end_cap = -1;
};

/// A laser-cut strut: the points at most width / 2 from the segment ab as seen along `normal`, and
/// at most thickness / 2 from it along `normal`, with rounded edges. Its ends are round as seen
/// along `normal`, so that the pieces of a curved strut join without gaps.
struct Strut {
  Vec3 a = Vec3::Zero(), b = Vec3::Zero();
  Vec3 normal = Vec3::UnitZ();                       ///< unit, perpendicular to ab
  double width = 0, thickness = 0, edge_radius = 0;  ///< mm
};

/// A flat disc that ends a tube: the segments that carry it are cut off beyond the plane through
/// `centre`. Behind the plane (z <= 0) their distance is max(d, z); beyond it, the distance to the
/// disc.
struct EndCap {
  Vec3 centre = Vec3::Zero();
  Vec3 outward = Vec3::UnitX();  ///< unit, away from the tube
  double radius = 0;             ///< mm, of the tube where the plane cuts it
};

/// How consecutive pieces of a chain meet. `flat` is the paper's eq. 18, a union of flat-capped
/// cylinders, kept for comparison only: its caps leave false zeros inside and notches on the outer
/// side of bends.
enum class Joints { round, flat };

/// A union of segments and struts. With `Joints::flat` every segment is a capped cylinder of the
/// mean radius and caps are ignored.
struct Solid {
  std::vector<Segment> segments;
  std::vector<Strut> struts;
  std::vector<EndCap> caps;
  Joints joints = Joints::round;
};

/// The tube around `axis` with one radius (mm) per point: round joints; flat caps at both ends
/// unless `round_ends`. The segments that the cap's plane could cut carry that end's cap: those
/// before the axis lies its own radius behind it. \throws std::invalid_argument fewer than two
/// points, repeated points, or a radius that is not positive and finite
Solid make_tube(const Polyline& axis, const std::vector<double>& radii, bool round_ends = false);

/// Closed forms, exact to rounding. Gradients are unit except where the closest feature is not
/// unique.
Sample capsule(const Vec3& x, const Vec3& a, const Vec3& b, double radius);
Sample capped_cylinder(const Vec3& x, const Vec3& a, const Vec3& b,
                       double radius);  // paper, one piece of eq. 18
Sample round_cone(const Vec3& x, const Vec3& a, const Vec3& b, double radius_a, double radius_b);
Sample flat_strut(const Vec3& x, const Strut& strut);

/// The solid's distance at x by trying every segment and strut: the slow, obvious twin of
/// ExactField and LevelSet.
Sample distance_brute_force(const Solid& solid, const Vec3& x);

}  // namespace vstent::sdf
