// What is this surface, and can it be stented?
#pragma once

#include <utility>
#include <vector>

#include "vessels/surface.hpp"

namespace vstent::vessels {

/// Edge-adjacency facts of a triangle mesh; all lists are sorted, so that two runs agree.
struct Topology {
  std::vector<std::vector<int>> boundary_loops;      ///< vertex ids in order, interior on the left
  std::vector<std::array<int, 2>> non_manifold_edges;  ///< more than two triangles
  std::vector<int> bow_tie_vertices;                 ///< the triangle fan around them is not one disc
  std::vector<std::array<int, 2>> inconsistent_edges;  ///< both neighbours run the same way
  std::vector<int> component_of_triangle;
  int components = 0;
};
Topology topology(const TriangleMesh& mesh);

/// Pairs of triangles that cross without sharing a vertex, or overlap beyond a shared vertex or edge; sorted.
/// `consider`, when not empty, restricts the search to pairs with at least one marked triangle.
std::vector<std::pair<int, int>> self_intersections(const TriangleMesh& mesh, std::span<const char> consider = {});

/// Everything `vstent check` prints. Lengths in mm.
struct CheckReport {
  std::size_t points = 0, triangles = 0, unused_points = 0, duplicate_points = 0;
  Box bounds;
  double edge_min = 0, edge_median = 0, edge_max = 0;
  bool closed = false;
  struct Opening { Vec3 centre; double diameter; std::size_t vertices; };  ///< diameter of the circle of equal area
  std::vector<Opening> openings;
  std::map<int, std::size_t> triangles_per_face;   ///< by ModelFaceID
  std::vector<Finding> findings;                   ///< reading's and checking's, errors first
  bool stentable() const;                          ///< no finding of severity error
};
CheckReport check(const Surface& surface);

/// \throws Error (geometry) with the first errors of the report, counts and places, when the surface cannot be stented
/// or, as `done` puts it, "meshed"
void require_stentable(const Surface& surface, const CheckReport& report, const std::string& done = "stented");

}  // namespace vstent::vessels
