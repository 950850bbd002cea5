// Puts a sheet in the order in which the solver runs over it: near vertices together, constraints
// in batches.
#pragma once

#include <array>
#include <span>
#include <tuple>
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

/// visit(batch, lane) for every constraint, without the copies that fill a short batch.
template <class Batch, class Visit>
void for_each_lane(std::span<const Batch> batches, const Visit& visit) {
  for (const Batch& batch : batches)
    for (std::size_t lane = 0; lane < kLanes; ++lane) {
      if (lane > 0 && batch.vertex[0][lane] == batch.vertex[0][0]) break;
      visit(batch, lane);
    }
}

/// The particles of a constraint.
template <class Batch>
auto members_of(const Batch& batch, std::size_t lane) {
  std::array<int, std::tuple_size_v<decltype(batch.vertex)>> members;
  for (std::size_t k = 0; k < members.size(); ++k) members[k] = batch.vertex[k][lane];
  return members;
}

/// visit({i, j}, rest length, stiffness) for distances.
template <class Visit>
void for_each_distance(std::span<const DistanceBatch> batches, const Visit& visit) {
  for_each_lane(batches, [&](const DistanceBatch& batch, std::size_t lane) {
    visit(members_of(batch, lane), batch.rest[lane], 1 / batch.compliance[lane]);
  });
}

/// visit({edge_a, edge_b, wing_a, wing_b}, rest angle, stiffness) for hinges.
template <class Visit>
void for_each_bending(std::span<const BendingBatch> batches, const Visit& visit) {
  for_each_lane(batches, [&](const BendingBatch& batch, std::size_t lane) {
    visit(members_of(batch, lane), batch.rest[lane], 1 / batch.compliance[lane]);
  });
}

/// visit({corner 0, corner 1, corner 2}, batch, lane) for elastic triangles.
template <class Visit>
void for_each_triangle(std::span<const TriangleBatch> batches, const Visit& visit) {
  for_each_lane(batches, [&](const TriangleBatch& batch, std::size_t lane) {
    visit(members_of(batch, lane), batch, lane);
  });
}

}  // namespace vstent::xpbd
