// Puts a sheet in the order in which the solver runs over it: near vertices together, constraints
// in batches.
#pragma once

#include <span>
#include <vector>

#include "xpbd/batches.hpp"
#include "xpbd/sheet.hpp"

namespace vstent::xpbd {

/// Batches of one task: ranges of Layout's arrays.
struct Task {
  std::size_t first_distance = 0, last_distance = 0;
  std::size_t first_bending = 0, last_bending = 0;
  std::size_t first_triangle = 0, last_triangle = 0;
};

/// Vertices are numbered by breadth-first levels, which every constraint spans by at most one, and
/// cut into blocks of two levels or more. Constraints within a block make one task, those between a
/// block and the next another: no two tasks of the same phase share a vertex, so that a phase's
/// tasks run side by side and give the same bits in any order.
struct Layout {
  std::vector<int> original;  ///< vertex number in the sheet, by number here
  std::vector<int> number;    ///< the inverse
  std::vector<DistanceBatch> distances;
  std::vector<BendingBatch> bendings;
  std::vector<TriangleBatch> triangles;
  std::vector<Task> within, between;  ///< the two phases

  std::span<const DistanceBatch> distances_of(const Task& t) const {
    return std::span(distances).subspan(t.first_distance, t.last_distance - t.first_distance);
  }
  std::span<const BendingBatch> bendings_of(const Task& t) const {
    return std::span(bendings).subspan(t.first_bending, t.last_bending - t.first_bending);
  }
  std::span<const TriangleBatch> triangles_of(const Task& t) const {
    return std::span(triangles).subspan(t.first_triangle, t.last_triangle - t.first_triangle);
  }
  std::span<DistanceBatch> distances_of(const Task& t) {
    return std::span(distances).subspan(t.first_distance, t.last_distance - t.first_distance);
  }
  std::span<BendingBatch> bendings_of(const Task& t) {
    return std::span(bendings).subspan(t.first_bending, t.last_bending - t.first_bending);
  }
  std::span<TriangleBatch> triangles_of(const Task& t) {
    return std::span(triangles).subspan(t.first_triangle, t.last_triangle - t.first_triangle);
  }
};

Layout make_layout(const Sheet& sheet);

/// visit(i, j, rest length, stiffness) for every distance; i and j count particles.
template <class Visit>
void for_each_distance(const Layout& layout, const Visit& visit) {
  for (const DistanceBatch& batch : layout.distances)
    for (std::size_t lane = 0; lane < kLanes; ++lane) {
      if (lane > 0 && batch.i[lane] == batch.i[0]) break;  // copies fill a short batch
      visit(batch.i[lane], batch.j[lane], batch.rest[lane], 1 / batch.compliance[lane]);
    }
}

/// visit({edge_a, edge_b, wing_a, wing_b}, rest angle, stiffness) for every hinge.
template <class Visit>
void for_each_bending(const Layout& layout, const Visit& visit) {
  for (const BendingBatch& batch : layout.bendings)
    for (std::size_t lane = 0; lane < kLanes; ++lane) {
      if (lane > 0 && batch.vertex[0][lane] == batch.vertex[0][0]) break;
      visit(std::array<int, 4>{batch.vertex[0][lane], batch.vertex[1][lane], batch.vertex[2][lane],
                               batch.vertex[3][lane]},
            batch.rest[lane], 1 / batch.compliance[lane]);
    }
}

/// visit({corner 0, corner 1, corner 2}, batch, lane) for every elastic triangle.
template <class Visit>
void for_each_triangle(const Layout& layout, const Visit& visit) {
  for (const TriangleBatch& batch : layout.triangles)
    for (std::size_t lane = 0; lane < kLanes; ++lane) {
      if (lane > 0 && batch.vertex[0][lane] == batch.vertex[0][0]) break;
      visit(std::array<int, 3>{batch.vertex[0][lane], batch.vertex[1][lane], batch.vertex[2][lane]},
            batch, lane);
    }
}

}  // namespace vstent::xpbd
