// How far is it along a mesh's edges?
#pragma once

#include <array>
#include <span>
#include <vector>

#include "sdf/geometry.hpp"

namespace vstent::meshing {

class EdgeGraph {
 public:
  EdgeGraph(std::size_t points, std::span<const std::array<int, 2>> ends,
            std::span<const double> lengths);
  explicit EdgeGraph(const TriangleMesh& mesh);

  /// The points joined to one, with the edges' lengths.
  std::span<const std::pair<int, double>> neighbours(int point) const;
  /// Lowers each value to the least of `slope` times the way from another point plus its value.
  void spread(std::vector<double>& values, double slope) const;

 private:
  std::vector<std::size_t> begin_;
  std::vector<std::pair<int, double>> to_;
};

}  // namespace vstent::meshing
