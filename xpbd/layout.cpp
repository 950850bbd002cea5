#include "xpbd/layout.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <cstdint>
#include <limits>
#include <numeric>
#include <span>
#include <stdexcept>
#include <string>
#include <utility>

namespace vstent::xpbd {
namespace {

// Two dozen kilobytes of particles: a block stays in the first-level cache while its batches run
// over it.
constexpr int kBlockVertices = 768;

std::size_t at(int index) { return static_cast<std::size_t>(index); }

enum Kind { kDistance, kHingedEdge, kTriangle, kBending, kKinds };

/// All that a sheet puts into batches, numbered through, one kind after the other. What has no
/// stiffness does nothing and is left out.
class Constraints {
 public:
  explicit Constraints(const Sheet& sheet) : sheet_(sheet) {
    const std::vector<int> distance_at = pair_up();
    std::vector<char> is_paired(sheet.distances.size(), 0);
    for (const int d : distance_at)
      if (d >= 0) is_paired[at(d)] = 1;
    for (std::size_t d = 0; d < sheet.distances.size(); ++d) {
      const DistanceConstraint& distance = sheet.distances[d];
      if (distance.stiffness > 0 && !is_paired[d])
        add({static_cast<int>(d), -1}, {distance.i, distance.j});
    }
    const auto add_bendings = [&](bool paired) {
      for (std::size_t b = 0; b < sheet.bendings.size(); ++b) {
        const BendingConstraint& bending = sheet.bendings[b];
        if (bending.stiffness > 0 && (distance_at[b] >= 0) == paired)
          add({distance_at[b], static_cast<int>(b)},
              {bending.edge_a, bending.edge_b, bending.wing_a, bending.wing_b});
      }
    };
    first_of_[kHingedEdge] = count();
    add_bendings(true);
    first_of_[kTriangle] = count();
    for (std::size_t t = 0; t < sheet.triangles.size(); ++t) {
      const auto [i, j, k] = sheet.triangles[t].vertices;
      if (sheet.triangles[t].stiffness > 0) add({static_cast<int>(t), -1}, {i, j, k});
    }
    first_of_[kBending] = count();
    add_bendings(false);
  }

  std::size_t count() const { return sources_.size(); }
  std::span<const int> vertices(std::size_t c) const {
    return std::span(vertices_).subspan(first_[c], first_[c + 1] - first_[c]);
  }
  Kind kind(std::size_t c) const {
    int kind = kDistance;
    while (kind + 1 < kKinds && c >= first_of_[at(kind + 1)]) ++kind;
    return static_cast<Kind>(kind);
  }
  void number_vertices(const std::vector<int>& number) {
    for (int& v : vertices_) v = number[at(v)];
  }

  const DistanceConstraint& distance(std::size_t c) const {
    return sheet_.distances[at(sources_[c][0])];
  }
  const TriangleConstraint& triangle(std::size_t c) const {
    return sheet_.triangles[at(sources_[c][0])];
  }
  const BendingConstraint& bending(std::size_t c) const {
    return sheet_.bendings[at(sources_[c][1])];
  }

 private:
  void add(const std::array<int, 2>& source, std::initializer_list<int> vertices) {
    sources_.push_back(source);
    vertices_.insert(vertices_.end(), vertices);
    first_.push_back(vertices_.size());
  }

  /// The distance along the edge of each bending, -1: none.
  std::vector<int> pair_up() const {
    std::vector<int> first(sheet_.positions.size() + 1, 0);  // by a distance's lower vertex
    for (const DistanceConstraint& d : sheet_.distances) ++first[at(std::min(d.i, d.j)) + 1];
    std::partial_sum(first.begin(), first.end(), first.begin());
    std::vector<int> sorted(sheet_.distances.size());
    std::vector<int> next(first.begin(), first.end() - 1);
    for (std::size_t d = 0; d < sheet_.distances.size(); ++d)
      sorted[at(next[at(std::min(sheet_.distances[d].i, sheet_.distances[d].j))]++)] =
          static_cast<int>(d);
    std::vector<int> pair(sheet_.bendings.size(), -1);
    for (std::size_t b = 0; b < pair.size(); ++b) {
      const BendingConstraint& bending = sheet_.bendings[b];
      if (!(bending.stiffness > 0)) continue;
      const auto [low, high] = std::minmax(bending.edge_a, bending.edge_b);
      for (int n = first[at(low)]; n < first[at(low) + 1]; ++n) {
        int& d = sorted[at(n)];  // -1 once it is taken
        if (d < 0) continue;
        const DistanceConstraint& distance = sheet_.distances[at(d)];
        if (!(distance.stiffness > 0) || std::max(distance.i, distance.j) != high) continue;
        pair[b] = std::exchange(d, -1);
        break;
      }
    }
    return pair;
  }

