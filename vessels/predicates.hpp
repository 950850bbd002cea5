// On which side of a plane or a line does a point lie? Signs are exact, whatever the rounding.
#pragma once

#include <array>

#include "sdf/geometry.hpp"

namespace vstent::vessels {

/// Sign of det(b - a, c - a, d - a): positive when a, b, c turn clockwise seen from d, 0 exactly on
/// the plane. Floating point with an error bound first, exact expansions where that leaves the sign
/// open.
int orient3d(const Vec3& a, const Vec3& b, const Vec3& c, const Vec3& d);

using Vec2 = std::array<double, 2>;
/// Sign of det(b - a, c - a): positive when a, b, c turn counter-clockwise.
int orient2d(const Vec2& a, const Vec2& b, const Vec2& c);

/// The segments from a to b and from c to d have a point in common.
bool segments_meet(const Vec2& a, const Vec2& b, const Vec2& c, const Vec2& d);

/// The three points lie on one line exactly.
bool collinear(const Vec3& a, const Vec3& b, const Vec3& c);

}  // namespace vstent::vessels
