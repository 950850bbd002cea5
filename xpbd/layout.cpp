#include "xpbd/layout.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <cstdint>
#include <numeric>
#include <span>
#include <tuple>
#include <utility>

namespace vstent::xpbd {
namespace {

// Two dozen kilobytes of particles: a block stays in the first-level cache while its colours run
// over it.
constexpr int kBlockVertices = 768;

std::size_t at(int index) { return static_cast<std::size_t>(index); }

std::array<int, 2> vertices(const DistanceConstraint& d) { return {d.i, d.j}; }
std::array<int, 4> vertices(const BendingConstraint& b) {
  return {b.edge_a, b.edge_b, b.wing_a, b.wing_b};
}

std::array<int, 3> vertices(const TriangleConstraint& t) { return t.vertices; }

/// Constraints at each vertex, distances first, then bendings, then triangles, numbered through.
struct Incidence {
  std::vector<int> first;
  std::vector<int> constraint;
};

template <class Visit>
void for_each_member(const Sheet& sheet, const Visit& visit) {
  int constraint = 0;
  for (const DistanceConstraint& d : sheet.distances) {
    for (int v : vertices(d)) visit(v, constraint);
    ++constraint;
  }
  for (const BendingConstraint& b : sheet.bendings) {
    for (int v : vertices(b)) visit(v, constraint);
    ++constraint;
  }
  for (const TriangleConstraint& t : sheet.triangles) {
    for (int v : vertices(t)) visit(v, constraint);
    ++constraint;
  }
}

Incidence make_incidence(const Sheet& sheet) {
  Incidence incidence;
  incidence.first.assign(sheet.positions.size() + 1, 0);
  for_each_member(sheet, [&](int v, int) { ++incidence.first[at(v) + 1]; });
  std::partial_sum(incidence.first.begin(), incidence.first.end(), incidence.first.begin());
  incidence.constraint.resize(at(incidence.first.back()));
  std::vector<int> next(incidence.first.begin(), incidence.first.end() - 1);
  for_each_member(sheet, [&](int v, int c) { incidence.constraint[at(next[at(v)]++)] = c; });
  return incidence;
}

/// Breadth-first walk of one connected piece.
class Walk {
 public:
  explicit Walk(const Sheet& sheet)
      : sheet_(sheet),
        incidence_(make_incidence(sheet)),
        vertex_walk_(sheet.positions.size(), -1),
        constraint_walk_(sheet.distances.size() + sheet.bendings.size() + sheet.triangles.size(),
                         -1) {}

  bool seen(int vertex) const { return vertex_walk_[at(vertex)] >= 0; }

  /// Appends the piece of `start` to `order`, and where each level begins to `levels`.
  void from(int start, std::vector<int>& order, std::vector<int>& levels) {
    ++walk_;
    std::size_t begin = order.size();
    visit(start, order);
    while (begin < order.size()) {
      levels.push_back(static_cast<int>(begin));
      const std::size_t end = order.size();
      for (; begin < end; ++begin) visit_neighbours(order[begin], order);
    }
  }

 private:
  void visit(int vertex, std::vector<int>& order) {
    if (std::exchange(vertex_walk_[at(vertex)], walk_) != walk_) order.push_back(vertex);
  }

  void visit_neighbours(int vertex, std::vector<int>& order) {
    for (int k = incidence_.first[at(vertex)]; k < incidence_.first[at(vertex) + 1]; ++k) {
      const int c = incidence_.constraint[at(k)];
      if (std::exchange(constraint_walk_[at(c)], walk_) == walk_) continue;
      const std::size_t distances = sheet_.distances.size();
      const std::size_t hinged = distances + sheet_.bendings.size();
      if (at(c) < distances)
        for (int v : vertices(sheet_.distances[at(c)])) visit(v, order);
      else if (at(c) < hinged)
        for (int v : vertices(sheet_.bendings[at(c) - distances])) visit(v, order);
      else
        for (int v : vertices(sheet_.triangles[at(c) - hinged])) visit(v, order);
    }
  }

  const Sheet& sheet_;
  Incidence incidence_;
  std::vector<int> vertex_walk_, constraint_walk_;
  int walk_ = -1;
};

/// Where each block begins, and the total at the end; `order` is filled with the sheet's vertices.
std::vector<int> blocks_of_levels(const Sheet& sheet, std::vector<int>& order) {
  Walk walk(sheet);
  std::vector<int> levels, scratch, scratch_levels;
  order.reserve(sheet.positions.size());
  for (int v = 0; v < static_cast<int>(sheet.positions.size()); ++v) {
    if (walk.seen(v)) continue;
    // The last vertex that a walk reaches lies at an end of the piece: from there levels are many
    // and narrow.
    scratch.clear();
    walk.from(v, scratch, scratch_levels);
    walk.from(scratch.back(), order, levels);
  }
  std::vector<int> blocks;
  int levels_in_block = 0;
  for (int begin : levels) {
    if (blocks.empty() || (levels_in_block >= 2 && begin - blocks.back() >= kBlockVertices)) {
      blocks.push_back(begin);
      levels_in_block = 0;
    }
    ++levels_in_block;
  }
  blocks.push_back(static_cast<int>(order.size()));
  if (blocks.size() > 2 && levels_in_block < 2) blocks.erase(blocks.end() - 2);
  return blocks;
}

/// Colours constraints so that none of a colour share a vertex, and hands out each colour's batch
/// by batch.
class Colouring {
 public:
  explicit Colouring(std::size_t vertex_count) : used_(vertex_count, 0) {}