  const Sheet& sheet_;
  std::vector<std::array<int, 2>> sources_;  // distance or triangle, and bending
  std::vector<std::size_t> first_{0};
  std::vector<int> vertices_;
  std::array<std::size_t, kKinds> first_of_{};
};

/// Breadth-first walk of one connected piece.
class Walk {
 public:
  Walk(const Constraints& constraints, std::size_t vertex_count)
      : constraints_(constraints),
        first_(vertex_count + 1, 0),
        vertex_walk_(vertex_count, -1),
        constraint_walk_(constraints.count(), -1) {
    for (std::size_t c = 0; c < constraints.count(); ++c)
      for (const int v : constraints.vertices(c)) ++first_[at(v) + 1];
    std::partial_sum(first_.begin(), first_.end(), first_.begin());
    at_vertex_.resize(at(first_.back()));
    std::vector<int> next(first_.begin(), first_.end() - 1);
    for (std::size_t c = 0; c < constraints.count(); ++c)
      for (const int v : constraints.vertices(c))
        at_vertex_[at(next[at(v)]++)] = static_cast<int>(c);
  }

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
    for (int k = first_[at(vertex)]; k < first_[at(vertex) + 1]; ++k) {
      const int c = at_vertex_[at(k)];
      if (std::exchange(constraint_walk_[at(c)], walk_) == walk_) continue;
      for (const int v : constraints_.vertices(at(c))) visit(v, order);
    }
  }

