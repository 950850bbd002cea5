// Where a point is nearest to an edge and to a triangle.
#pragma once

#include <algorithm>

#include "sdf/geometry.hpp"

namespace vstent {

/// Share of the way from a to b, 0 to 1, at which the edge is nearest to x; 0 where it has no
/// length.
inline double nearest_on_edge(const Vec3& x, const Vec3& a, const Vec3& b) {
  const Vec3 edge = b - a;
  const double squared_length = edge.squaredNorm();
  if (!(squared_length > 0)) return 0;
  return std::clamp((x - a).dot(edge) / squared_length, 0.0, 1.0);
}

/// Weights of the corners, of sum 1, at the place of the triangle nearest to x; exact for needles
/// and for triangles without area, too.
inline Vec3 nearest_on_triangle(const Vec3& x, const Vec3& a, const Vec3& b, const Vec3& c) {
  // With x projected to a + u (b - a) + v (c - a): which corner, edge or the inside it falls to
  // follows from signs of dot products along the two sides at each corner.
  const Vec3 ab = b - a;
  const Vec3 ac = c - a;
  const Vec3 ax = x - a;
  const double ab_a = ab.dot(ax);
  const double ac_a = ac.dot(ax);
  if (ab_a <= 0 && ac_a <= 0) return {1, 0, 0};
  const double ab_ab = ab.squaredNorm();
  const double ac_ac = ac.squaredNorm();
  const double ab_ac = ab.dot(ac);
  const double ab_b = ab_a - ab_ab;  // the same products seen from b and from c
  const double ac_b = ac_a - ab_ac;
  if (ab_b >= 0 && ac_b <= ab_b) return {0, 1, 0};
  const double ab_c = ab_a - ab_ac;
  const double ac_c = ac_a - ac_ac;
  if (ac_c >= 0 && ab_c <= ac_c) return {0, 0, 1};

  const double doubled_area = ab_ab * ac_ac - ab_ac * ab_ac;
  const double u = ac_ac * ab_a - ab_ac * ac_a;
  const double v = ab_ab * ac_a - ab_ac * ab_a;
  if (doubled_area > 0 && u > 0 && v > 0 && u + v < doubled_area)
    return {1 - u / doubled_area - v / doubled_area, u / doubled_area, v / doubled_area};
  const double on_ab = nearest_on_edge(x, a, b), on_bc = nearest_on_edge(x, b, c),
               on_ca = nearest_on_edge(x, c, a);
  Vec3 nearest(1 - on_ab, on_ab, 0);
  double least = (x - (a + on_ab * ab)).squaredNorm();
  if (const double squared = (x - (b + on_bc * (c - b))).squaredNorm(); squared < least) {
    least = squared;
    nearest = {0, 1 - on_bc, on_bc};
  }
  if ((x - (c + on_ca * (a - c))).squaredNorm() < least) nearest = {on_ca, 0, 1 - on_ca};
  return nearest;
}

}  // namespace vstent
