// Corners of a mesh's triangles.
#pragma once

#include "sdf/geometry.hpp"

namespace vstent::measure {

inline std::size_t at(int index) { return static_cast<std::size_t>(index); }

inline std::array<Vec3, 3> corners(const TriangleMesh& mesh, std::size_t triangle) {
  const Triangle& t = mesh.triangles[triangle];
  return {mesh.points[at(t[0])], mesh.points[at(t[1])], mesh.points[at(t[2])]};
}

inline Vec3 centroid(const std::array<Vec3, 3>& x) { return (x[0] + x[1] + x[2]) / 3; }

/// Along the outward normal, as long as the area (mm2).
inline Vec3 area_vector(const std::array<Vec3, 3>& x) {
  return 0.5 * (x[1] - x[0]).cross(x[2] - x[0]);
}

}  // namespace vstent::measure