  template <class Members, class Emit>
  void batch(std::span<int> constraints, const Members& members, const Emit& emit) {
    rest_.assign(constraints.begin(), constraints.end());
    while (!rest_.empty()) {  // more than one round only where 64 constraints meet at a vertex
      for (auto& colour : colours_) colour.clear();
      later_.clear();
      for (int c : rest_) {
        std::uint64_t used = 0;
        for (int v : members(c)) used |= used_[at(v)];
        const int colour = std::countr_one(used);
        if (colour == 64) {
          later_.push_back(c);
          continue;
        }
        for (int v : members(c)) used_[at(v)] |= std::uint64_t{1} << colour;
        colours_[at(colour)].push_back(c);
      }
      for (int c : rest_)
        for (int v : members(c)) used_[at(v)] = 0;
      for (const auto& colour : colours_)
        for (std::size_t k = 0; k < colour.size(); k += kLanes) {
          Indices lanes;
          for (std::size_t lane = 0; lane < kLanes; ++lane)
            lanes[lane] = k + lane < colour.size() ? colour[k + lane] : colour[k];
          emit(lanes);
        }
      rest_.swap(later_);
    }
  }

 private:
  std::vector<std::uint64_t> used_;
  std::array<std::vector<int>, 64> colours_;
  std::vector<int> rest_, later_;
};

/// Constraints sorted by task (2 block for within it, 2 block + 1 for between it and the next),
/// then by place.
template <class Constraint>
struct Sorted {
  std::vector<int> constraint;
  std::vector<std::size_t> first;  // by task
};

template <class Constraint>
Sorted<Constraint> sort_by_task(const std::vector<Constraint>& constraints,
                                const std::vector<int>& number, const std::vector<int>& block,
                                std::size_t tasks) {
  struct Key {
    int task, lowest;
  };
  std::vector<Key> keys(constraints.size());
  Sorted<Constraint> sorted;
  std::vector<int> count(number.size() + 1, 0);
  sorted.first.assign(tasks + 1, 0);
  for (std::size_t c = 0; c < constraints.size(); ++c) {
    int lowest = static_cast<int>(number.size()), highest = -1;
    for (int v : vertices(constraints[c])) {
      lowest = std::min(lowest, number[at(v)]);
      highest = std::max(highest, number[at(v)]);
    }
    const int low_block = block[at(lowest)], high_block = block[at(highest)];
    keys[c] = {2 * low_block + (high_block > low_block ? 1 : 0), lowest};
    if (!(constraints[c].stiffness > 0)) continue;
    ++count[at(lowest) + 1];
    ++sorted.first[at(keys[c].task) + 1];
  }
  // A counting sort by place, then one by task that keeps the places' order.
  std::partial_sum(count.begin(), count.end(), count.begin());
  std::partial_sum(sorted.first.begin(), sorted.first.end(), sorted.first.begin());
  std::vector<int> by_place(sorted.first.back());
  for (std::size_t c = 0; c < constraints.size(); ++c)
    if (constraints[c].stiffness > 0)
      by_place[at(count[at(keys[c].lowest)]++)] = static_cast<int>(c);
  sorted.constraint.resize(by_place.size());
  std::vector<std::size_t> next(sorted.first.begin(), sorted.first.end() - 1);
  for (int c : by_place) sorted.constraint[next[at(keys[at(c)].task)]++] = c;
  return sorted;
}

}  // namespace

Layout make_layout(const Sheet& sheet) {
  Layout layout;
  const std::vector<int> blocks = blocks_of_levels(sheet, layout.original);
  const std::size_t tasks = blocks.size() < 2 ? 0 : 2 * (blocks.size() - 1);
  layout.number.resize(layout.original.size());
  std::vector<int> block(layout.original.size());
  for (std::size_t k = 0, b = 0; k < layout.original.size(); ++k) {
    while (static_cast<int>(k) >= blocks[b + 1]) ++b;
    layout.number[at(layout.original[k])] = static_cast<int>(k);
    block[k] = static_cast<int>(b);
  }

  auto distances = sort_by_task(sheet.distances, layout.number, block, tasks);
  auto bendings = sort_by_task(sheet.bendings, layout.number, block, tasks);
  auto triangles = sort_by_task(sheet.triangles, layout.number, block, tasks);
  layout.distances.reserve(distances.constraint.size() / kLanes * 17 / 16 + tasks);
  layout.bendings.reserve(bendings.constraint.size() / kLanes * 17 / 16 + tasks);
  layout.triangles.reserve(triangles.constraint.size() / kLanes * 17 / 16 + tasks);
  Colouring colouring(sheet.positions.size());
  const auto members = [&](const auto& constraint) {
    auto indices = vertices(constraint);
    for (int& v : indices) v = layout.number[at(v)];
    return indices;
  };
  const auto fill = [&](const auto& constraints, auto& sorted, std::size_t t, auto& batches,
                        const auto& set_vertices) {
    colouring.batch(
        std::span(sorted.constraint)
            .subspan(sorted.first[t], sorted.first[t + 1] - sorted.first[t]),
        [&](int c) { return members(constraints[at(c)]); },
        [&](const Indices& lanes) {
          auto& batch = batches.emplace_back();
          for (std::size_t lane = 0; lane < kLanes; ++lane) {
            const auto& constraint = constraints[at(lanes[lane])];
            batch.force[lane] = 0;
            set_vertices(batch, lane, constraint);
          }
        });
  };
  for (std::size_t t = 0; t < tasks; ++t) {
    Task task{layout.distances.size(), 0, layout.bendings.size(), 0, layout.triangles.size(), 0};
    fill(sheet.distances, distances, t, layout.distances,
         [&](DistanceBatch& batch, std::size_t lane, const DistanceConstraint& d) {
           batch.rest[lane] = d.rest_length;
           batch.compliance[lane] = 1 / d.stiffness;
           const std::array<int, 2> v = members(d);
           for (std::size_t k = 0; k < 2; ++k) batch.vertex[k][lane] = v[k];
         });
    fill(sheet.bendings, bendings, t, layout.bendings,
         [&](BendingBatch& batch, std::size_t lane, const BendingConstraint& b) {
           batch.rest[lane] = b.rest_angle;
           batch.compliance[lane] = 1 / b.stiffness;
           const std::array<int, 4> v = members(b);
           for (std::size_t k = 0; k < 4; ++k) batch.vertex[k][lane] = v[k];
         });
    fill(sheet.triangles, triangles, t, layout.triangles,
         [&](TriangleBatch& batch, std::size_t lane, const TriangleConstraint& e) {
           batch.along[lane] = 1 / e.base;
           batch.skew[lane] = e.foot / (e.base * e.height);
           batch.across[lane] = 1 / e.height;
           batch.weight[lane] = shear_modulus(e) * 0.5 * e.base * e.height;
           batch.bulk[lane] = 2 * (1 + e.poisson_ratio) / (3 * (1 - 2 * e.poisson_ratio));
           const std::array<int, 3> v = members(e);
           for (std::size_t k = 0; k < 3; ++k) batch.vertex[k][lane] = v[k];
         });
    task.last_distance = layout.distances.size();
    task.last_bending = layout.bendings.size();
    task.last_triangle = layout.triangles.size();
    (t % 2 == 0 ? layout.within : layout.between).push_back(task);
  }
  return layout;
}

BatchesOf<float> in_single_precision(const Layout& layout) {
  static_assert(kLanesOf<float> == 2 * kLanes);
  std::vector<std::size_t> mark(layout.number.size(), 0);
  std::size_t marks = 0;
  const auto share_a_vertex = [&](const auto& a, const auto& b) {
    ++marks;
    for (const Indices& corner : a.vertex)
      for (int v : corner) mark[at(v)] = marks;
    for (const Indices& corner : b.vertex)
      for (int v : corner)
        if (mark[at(v)] == marks) return true;
    return false;
  };
  const auto convert = [&](const auto& from, auto& to) {
    for (std::size_t n = 0; n < from.size(); ++n) {
      const auto& first = from[n];
      const bool is_joined = n + 1 < from.size() && !share_a_vertex(first, from[n + 1]);
      const auto& second = is_joined ? from[++n] : first;
      auto& made = to.emplace_back();
      for (std::size_t lane = 0; lane < 2 * kLanes; ++lane) {
        const auto& source = lane < kLanes ? first : second;
        const std::size_t there = lane < kLanes || is_joined ? lane % kLanes : 0;
        made.rest[lane] = static_cast<float>(source.rest[there]);
        made.compliance[lane] = static_cast<float>(source.compliance[there]);
        made.force[lane] = 0;
        for (std::size_t k = 0; k < made.vertex.size(); ++k)
          made.vertex[k][lane] = source.vertex[k][there];
      }
    }
  };
  BatchesOf<float> single;
  single.distances.reserve(layout.distances.size() * 17 / 32);
  single.bendings.reserve(layout.bendings.size() * 17 / 32);
  const auto convert_phase = [&](const std::vector<Task>& from, std::vector<Task>& to) {
    for (const Task& task : from) {
      Task made{single.distances.size(), 0, single.bendings.size(), 0, 0, 0};
      convert(distances_of(layout, task), single.distances);
      convert(bendings_of(layout, task), single.bendings);
      made.last_distance = single.distances.size();
      made.last_bending = single.bendings.size();
      to.push_back(made);
    }
  };
  convert_phase(layout.within, single.within);
  convert_phase(layout.between, single.between);
  return single;
}

}  // namespace vstent::xpbd
