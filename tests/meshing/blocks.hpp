// A cube of small cubes, each cut into six tetrahedra: a mesh whose every figure is known.
#pragma once

#include <algorithm>
#include <map>

#include "meshing/model.hpp"
#include "meshing/tetrahedra.hpp"

namespace vstent::tests {

struct Block {
  meshing::Model model;  ///< wall, and the caps inlet (z = 0) and outlet; its points come first
  meshing::TetMesh mesh;
};

/// `cells` cubes of `edge` along each side; six tetrahedra along the diagonal of each.
inline Block block(int cells, double edge) {
  const int n = cells + 1;
  const auto inside = [&](int i) { return i > 0 && i < cells; };
  std::map<std::array<int, 3>, int> number;
  Block result;
  for (const bool interior : {false, true}) {
    for (int x = 0; x < n; ++x) {
      for (int y = 0; y < n; ++y) {
        for (int z = 0; z < n; ++z) {
          if ((inside(x) && inside(y) && inside(z)) != interior) continue;
          number[{x, y, z}] = static_cast<int>(result.mesh.points.size());
          result.mesh.points.emplace_back(edge * x, edge * y, edge * z);
        }
      }
    }
    if (!interior) result.model.mesh.points = result.mesh.points;
  }
  for (int x = 0; x < cells; ++x) {
    for (int y = 0; y < cells; ++y) {
      for (int z = 0; z < cells; ++z) {
        std::array<int, 3> order{0, 1, 2};
        do {  // one tetrahedron for each way along three edges from corner to corner
          std::array<int, 3> at{x, y, z};
          meshing::Tetrahedron t{number[at]};
          for (std::size_t k = 0; k < 3; ++k) {
            ++at[static_cast<std::size_t>(order[k])];
            t[k + 1] = number[at];
          }
          if (meshing::signed_volume(result.mesh, t) < 0) std::swap(t[2], t[3]);
          result.mesh.tetrahedra.push_back(t);
        } while (std::next_permutation(order.begin(), order.end()));
      }
    }
  }
  std::map<Triangle, Triangle> single;  // facets by their sorted corners
  for (const meshing::Tetrahedron& t : result.mesh.tetrahedra) {
    for (int k = 0; k < 4; ++k) {
      Triangle key = meshing::facet(t, k);
      std::sort(key.begin(), key.end());
      if (const auto [other, fresh] = single.emplace(key, meshing::facet(t, k)); !fresh)
        single.erase(other);
    }
  }
  const double top = edge * cells;
  for (const auto& [key, facet] : single) {
    result.model.mesh.triangles.push_back(facet);
    const auto all_at = [&](double z) {
      return std::all_of(facet.begin(), facet.end(), [&](int v) {
        return result.mesh.points[static_cast<std::size_t>(v)].z() == z;
      });
    };
    result.model.face_of_triangle.push_back(all_at(0) ? 2 : all_at(top) ? 3 : 1);
  }
  result.model.faces = {{1, "wall", false}, {2, "inlet", true}, {3, "outlet", true}};
  return result;
}

}  // namespace vstent::tests
