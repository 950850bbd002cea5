// A surface cut into cells, and which of them come near each other through space.
#pragma once

#include <array>
#include <span>
#include <utility>
#include <vector>

#include "sdf/geometry.hpp"
#include "xpbd/batches.hpp"

namespace vstent::xpbd {

/// Vertices, edges and triangles of a surface by cells of about one size along the surface: pairs
/// of cells are few where pairs of triangles would be many. Cells with at most one other between
/// them are beside each other, and those with up to four where they face the same way at rest: that
/// they are near is how they are made, not a meeting.
class SurfaceCells {
 public:
  using Edge = std::array<int, 2>;

  /// `spacing`: mm, of cells; no finer than the mesh.
  SurfaceCells(std::span<const Slot> rest, std::span<const Triangle> triangles, double spacing);

  std::size_t size() const { return beside_.size(); }
  const std::vector<Edge>& edges() const { return edges_; }
  double mean_edge() const { return mean_edge_; }  ///< mm, at rest

  std::span<const int> vertices(int cell) const { return vertices_.of(cell); }
  std::span<const int> edges(int cell) const { return edges_of_.of(cell); }
  std::span<const int> triangles(int cell) const { return triangles_of_.of(cell); }
  /// Those and the ends of the cell's edges and triangles.
  std::span<const int> reached(int cell) const { return reached_.of(cell); }

  /// Takes the cells to where the particles are.
  void place_at(std::span<const Slot> particles);
  /// mm between the balls around two cells; negative where they overlap.
  double gap(int a, int b) const;
  /// Pairs (a < b), sorted, of cells that are not beside each other, no further than `reach` (mm)
  /// apart: from a uniform grid over the centres.
  std::vector<std::pair<int, int>> meetings(double reach) const;
  /// Whether two cells face away from each other: they see each other from within the vessel.
  bool back_to_back(int a, int b) const;

 private:
  struct Lists {
    std::vector<int> first, items;
    std::span<const int> of(int cell) const;
  };
  static Lists gathered(std::size_t cells, std::span<const int> cell_of_item);

  bool beside(int a, int b) const;

  std::vector<Edge> edges_;
  double mean_edge_ = 0;
  Lists vertices_, edges_of_, triangles_of_, reached_;
  std::vector<std::vector<int>> beside_;  // sorted
  std::vector<Triangle> corners_;         // by triangle
  std::vector<Vec3> centres_, facing_;
  std::vector<double> radii_;
};

}  // namespace vstent::xpbd
