// Can the stented mesh be handed on? Closed, manifold, free of crossings; what moved.
#pragma once

#include <optional>

#include "vessels/surface.hpp"

namespace vstent::measure {

/// Corner angles of the triangles, deg.
struct AngleQuality {
  double smallest = 0, smallest_p5 = 0, smallest_median = 0;  ///< of each triangle's smallest
  double largest = 0, largest_p95 = 0, largest_median = 0;    ///< of each triangle's largest
};

struct MeshMetrics {
  bool same_triangles = false;  ///< and as many vertices: places after correspond to those before
  bool patch_known = false;
  // Only where the triangles are the same:
  double largest_displacement = 0;  ///< mm
  std::size_t moved_vertices = 0, changed_outside_patch = 0;
  std::size_t inverted_triangles = 0;  ///< turned over among the triangles around them
  std::size_t turned_triangles = 0;    ///< normals that turned by more than 90 degrees in space
  std::size_t new_self_intersections = 0;
  std::optional<Vec3> damaged_at;  ///< mm: an inverted triangle's middle, else a crossing one's
  // Of either surface:
  std::size_t self_intersections_before = 0, self_intersections_after = 0;
  bool closed_before = false, closed_after = false;
  std::size_t openings_before = 0, openings_after = 0;
  std::size_t non_manifold_edges_after = 0;
  AngleQuality angles_before, angles_after;
};

/// `movable`: per vertex, 1 in the patch; empty: not known. Self-intersections are those that
/// involve a triangle of the patch, or one that moved where no patch is known, or all where nothing
/// is known to have moved.
MeshMetrics certify(const TriangleMesh& before, const TriangleMesh& after,
                    std::span<const char> movable);

}  // namespace vstent::measure
