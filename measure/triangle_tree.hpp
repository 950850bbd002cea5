// What does a ray meet first on a mesh?
#pragma once

#include <span>

#include "sdf/box_tree.hpp"

namespace vstent::measure {

/// Triangles of a mesh in a tree. The mesh must outlive it.
class TriangleTree {
 public:
  /// `chosen`: one mark per triangle; empty: all.
  explicit TriangleTree(const TriangleMesh& mesh, std::span<const char> chosen = {});

  /// Distance along `direction` (unit) to the first triangle within `limit` of x; infinity: none.
  double ahead(const Vec3& x, const Vec3& direction, double limit) const;

 private:
  const TriangleMesh& mesh_;
  std::vector<int> triangles_;
  sdf::BoxTree tree_;
};

}  // namespace vstent::measure
