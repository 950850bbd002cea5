// Finer triangles where a thin strut must be felt: longest-edge bisection (Rivara 1984), which
// keeps the surface's shape, its vertices and, within a factor of two, its smallest angles.
#pragma once

#include <functional>

#include "vessels/surface.hpp"

namespace vstent::vessels {

/// The longest edge (mm) allowed at a place of a triangle of the input mesh; infinity: any.
using EdgeLimit = std::function<double(int triangle, const Vec3& place)>;

/// A mesh with new vertices in the middle of edges. Vertices and triangles of the input keep their
/// numbers; a triangle that was cut becomes its first piece, and everything new is appended.
struct RefinedMesh {
  TriangleMesh mesh;
  std::vector<std::array<int, 2>> parents;  ///< per new vertex: the ends of the edge it halves
  std::vector<int> origin;                  ///< per triangle: the input triangle it is part of
};

/// Cuts triangles until no longest edge exceeds the limit at its middle; neighbours are cut along
/// so that no vertex hangs. \throws Error (resources) when more than `vertex_limit` vertices would
/// be needed; (geometry) when an edge of three or more triangles would have to be cut
RefinedMesh refine(const TriangleMesh& mesh, const EdgeLimit& longest_edge,
                   std::size_t vertex_limit);

/// The same of a surface with its arrays: cell values are inherited, point values interpolated
/// (those of whole numbers: taken from the nearer end). New vertices lie on the facets to the
/// precision of the file's points.
Surface refine(const Surface& surface, const EdgeLimit& longest_edge, std::size_t vertex_limit);

}  // namespace vstent::vessels
