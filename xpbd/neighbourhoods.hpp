// Cuts a graph of points into neighbourhoods of about one size.
#pragma once

#include <span>
#include <utility>
#include <vector>

namespace vstent::xpbd {

/// An undirected graph: the neighbours of each vertex with the edges' lengths (mm).
struct Graph {
  struct End {
    int vertex = 0;
    double length = 0;
  };
  std::vector<int> first;  ///< of each vertex in `ends`, and the total at the end
  std::vector<End> ends;
  double mean_length = 0;  ///< mm
};

struct GraphEdge {
  int i = 0, j = 0;
  double length = 0;
};

Graph make_graph(std::size_t vertices, std::span<const GraphEdge> edges);

struct Neighbourhoods {
  std::vector<int> home;   ///< by vertex: its neighbourhood, -1: none
  std::vector<int> seeds;  ///< by neighbourhood: the vertex it grew from
};

/// Seeds are taken in `order` wherever the last one is further than `spacing` (mm, along edges)
/// away; every vertex of `order` joins the nearest seed. Vertices that are not in `order` have no
/// part in it.
Neighbourhoods find_neighbourhoods(const Graph& graph, std::span<const int> order, double spacing);

}  // namespace vstent::xpbd
