#include "xpbd/neighbourhoods.hpp"

#include <functional>
#include <limits>
#include <queue>

namespace vstent::xpbd {
namespace {

std::size_t at(int index) { return static_cast<std::size_t>(index); }

}  // namespace

Graph make_graph(std::size_t vertices, std::span<const GraphEdge> edges) {
  Graph graph;
  graph.first.assign(vertices + 1, 0);
  for (const GraphEdge& e : edges) {
    ++graph.first[at(e.i) + 1];
    ++graph.first[at(e.j) + 1];
    graph.mean_length += e.length / static_cast<double>(edges.size());
  }
  for (std::size_t k = 1; k < graph.first.size(); ++k) graph.first[k] += graph.first[k - 1];
  graph.ends.resize(2 * edges.size());
  std::vector<int> next(graph.first.begin(), graph.first.end() - 1);
  for (const GraphEdge& e : edges) {
    graph.ends[at(next[at(e.i)]++)] = {e.j, e.length};
    graph.ends[at(next[at(e.j)]++)] = {e.i, e.length};
  }
  return graph;
}

Neighbourhoods find_neighbourhoods(const Graph& graph, std::span<const int> order, double spacing) {
  const std::size_t vertices = graph.first.size() - 1;
  Neighbourhoods found{std::vector<int>(vertices, -1), {}};
  std::vector<char> takes_part(vertices, 0);
  for (const int v : order) takes_part[at(v)] = 1;
  std::vector<double> distance(vertices, std::numeric_limits<double>::infinity());
  using Reached = std::pair<double, int>;
  std::priority_queue<Reached, std::vector<Reached>, std::greater<>> front;
  for (const int seed : order) {
    if (distance[at(seed)] <= spacing) continue;
    distance[at(seed)] = 0;
    front.push({0, seed});
    while (!front.empty()) {
      const auto [reached, v] = front.top();
      front.pop();
      if (reached > distance[at(v)]) continue;
      found.home[at(v)] = static_cast<int>(found.seeds.size());
      for (int e = graph.first[at(v)]; e < graph.first[at(v) + 1]; ++e) {
        const Graph::End& end = graph.ends[at(e)];
        const double there = reached + end.length;
        if (!takes_part[at(end.vertex)] || there > 2 * spacing ||
            !(there < distance[at(end.vertex)]))
          continue;
        distance[at(end.vertex)] = there;
        front.push({there, end.vertex});
      }
    }
    found.seeds.push_back(seed);
  }
  return found;
}

}  // namespace vstent::xpbd
