#include "xpbd/surface_cells.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <iterator>
#include <numeric>

#include "xpbd/neighbourhoods.hpp"
#include "xpbd/parallel.hpp"

namespace vstent::xpbd {
namespace {

// Cells that are beside each other, and those that are if they face the same way (a cosine): for
// them to meet, a wall would have to fold over a few of its thicknesses.
constexpr int kBesideRings = 2, kRings = 5;
constexpr double kSameWay = 0.5;

std::vector<SurfaceCells::Edge> edges_of(std::span<const Triangle> triangles) {
  std::vector<SurfaceCells::Edge> edges;
  edges.reserve(3 * triangles.size());
  for (const Triangle& t : triangles)
    for (std::size_t k = 0; k < 3; ++k) {
      const auto [i, j] = std::minmax(t[k], t[(k + 1) % 3]);
      edges.push_back({i, j});
    }
  std::sort(edges.begin(), edges.end());
  edges.erase(std::unique(edges.begin(), edges.end()), edges.end());
  return edges;
}

void sort_out_copies(std::vector<int>& items) {
  std::sort(items.begin(), items.end());
  items.erase(std::unique(items.begin(), items.end()), items.end());
}

// Of a uniform grid: 21 bits each, wrapping. Places that share a key by wrapping cost time, not
// truth.
std::uint64_t key_of(const Eigen::Matrix<std::int64_t, 3, 1>& place) {
  constexpr std::uint64_t kMask = (1u << 21) - 1;
  const auto bits = [&](int axis) { return static_cast<std::uint64_t>(place[axis]) & kMask; };
  return bits(0) << 42 | bits(1) << 21 | bits(2);
}

}  // namespace

std::span<const int> SurfaceCells::Lists::of(int cell) const {
  const auto begin = static_cast<std::size_t>(first[at(cell)]);
  return std::span(items).subspan(begin, static_cast<std::size_t>(first[at(cell) + 1]) - begin);
}

SurfaceCells::Lists SurfaceCells::gathered(std::size_t cells, std::span<const int> cell_of_item) {
  Lists lists;
  lists.first.assign(cells + 1, 0);
  for (const int cell : cell_of_item) ++lists.first[at(cell) + 1];
  for (std::size_t c = 1; c <= cells; ++c) lists.first[c] += lists.first[c - 1];
  lists.items.resize(cell_of_item.size());
  std::vector<int> next(lists.first.begin(), lists.first.end() - 1);
  for (std::size_t i = 0; i < cell_of_item.size(); ++i)
    lists.items[at(next[at(cell_of_item[i])]++)] = static_cast<int>(i);
  return lists;
}

SurfaceCells::SurfaceCells(std::span<const Slot> rest, std::span<const Triangle> triangles,
                           double spacing)
    : edges_(edges_of(triangles)), corners_(triangles.begin(), triangles.end()) {
  std::vector<GraphEdge> lengths;
  for (const auto& [i, j] : edges_)
    lengths.push_back({i, j, (place(rest[at(i)]) - place(rest[at(j)])).norm()});
  const Graph graph = make_graph(rest.size(), lengths);
  mean_edge_ = graph.mean_length;
  std::vector<int> order(rest.size());
  std::iota(order.begin(), order.end(), 0);
  const Neighbourhoods found = find_neighbourhoods(graph, order, spacing);
  const std::vector<int>& home = found.home;
  const std::size_t cells = found.seeds.size();

  std::vector<int> of_edge, of_triangle;
  std::vector<std::vector<int>> next_to(cells), reached(cells);
  for (std::size_t v = 0; v < home.size(); ++v) reached[at(home[v])].push_back(static_cast<int>(v));
  for (const auto& [i, j] : edges_) {
    const int a = home[at(i)], b = home[at(j)];
    of_edge.push_back(a);
    reached[at(a)].push_back(j);
    if (a == b) continue;
    next_to[at(a)].push_back(b);
    next_to[at(b)].push_back(a);
  }
  for (const Triangle& t : triangles) {
    of_triangle.push_back(home[at(t[0])]);
    for (const int v : t) reached[at(of_triangle.back())].push_back(v);
  }
  vertices_ = gathered(cells, home);
  edges_of_ = gathered(cells, of_edge);
  triangles_of_ = gathered(cells, of_triangle);
  reached_.first.push_back(0);
  for (std::vector<int>& of_one : reached) {
    sort_out_copies(of_one);
    reached_.items.insert(reached_.items.end(), of_one.begin(), of_one.end());
    reached_.first.push_back(static_cast<int>(reached_.items.size()));
  }
  for (std::vector<int>& of_one : next_to) sort_out_copies(of_one);
  beside_.resize(cells);
  centres_.resize(cells);
  facing_.resize(cells);
  radii_.resize(cells);
  place_at(rest);
  for_each_particle(cells, [&](std::size_t c, std::size_t) {
    std::vector<int> seen{static_cast<int>(c)}, rim = seen, next;
    std::vector<int>& near = beside_[c] = seen;
    for (int ring = 1; ring <= kRings; ++ring) {
      next.clear();
      for (const int cell : rim)
        next.insert(next.end(), next_to[at(cell)].begin(), next_to[at(cell)].end());
      sort_out_copies(next);
      rim.clear();
      std::set_difference(next.begin(), next.end(), seen.begin(), seen.end(),
                          std::back_inserter(rim));
      seen.insert(seen.end(), rim.begin(), rim.end());
      std::sort(seen.begin(), seen.end());
      for (const int cell : rim)
        if (ring <= kBesideRings || facing_[at(cell)].dot(facing_[c]) > kSameWay)
          near.push_back(cell);
    }
    std::sort(near.begin(), near.end());
  });
}

void SurfaceCells::place_at(std::span<const Slot> particles) {
  side_by_side(size(), [&](std::size_t c) {
    Box box;
    for (const int v : reached(static_cast<int>(c))) box.include(place(particles[at(v)]));
    centres_[c] = 0.5 * (box.lower + box.upper);
    double squared = 0;
    for (const int v : reached(static_cast<int>(c)))
      squared = std::max(squared, (place(particles[at(v)]) - centres_[c]).squaredNorm());
    radii_[c] = std::sqrt(squared);
    Vec3 normal = Vec3::Zero();
    for (const int t : triangles(static_cast<int>(c))) {
      const Triangle& corner = corners_[at(t)];
      const Vec3 first = place(particles[at(corner[0])]);
      normal +=
          (place(particles[at(corner[1])]) - first).cross(place(particles[at(corner[2])]) - first);
    }
    facing_[c] = normal.normalized();
  });
}

double SurfaceCells::gap(int a, int b) const {
  return (centres_[at(a)] - centres_[at(b)]).norm() - radii_[at(a)] - radii_[at(b)];
}

bool SurfaceCells::back_to_back(int a, int b) const {
  const Vec3 across = centres_[at(b)] - centres_[at(a)];
  return facing_[at(a)].dot(across) < 0 && facing_[at(b)].dot(across) > 0;
}

bool SurfaceCells::beside(int a, int b) const {
  return std::binary_search(beside_[at(a)].begin(), beside_[at(a)].end(), b);
}

std::vector<std::pair<int, int>> SurfaceCells::meetings(double reach) const {
  if (size() == 0) return {};
  using Place = Eigen::Matrix<std::int64_t, 3, 1>;
  const double side = 2 * *std::max_element(radii_.begin(), radii_.end()) + reach;
  const auto place_of = [&](std::size_t c) {
    return Place((centres_[c] / side).array().floor().cast<std::int64_t>());
  };
  std::vector<std::pair<std::uint64_t, int>> grid;
  for (std::size_t c = 0; c < size(); ++c)
    grid.emplace_back(key_of(place_of(c)), static_cast<int>(c));
  std::sort(grid.begin(), grid.end());
  std::vector<std::vector<int>> met(size());
  for_each_particle(size(), [&](std::size_t c, std::size_t) {
    const int cell = static_cast<int>(c);
    const Place here = place_of(c);
    for (int step = 0; step < 27; ++step) {
      const std::uint64_t key = key_of(here + Place(step % 3 - 1, step / 3 % 3 - 1, step / 9 - 1));
      // Only the later one of a pair looks for the other.
      for (auto entry = std::lower_bound(grid.begin(), grid.end(), std::pair(key, 0));
           entry != grid.end() && entry->first == key && entry->second < cell; ++entry)
        if (gap(entry->second, cell) <= reach && !beside(cell, entry->second))
          met[c].push_back(entry->second);
    }
    sort_out_copies(met[c]);
  });
  std::vector<std::pair<int, int>> pairs;
  for (std::size_t c = 0; c < size(); ++c)
    for (const int other : met[c]) pairs.emplace_back(other, static_cast<int>(c));
  std::sort(pairs.begin(), pairs.end());
  return pairs;
}

}  // namespace vstent::xpbd
