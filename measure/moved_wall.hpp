// The part of a wall that may have moved, as metrics look at it.
#pragma once

#include <span>

#include "sdf/box_tree.hpp"

namespace vstent::measure {

class MovedWall {
 public:
  /// `chosen`: 1 for the triangles that belong to it.
  MovedWall(const TriangleMesh& mesh, std::span<const char> chosen);

  /// Distance along `direction` (unit) to the first triangle within `limit` of x; infinity: none.
  double ahead(const Vec3& x, const Vec3& direction, double limit) const;

  /// Points no further than `spacing` apart on every triangle, corners included.
  std::vector<Vec3> sampled(double spacing) const;

 private:
  TriangleMesh mesh_;
  sdf::BoxTree tree_;
};

/// How deep (mm) points lie inside the surface with these outer radii about an axis; those beyond
/// its ends lie nowhere inside.
std::vector<double> depths(std::span<const Vec3> points, const Polyline& axis,
                           std::span<const double> radii);

}  // namespace vstent::measure
