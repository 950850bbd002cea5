// The directed edges of a triangle mesh, sorted so that the triangles of one edge stand together.
#pragma once

#include <tbb/parallel_sort.h>

#include <algorithm>
#include <tuple>
#include <vector>

#include "sdf/geometry.hpp"

namespace vstent::vessels {

struct HalfEdge {
  int low = 0, high = 0;  ///< the edge's vertices, sorted
  int triangle = 0;
  bool ascending = false;  ///< the triangle runs low -> high
};

inline std::vector<HalfEdge> sorted_half_edges(const TriangleMesh& mesh) {
  std::vector<HalfEdge> edges;
  edges.reserve(3 * mesh.triangles.size());
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    for (std::size_t k = 0; k < 3; ++k) {
      const int a = mesh.triangles[t][k];
      const int b = mesh.triangles[t][(k + 1) % 3];
      edges.push_back({std::min(a, b), std::max(a, b), static_cast<int>(t), a < b});
    }
  }
  // Entries that compare equal are equal: any order of sorting gives the same.
  tbb::parallel_sort(edges.begin(), edges.end(), [](const HalfEdge& a, const HalfEdge& b) {
    return std::tie(a.low, a.high, a.triangle, a.ascending) <
           std::tie(b.low, b.high, b.triangle, b.ascending);
  });
  return edges;
}

/// Calls visit(begin, end) for each edge's run of half-edges.
template <class Visit>
void for_each_edge(const std::vector<HalfEdge>& edges, Visit&& visit) {
  for (std::size_t begin = 0, end = 0; begin < edges.size(); begin = end) {
    while (end < edges.size() && edges[end].low == edges[begin].low &&
           edges[end].high == edges[begin].high)
      ++end;
    visit(begin, end);
  }
}

}  // namespace vstent::vessels
