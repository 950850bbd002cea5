// Measures of models that several tests share.
#pragma once

#include <Eigen/Geometry>

#include "meshing/model.hpp"

namespace vstent::tests {

inline Vec3 corner(const TriangleMesh& mesh, const Triangle& t, std::size_t k) {
  return mesh.points[static_cast<std::size_t>(t[k])];
}

inline Vec3 area_vector(const TriangleMesh& mesh, const Triangle& t) {
  const Vec3 a = corner(mesh, t, 0);
  return 0.5 * (corner(mesh, t, 1) - a).cross(corner(mesh, t, 2) - a);
}

inline double area_of(const TriangleMesh& mesh) {
  double area = 0;
  for (const Triangle& t : mesh.triangles) area += area_vector(mesh, t).norm();
  return area;
}

inline double area_of(const meshing::Model& model, int face) {
  return area_of(TriangleMesh{model.mesh.points, triangles_of(model, face)});
}

inline double volume_of(const TriangleMesh& mesh) {
  double volume = 0;
  for (const Triangle& t : mesh.triangles)
    volume += corner(mesh, t, 0).dot(area_vector(mesh, t)) / 3;
  return volume;
}

}  // namespace vstent::tests
