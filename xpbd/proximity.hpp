// Where a point is nearest to a triangle, and a segment to a segment.
#pragma once

#include <array>

#include "sdf/geometry.hpp"

namespace vstent::xpbd {

/// Two nearest places: `offset` leads from the second one to the first.
struct Nearest {
  Vec3 offset = Vec3::Zero();
  double distance = 0;
  std::array<double, 4> weights{};  ///< of the four vertices, so that their sum is `offset`
};

/// Of a point x and the triangle (a, b, c); weights of (x, a, b, c).
Nearest point_triangle(const Vec3& x, const Vec3& a, const Vec3& b, const Vec3& c);

/// Of a point x and the segment (a, b); weights of (x, a, b).
Nearest point_segment(const Vec3& x, const Vec3& a, const Vec3& b);

/// Of the segments (p, q) and (r, s); weights of (p, q, r, s). After Ericson, Real-Time Collision
/// Detection (2005), 5.1.9.
Nearest segment_segment(const Vec3& p, const Vec3& q, const Vec3& r, const Vec3& s);

}  // namespace vstent::xpbd
