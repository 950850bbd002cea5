#include "meshing/edge_graph.hpp"

#include <cmath>
#include <functional>
#include <queue>

#include "vessels/half_edges.hpp"

namespace vstent::meshing {

EdgeGraph::EdgeGraph(std::size_t points, std::span<const std::array<int, 2>> ends,
                     std::span<const double> lengths)
    : begin_(points + 1, 0), to_(2 * ends.size()) {
  for (const auto& edge : ends)
    for (const int p : edge) ++begin_[static_cast<std::size_t>(p) + 1];
  for (std::size_t p = 0; p < points; ++p) begin_[p + 1] += begin_[p];
  std::vector<std::size_t> place(begin_.begin(), begin_.end() - 1);
  for (std::size_t e = 0; e < ends.size(); ++e) {
    const auto [a, b] = ends[e];
    to_[place[static_cast<std::size_t>(a)]++] = {b, lengths[e]};
    to_[place[static_cast<std::size_t>(b)]++] = {a, lengths[e]};
  }
}

EdgeGraph::EdgeGraph(const TriangleMesh& mesh)
    : EdgeGraph([&] {
        std::vector<std::array<int, 2>> ends;
        std::vector<double> lengths;
        const auto edges = vessels::sorted_half_edges(mesh);
        vessels::for_each_edge(edges, [&](std::size_t begin, std::size_t) {
          const auto& e = edges[begin];
          ends.push_back({e.low, e.high});
          lengths.push_back((mesh.points[static_cast<std::size_t>(e.low)] -
                             mesh.points[static_cast<std::size_t>(e.high)])
                                .norm());
        });
        return EdgeGraph(mesh.points.size(), ends, lengths);
      }()) {}

std::span<const std::pair<int, double>> EdgeGraph::neighbours(int point) const {
  const auto p = static_cast<std::size_t>(point);
  return {to_.data() + begin_[p], begin_[p + 1] - begin_[p]};
}

void EdgeGraph::spread(std::vector<double>& values, double slope) const {
  using Entry = std::pair<double, int>;
  std::priority_queue<Entry, std::vector<Entry>, std::greater<>> queue;
  for (std::size_t p = 0; p < values.size(); ++p)
    if (std::isfinite(values[p])) queue.emplace(values[p], static_cast<int>(p));
  while (!queue.empty()) {
    const auto [value, p] = queue.top();
    queue.pop();
    if (value > values[static_cast<std::size_t>(p)]) continue;
    for (const auto& [q, length] : neighbours(p)) {
      const double reached = value + slope * length;
      if (reached >= values[static_cast<std::size_t>(q)]) continue;
      values[static_cast<std::size_t>(q)] = reached;
      queue.emplace(reached, q);
    }
  }
}

}  // namespace vstent::meshing
