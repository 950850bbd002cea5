#include <algorithm>
#include <array>
#include <numeric>

#include "vessels/check.hpp"
#include "vessels/half_edges.hpp"

namespace vstent::vessels {
namespace {

class UnionFind {
 public:
  explicit UnionFind(std::size_t count) : parent_(count) {
    std::iota(parent_.begin(), parent_.end(), 0);
  }
  int root(int i) {
    while (parent_[static_cast<std::size_t>(i)] != i) {
      int& parent = parent_[static_cast<std::size_t>(i)];
      parent = parent_[static_cast<std::size_t>(parent)];
      i = parent;
    }
    return i;
  }
  void unite(int a, int b) {
    a = root(a);
    b = root(b);
    if (a != b) parent_[static_cast<std::size_t>(std::max(a, b))] = std::min(a, b);
  }

 private:
  std::vector<int> parent_;
};

struct BoundaryEdge {
  int from, to;
  int fan;       // of the triangle corner at `to` and ...
  int fan_from;  // ... at `from`: equal fans belong to the same sheet
};

// Each triangle corner belongs to a fan: the corners around one vertex that are joined through
// edges at that vertex.
int corner(const TriangleMesh& mesh, int triangle, int vertex) {
  const Triangle& corners = mesh.triangles[static_cast<std::size_t>(triangle)];
  for (int k = 0; k < 3; ++k) {
    if (corners[static_cast<std::size_t>(k)] == vertex) return 3 * triangle + k;
  }
  return 3 * triangle;
}

std::vector<std::vector<int>> chain_loops(std::vector<BoundaryEdge> edges,
                                          std::size_t point_count) {
  std::sort(edges.begin(), edges.end(), [](const BoundaryEdge& a, const BoundaryEdge& b) {
    return std::tie(a.from, a.to) < std::tie(b.from, b.to);
  });
  std::vector<std::vector<int>> edges_at(point_count);
  for (std::size_t e = 0; e < edges.size(); ++e) {
    edges_at[static_cast<std::size_t>(edges[e].from)].push_back(static_cast<int>(e));
    edges_at[static_cast<std::size_t>(edges[e].to)].push_back(static_cast<int>(e));
  }
  std::vector<char> used(edges.size(), 0);
  std::vector<std::vector<int>> loops;
  for (std::size_t first = 0; first < edges.size(); ++first) {
    if (used[first]) continue;
    used[first] = 1;
    std::vector<int> loop = {edges[first].from};
    int vertex = edges[first].to;
    int fan = edges[first].fan;
    while (vertex != loop.front()) {
      loop.push_back(vertex);
      // Stay on the same sheet and keep the direction where the orientation allows it.
      int best = -1;
      int best_rank = -1;
      for (const int e : edges_at[static_cast<std::size_t>(vertex)]) {
        const BoundaryEdge& edge = edges[static_cast<std::size_t>(e)];
        if (used[static_cast<std::size_t>(e)]) continue;
        const bool forward = edge.from == vertex;
        const int rank = 2 * ((forward ? edge.fan_from : edge.fan) == fan) + (forward ? 1 : 0);
        if (rank > best_rank) {
          best = e;
          best_rank = rank;
        }
      }
      if (best < 0)
        break;  // cannot happen in a mesh of whole triangles: every vertex has an even boundary
                // degree
      const BoundaryEdge& edge = edges[static_cast<std::size_t>(best)];
      used[static_cast<std::size_t>(best)] = 1;
      const bool forward = edge.from == vertex;
      fan = forward ? edge.fan : edge.fan_from;
      vertex = forward ? edge.to : edge.from;
    }
    loops.push_back(std::move(loop));
  }
  return loops;
}

}  // namespace

Topology topology(const TriangleMesh& mesh) {
  Topology result;
  const std::vector<HalfEdge> edges = sorted_half_edges(mesh);
  UnionFind components(mesh.triangles.size());
  UnionFind fans(3 * mesh.triangles.size());
  std::vector<const HalfEdge*> boundary;
  for_each_edge(edges, [&](std::size_t begin, std::size_t end) {
    const HalfEdge& first = edges[begin];
    for (std::size_t e = begin + 1; e < end; ++e) {
      components.unite(first.triangle, edges[e].triangle);
      for (const int vertex : {first.low, first.high}) {
        fans.unite(corner(mesh, first.triangle, vertex), corner(mesh, edges[e].triangle, vertex));
      }
    }
    if (end - begin == 1) boundary.push_back(&first);
    if (end - begin == 2 && first.ascending == edges[begin + 1].ascending) {
      result.inconsistent_edges.push_back({first.low, first.high});
    }
    if (end - begin > 2) result.non_manifold_edges.push_back({first.low, first.high});
  });

  std::vector<int> fan_of_vertex(mesh.points.size(), -1);
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    for (std::size_t k = 0; k < 3; ++k) {
      const int vertex = mesh.triangles[t][k];
      const int fan = fans.root(static_cast<int>(3 * t + k));
      int& known = fan_of_vertex[static_cast<std::size_t>(vertex)];
      if (known < 0) known = fan;
      if (known != fan) result.bow_tie_vertices.push_back(vertex);
    }
  }
  std::sort(result.bow_tie_vertices.begin(), result.bow_tie_vertices.end());
  result.bow_tie_vertices.erase(
      std::unique(result.bow_tie_vertices.begin(), result.bow_tie_vertices.end()),
      result.bow_tie_vertices.end());

  std::vector<BoundaryEdge> boundary_edges;
  for (const HalfEdge* edge : boundary) {
    const int from = edge->ascending ? edge->low : edge->high;
    const int to = edge->ascending ? edge->high : edge->low;
    boundary_edges.push_back({from, to, fans.root(corner(mesh, edge->triangle, to)),
                              fans.root(corner(mesh, edge->triangle, from))});
  }
  result.boundary_loops = chain_loops(std::move(boundary_edges), mesh.points.size());

  result.component_of_triangle.resize(mesh.triangles.size());
  std::vector<int> number_of_root(mesh.triangles.size(), -1);
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    int& component = number_of_root[static_cast<std::size_t>(components.root(static_cast<int>(t)))];
    if (component < 0) component = result.components++;
    result.component_of_triangle[t] = component;
  }
  return result;
}

}  // namespace vstent::vessels
