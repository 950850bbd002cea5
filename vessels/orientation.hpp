// Which triangles must be turned so that neighbours agree and normals point outward?
#pragma once

#include <array>
#include <vector>

#include "sdf/geometry.hpp"

namespace vstent::vessels {

struct Orientation {
  std::vector<char> turned;  ///< per triangle
  std::size_t turned_count = 0;
  std::size_t inward_components = 0;  ///< consistent pieces that were turned as a whole
  std::vector<std::array<int, 2>>
      one_sided_edges;  ///< where a one-sided surface cannot agree with itself
};

/// Neighbours over edges of two triangles are made to agree, and so are triangles of the same
/// `polygon`; each piece is then turned to a positive volume, its open ends closed by fans to their
/// centroids. A flat piece keeps its majority.
Orientation orient(const TriangleMesh& mesh, const std::vector<int>& polygon_of_triangle);

}  // namespace vstent::vessels
