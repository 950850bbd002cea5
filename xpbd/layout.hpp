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

/// No two tasks of a phase share a vertex, so that they run side by side and give the same bits in
/// any order.
template <class Real>
struct BatchesOf {
  std::vector<DistanceBatchOf<Real>> distances;
  std::vector<BendingBatchOf<Real>> bendings;
  std::vector<Task> within, between;  ///< the two phases
};

/// Vertices are numbered by breadth-first levels, which every constraint spans by at most one, and
/// cut into blocks of two levels or more. Constraints within a block make one task, those between a
/// block and the next another.
struct Layout : BatchesOf<double> {
  std::vector<int> original;  ///< vertex number in the sheet, by number here
  std::vector<int> number;    ///< the inverse
  std::vector<TriangleBatch> triangles;
};

/// The batches of one task; those of a const layout are const.
template <class Batches>
auto distances_of(Batches& all, const Task& t) {
  return std::span(all.distances).subspan(t.first_distance, t.last_distance - t.first_distance);
}
template <class Batches>
auto bendings_of(Batches& all, const Task& t) {
  return std::span(all.bendings).subspan(t.first_bending, t.last_bending - t.first_bending);
}
template <class Batches>
auto triangles_of(Batches& all, const Task& t) {
  return std::span(all.triangles).subspan(t.first_triangle, t.last_triangle - t.first_triangle);
}

Layout make_layout(const Sheet& sheet);

/// The same projections but for triangles, in the same order, multipliers zero; neighbouring
/// batches that share no vertex become one.
BatchesOf<float> in_single_precision(const Layout& layout);

/// visit(i, j, rest length, stiffness) for every distance; i and j count particles.
template <class Visit>
void for_each_distance(const Layout& layout, const Visit& visit) {
  for (const DistanceBatch& batch : layout.distances)
    for (std::size_t lane = 0; lane < kLanes; ++lane) {
      if (lane > 0 && batch.vertex[0][lane] == batch.vertex[0][0])
        break;  // copies fill a short batch
      visit(batch.vertex[0][lane], batch.vertex[1][lane], batch.rest[lane],
            1 / batch.compliance[lane]);
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
