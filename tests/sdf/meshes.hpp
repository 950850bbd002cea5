// Closed test surfaces with known distances.
#pragma once

#include <map>

#include "sdf/geometry.hpp"

namespace vstent::tests {

/// Icosahedron, each triangle divided in four `levels` times and pushed onto the sphere.
inline TriangleMesh icosphere(double radius, int levels, const Vec3& centre = Vec3::Zero()) {
  const double g = (1 + std::sqrt(5.0)) / 2;
  TriangleMesh mesh{
      {{-1, g, 0},
       {1, g, 0},
       {-1, -g, 0},
       {1, -g, 0},
       {0, -1, g},
       {0, 1, g},
       {0, -1, -g},
       {0, 1, -g},
       {g, 0, -1},
       {g, 0, 1},
       {-g, 0, -1},
       {-g, 0, 1}},
      {{0, 11, 5},  {0, 5, 1},  {0, 1, 7},  {0, 7, 10}, {0, 10, 11}, {1, 5, 9}, {5, 11, 4},
       {11, 10, 2}, {10, 7, 6}, {7, 1, 8},  {3, 9, 4},  {3, 4, 2},   {3, 2, 6}, {3, 6, 8},
       {3, 8, 9},   {4, 9, 5},  {2, 4, 11}, {6, 2, 10}, {8, 6, 7},   {9, 8, 1}}};
  for (int level = 0; level < levels; ++level) {
    std::map<std::pair<int, int>, int> middles;
    const auto middle = [&](int a, int b) {
      const auto [it, is_new] =
          middles.try_emplace(std::minmax(a, b), static_cast<int>(mesh.points.size()));
      if (is_new) {
        mesh.points.push_back(0.5 * (mesh.points[static_cast<std::size_t>(a)] +
                                     mesh.points[static_cast<std::size_t>(b)]));
      }
      return it->second;
    };
    std::vector<Triangle> finer;
    for (const auto& [a, b, c] : mesh.triangles) {
      const int ab = middle(a, b), bc = middle(b, c), ca = middle(c, a);
      finer.insert(finer.end(), {{a, ab, ca}, {b, bc, ab}, {c, ca, bc}, {ab, bc, ca}});
    }
    mesh.triangles = std::move(finer);
    for (Vec3& p : mesh.points) p = p.normalized();
  }
  for (Vec3& p : mesh.points) p = centre + radius * p.normalized();
  return mesh;
}

}  // namespace vstent::tests