  const Constraints& constraints_;
  std::vector<int> first_, at_vertex_;  // constraints by vertex
  std::vector<int> vertex_walk_, constraint_walk_;
  int walk_ = -1;
};

/// Where each block begins, and the total at the end; `order` is filled with the sheet's vertices.
std::vector<int> blocks_of_levels(const Constraints& constraints, std::size_t vertex_count,
                                  std::vector<int>& order) {
  Walk walk(constraints, vertex_count);
  std::vector<int> levels, scratch, scratch_levels;
  order.reserve(vertex_count);
  for (int v = 0; v < static_cast<int>(vertex_count); ++v) {
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

/// Hands out constraints batch by batch. They are coloured so that none of a colour share a vertex:
/// batches of one colour do not wait for one another. What is left of the colours fills batches
/// together.
class Packing {
 public:
  Packing(const Constraints& constraints, std::size_t vertex_count)
      : constraints_(constraints), used_(vertex_count, 0) {}

  /// emit(constraints of a batch), at most kLanes.
  template <class Emit>
  void pack(std::span<const int> constraints, const Emit& emit) {
    left_.clear();
    rest_.assign(constraints.begin(), constraints.end());
    while (!rest_.empty()) {  // more than one round only where 64 constraints meet at a vertex
      colour();
      for (std::vector<int>& colour : colours_) {
        std::size_t taken = 0;
        for (; taken + kLanes <= colour.size(); taken += kLanes)
          emit(std::span(colour).subspan(taken, kLanes));
        left_.insert(left_.end(), colour.begin() + static_cast<std::ptrdiff_t>(taken),
                     colour.end());
        colour.clear();
      }
      rest_.swap(later_);
    }
    pack_leftovers(emit);
  }

 private:
  static constexpr int kColours = 64;

  /// Bits of the colours at its vertices.
  std::uint64_t used_beside(int c) const {
    std::uint64_t used = 0;
    for (const int v : constraints_.vertices(at(c))) used |= used_[at(v)];
    return used;
  }
  void use(int c, int colour) {
    for (const int v : constraints_.vertices(at(c))) used_[at(v)] |= std::uint64_t{1} << colour;
  }
  void release(std::span<const int> constraints, std::uint64_t colours) {
    for (const int c : constraints)
      for (const int v : constraints_.vertices(at(c))) used_[at(v)] &= ~colours;
  }

  void colour() {
    later_.clear();
    for (const int c : rest_) {
      const int colour = std::countr_one(used_beside(c));
      (colour == kColours ? later_ : colours_[at(colour)]).push_back(c);
      if (colour < kColours) use(c, colour);
    }
    release(rest_, ~std::uint64_t{0});
  }

  template <class Emit>
  void pack_leftovers(const Emit& emit) {
    for (const int c : left_) {
      const int open = std::min(std::countr_one(used_beside(c)), kColours - 1);
      std::vector<int>& batch = colours_[at(open)];
      const std::uint64_t bit = std::uint64_t{1} << open;
      const auto close = [&] {
        emit(std::span(batch));
        release(batch, bit);
        batch.clear();
      };
      if (used_beside(c) & bit) close();  // all are taken at its vertices
      use(c, open);
      batch.push_back(c);
      if (batch.size() == kLanes) close();
    }
    for (std::vector<int>& batch : colours_) {
      if (!batch.empty()) emit(std::span(batch));
      batch.clear();
    }
    release(left_, ~std::uint64_t{0});
  }

  const Constraints& constraints_;
  std::vector<std::uint64_t> used_;
  std::array<std::vector<int>, kColours> colours_;
  std::vector<int> rest_, later_, left_;
};

/// Constraints sorted by task (2 block for within it, 2 block + 1 for between it and the next) and
/// kind, then by place.
struct Sorted {
  std::vector<int> constraints;
  std::vector<std::size_t> first;  // by task and kind

  std::span<const int> of(std::size_t task, Kind kind) const {
    const std::size_t n = kKinds * task + kind;
    return std::span(constraints).subspan(first[n], first[n + 1] - first[n]);
  }
};

Sorted sort_by_task(const Constraints& constraints, const std::vector<int>& block,
                    std::size_t tasks) {
  struct Key {
    std::size_t group;
    int lowest;
  };
  std::vector<Key> keys(constraints.count());
  std::vector<int> count(block.size() + 1, 0);
  Sorted sorted;
  sorted.first.assign(kKinds * tasks + 1, 0);
  for (std::size_t c = 0; c < keys.size(); ++c) {
    const std::span<const int> vertices = constraints.vertices(c);
    const auto [lowest, highest] = std::minmax_element(vertices.begin(), vertices.end());
    const int low_block = block[at(*lowest)], high_block = block[at(*highest)];
    const std::size_t task = 2 * at(low_block) + (high_block > low_block ? 1 : 0);
    keys[c] = {kKinds * task + constraints.kind(c), *lowest};
    ++count[at(*lowest) + 1];
    ++sorted.first[keys[c].group + 1];
  }
  // A counting sort by place, then one by group that keeps the places' order.
  std::partial_sum(count.begin(), count.end(), count.begin());
  std::partial_sum(sorted.first.begin(), sorted.first.end(), sorted.first.begin());
  std::vector<int> by_place(keys.size());
  for (std::size_t c = 0; c < keys.size(); ++c)
    by_place[at(count[at(keys[c].lowest)]++)] = static_cast<int>(c);
  sorted.constraints.resize(keys.size());
  std::vector<std::size_t> next(sorted.first.begin(), sorted.first.end() - 1);
  for (int c : by_place) sorted.constraints[next[keys[at(c)].group]++] = c;
  return sorted;
}

void set(Springs& springs, std::size_t lane, double rest, double stiffness) {
  const auto compliance = static_cast<float>(1 / stiffness);
  if (!(compliance >= std::numeric_limits<float>::min()) ||
      compliance > std::numeric_limits<float>::max())
    throw std::invalid_argument("a stiffness of " + std::to_string(stiffness) +
                                " is beyond 3e-39 to 8e37 N/mm (N mm for bending)");
  springs.rest[lane] = rest;
  springs.compliance[lane] = compliance;
  springs.force[lane] = 0;
}

void set(DistanceBatch& batch, std::size_t lane, const Constraints& all, std::size_t c) {
  set(batch.length, lane, all.distance(c).rest_length, all.distance(c).stiffness);
}

void set(BendingBatch& batch, std::size_t lane, const Constraints& all, std::size_t c) {
  set(batch.fold, lane, all.bending(c).rest_angle, all.bending(c).stiffness);
}

void set(HingedEdgeBatch& batch, std::size_t lane, const Constraints& all, std::size_t c) {
  set(batch.length, lane, all.distance(c).rest_length, all.distance(c).stiffness);
  set(batch.fold, lane, all.bending(c).rest_angle, all.bending(c).stiffness);
}

void set(TriangleBatch& batch, std::size_t lane, const Constraints& all, std::size_t c) {
  const TriangleConstraint& t = all.triangle(c);
  batch.along[lane] = 1 / t.base;
  batch.skew[lane] = t.foot / (t.base * t.height);
  batch.across[lane] = 1 / t.height;
  batch.weight[lane] = shear_modulus(t) * 0.5 * t.base * t.height;
  batch.bulk[lane] = 2 * (1 + t.poisson_ratio) / (3 * (1 - 2 * t.poisson_ratio));
  batch.force[lane] = 0;
}

/// Appends a task's constraints of one kind.
template <class Batch>
Task::Range append(const Constraints& all, std::span<const int> constraints, Packing& packing,
                   std::vector<Batch>& batches) {
  const std::size_t first = batches.size();
  packing.pack(constraints, [&](std::span<const int> packed) {
    Batch& batch = batches.emplace_back();
    for (std::size_t lane = 0; lane < kLanes; ++lane) {
      const std::size_t c = at(packed[lane < packed.size() ? lane : 0]);
      set(batch, lane, all, c);
      for (std::size_t k = 0; k < batch.vertex.size(); ++k)
        batch.vertex[k][lane] = all.vertices(c)[k];
    }
  });
  return {first, batches.size()};
}

}  // namespace

Layout make_layout(const Sheet& sheet) {
  Layout layout;
  Constraints constraints(sheet);
  const std::size_t count = sheet.positions.size();
  const std::vector<int> blocks = blocks_of_levels(constraints, count, layout.original);
  const std::size_t tasks = blocks.size() < 2 ? 0 : 2 * (blocks.size() - 1);
  layout.number.resize(count);
  std::vector<int> block(count);
  for (std::size_t k = 0, b = 0; k < count; ++k) {
    while (static_cast<int>(k) >= blocks[b + 1]) ++b;
    layout.number[at(layout.original[k])] = static_cast<int>(k);
    block[k] = static_cast<int>(b);
  }
  constraints.number_vertices(layout.number);
  const Sorted sorted = sort_by_task(constraints, block, tasks);
  Packing packing(constraints, count);
  for (std::size_t t = 0; t < tasks; ++t) {
    const auto batches = [&](Kind kind, auto& all) {
      return append(constraints, sorted.of(t, kind), packing, all);
    };
    (t % 2 == 0 ? layout.within : layout.between)
        .push_back({batches(kDistance, layout.distances), batches(kHingedEdge, layout.hinged_edges),
                    batches(kTriangle, layout.triangles), batches(kBending, layout.bendings)});
  }
  layout.distances.shrink_to_fit();
  layout.hinged_edges.shrink_to_fit();
  layout.triangles.shrink_to_fit();
  layout.bendings.shrink_to_fit();
  return layout;
}

ConstBatches share_of(const Layout& layout, std::size_t n, std::size_t count) {
  const auto part = [&](const auto& batches) {
    const std::size_t first = batches.size() * n / count, last = batches.size() * (n + 1) / count;
    return std::span(batches).subspan(first, last - first);
  };
  return {part(layout.distances), part(layout.hinged_edges), part(layout.triangles),
          part(layout.bendings)};
}

}  // namespace vstent::xpbd
