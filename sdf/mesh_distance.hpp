// Exact distances to a triangle mesh, through a tree of its triangles.
#pragma once

#include "sdf/box_tree.hpp"

namespace vstent::sdf {

/// Closest point of triangle (a, b, c) to x.
Vec3 closest_point_on_triangle(const Vec3& x, const Vec3& a, const Vec3& b, const Vec3& c);

/// Nearest-point queries on a triangle mesh (copied). Immutable: any number of threads may read it.
class MeshDistance {
 public:
  struct Closest {
    int triangle = -1;  ///< -1: nothing within the limit
    Vec3 point = Vec3::Zero();
    double distance = 0;  ///< mm, unsigned
  };
  explicit MeshDistance(const TriangleMesh& mesh);
  Closest closest(const Vec3& x, double limit = std::numeric_limits<double>::infinity()) const;
  /// Generalised winding number: about 1 inside a closed outward surface, 0 outside; graded across
  /// open ends. Visits every triangle: for a few thousand queries, not for every voxel.
  double winding_number(const Vec3& x) const;
  const BoxTree& tree() const { return tree_; }

 private:
  TriangleMesh mesh_;
  BoxTree tree_;
};

}  // namespace vstent::sdf
