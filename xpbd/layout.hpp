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
  struct Range {
    std::size_t first = 0, last = 0;
  };
  Range distances, hinged_edges, triangles, bendings;
};

/// Vertices are numbered by breadth-first levels, which every constraint spans by at most one, and
/// cut into blocks of two levels or more. Constraints within a block make one task, those between a
/// block and the next another. No two tasks of a phase share a vertex, so that they run side by
/// side and give the same bits in any order. A distance and a bending of the same edge are taken
/// together.
struct Layout {
  std::vector<int> original;  ///< vertex number in the sheet, by number here
  std::vector<int> number;    ///< the inverse
  std::vector<DistanceBatch> distances;
  std::vector<HingedEdgeBatch> hinged_edges;
  std::vector<TriangleBatch> triangles;
  std::vector<BendingBatch> bendings;
  std::vector<Task> within, between;  ///< the two phases
};

/// \throws std::invalid_argument for a stiffness whose inverse single precision cannot hold.
Layout make_layout(const Sheet& sheet);

inline ConstBatches all_of(const Layout& layout) {
  return {layout.distances, layout.hinged_edges, layout.triangles, layout.bendings};
}

/// The n-th of `count` parts of about equal size.
ConstBatches share_of(const Layout& layout, std::size_t n, std::size_t count);

/// The batches of one task; those of a const layout are const.
template <class SomeLayout>
auto batches_of(SomeLayout& layout, const Task& task) {
  const auto part = [](auto& batches, const Task::Range& range) {
    return std::span(batches).subspan(range.first, range.last - range.first);
  };
  return BatchesOf<std::is_const_v<SomeLayout>>{
      part(layout.distances, task.distances), part(layout.hinged_edges, task.hinged_edges),
      part(layout.triangles, task.triangles), part(layout.bendings, task.bendings)};
}

/// visit(batch, lane) for every constraint, without the copies that fill a short batch.
template <class Batch, class Visit>
void for_each_lane(std::span<const Batch> batches, const Visit& visit) {
  for (const Batch& batch : batches)
    for (std::size_t lane = 0; lane < kLanes; ++lane)
      if (!is_copy(batch, lane)) visit(batch, lane);
}

/// The particles of a constraint, or its first ones.
template <std::size_t kCount, class Batch>
std::array<int, kCount> members_of(const Batch& batch, std::size_t lane) {
  std::array<int, kCount> members;
  for (std::size_t k = 0; k < kCount; ++k) members[k] = batch.vertex[k][lane];
  return members;
}

inline double stiffness_of(const Springs& springs, std::size_t lane) {
  return 1 / static_cast<double>(springs.compliance[lane]);
}

/// visit({i, j}, rest length, stiffness) for distances.
template <class Visit>
void for_each_distance(const ConstBatches& batches, const Visit& visit) {
  const auto visit_length = [&](const auto& batch, std::size_t lane) {
    visit(members_of<2>(batch, lane), batch.length.rest[lane], stiffness_of(batch.length, lane));
  };
  for_each_lane(batches.distances, visit_length);
  for_each_lane(batches.hinged_edges, visit_length);
}

/// visit({edge_a, edge_b, wing_a, wing_b}, rest angle, stiffness) for hinges.
template <class Visit>
void for_each_bending(const ConstBatches& batches, const Visit& visit) {
  const auto visit_fold = [&](const auto& batch, std::size_t lane) {
    visit(members_of<4>(batch, lane), batch.fold.rest[lane], stiffness_of(batch.fold, lane));
  };
  for_each_lane(batches.hinged_edges, visit_fold);
  for_each_lane(batches.bendings, visit_fold);
}

/// visit({corner 0, corner 1, corner 2}, batch, lane) for elastic triangles.
template <class Visit>
void for_each_triangle(const ConstBatches& batches, const Visit& visit) {
  for_each_lane(batches.triangles, [&](const TriangleBatch& batch, std::size_t lane) {
    visit(members_of<3>(batch, lane), batch, lane);
  });
}

}  // namespace vstent::xpbd
