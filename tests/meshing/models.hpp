// Models with closed forms, and measures that several tests share.
#pragma once

#include <Eigen/Geometry>
#include <numbers>
#include <set>

#include "meshing/faces.hpp"
#include "tests/vessels/shapes.hpp"
#include "vessels/check.hpp"

namespace vstent::tests {

inline Vec3 corner(const TriangleMesh& mesh, const Triangle& t, std::size_t k) {
  return mesh.points[static_cast<std::size_t>(t[k])];
}

inline Vec3 area_vector(const TriangleMesh& mesh, const Triangle& t) {
  const Vec3 a = corner(mesh, t, 0);
  return 0.5 * (corner(mesh, t, 1) - a).cross(corner(mesh, t, 2) - a);
}

inline Vec3 centroid(const TriangleMesh& mesh, const Triangle& t) {
  return (corner(mesh, t, 0) + corner(mesh, t, 1) + corner(mesh, t, 2)) / 3;
}

inline double area_of(const TriangleMesh& mesh) {
  double area = 0;
  for (const Triangle& t : mesh.triangles) area += area_vector(mesh, t).norm();
  return area;
}

inline double area_of(const meshing::Model& model, int face) {
  return area_of(TriangleMesh{model.mesh.points, triangles_of(model, face)});
}

/// Vertices - edges + triangles; unused points do not count.
inline int euler_characteristic(const TriangleMesh& mesh) {
  std::set<int> points;
  std::set<std::pair<int, int>> edges;
  for (const Triangle& t : mesh.triangles) {
    for (std::size_t k = 0; k < 3; ++k) {
      points.insert(t[k]);
      edges.insert({std::min(t[k], t[(k + 1) % 3]), std::max(t[k], t[(k + 1) % 3])});
    }
  }
  return static_cast<int>(points.size()) - static_cast<int>(edges.size()) +
         static_cast<int>(mesh.triangles.size());
}

inline std::vector<double> edge_lengths_of(const TriangleMesh& mesh) {
  std::set<std::pair<int, int>> edges;
  for (const Triangle& t : mesh.triangles)
    for (std::size_t k = 0; k < 3; ++k)
      edges.insert({std::min(t[k], t[(k + 1) % 3]), std::max(t[k], t[(k + 1) % 3])});
  std::vector<double> lengths;
  for (const auto& [a, b] : edges)
    lengths.push_back(
        (mesh.points[static_cast<std::size_t>(a)] - mesh.points[static_cast<std::size_t>(b)])
            .norm());
  return lengths;
}

inline bool closed_and_oriented(const TriangleMesh& mesh) {
  const vessels::Topology facts = vessels::topology(mesh);
  return facts.boundary_loops.empty() && facts.non_manifold_edges.empty() &&
         facts.inconsistent_edges.empty() && facts.bow_tie_vertices.empty();
}

/// A tube along z with two caps.
inline meshing::Model cylinder(double radius, double length, int around, int rings) {
  return meshing::model_of(vessels::make_surface(tube(radius, length, around, rings), "cylinder"))
      .model;
}

inline meshing::Model one_face(TriangleMesh mesh) {
  std::vector<int> face(mesh.triangles.size(), 1);
  return {std::move(mesh), std::move(face), {{1, "wall", false}}};
}

/// A ring around z: circles of radius `minor` along one of radius `major`.
inline TriangleMesh torus(double major, double minor, int along, int around) {
  TriangleMesh mesh;
  for (int i = 0; i < along; ++i) {
    for (int j = 0; j < around; ++j) {
      const double u = 2 * std::numbers::pi * i / along, v = 2 * std::numbers::pi * j / around;
      const double r = major + minor * std::cos(v);
      mesh.points.emplace_back(r * std::cos(u), r * std::sin(u), minor * std::sin(v));
      const int a = i * around + j, b = i * around + (j + 1) % around;
      const int next = ((i + 1) % along - i) * around;
      mesh.triangles.push_back({a, a + next, b + next});
      mesh.triangles.push_back({a, b + next, b});
    }
  }
  return mesh;
}

}  // namespace vstent::tests
