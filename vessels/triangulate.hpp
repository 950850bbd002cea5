// A polygon's corners as triangles.
#pragma once

#include <span>
#include <vector>

#include "sdf/geometry.hpp"

namespace vstent::vessels {

/// Cuts ears off the polygon seen along its own normal, the best shaped first; corners keep their
/// order of rotation. `simple` becomes false when it crosses itself, and the rest is then cut as a
/// fan.
std::vector<Triangle> triangulate(std::span<const int> polygon, std::span<const Vec3> points,
                                  bool& simple);

}  // namespace vstent::vessels
