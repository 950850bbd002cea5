// Exact signed distance to a closed triangle mesh, and its crossings with rays: the twin of a
// voxelised mesh.
#pragma once

#include <span>

#include "sdf/mesh_distance.hpp"

namespace vstent::sdf {

/// Signs by angle-weighted pseudo-normals of the nearest corner, edge or face (Baerentzen and
/// Aanaes 2005). Immutable: any number of threads may read it.
/// \pre closed, oriented, without self-intersections; where pieces overlap, points inside may be
/// taken for outside
class SignedMeshDistance {
 public:
  explicit SignedMeshDistance(TriangleMesh mesh);
  double distance(const Vec3& x) const;  ///< mm, negative inside
  void distances(std::span<const Vec3> points, std::span<double> distances) const;  ///< in parallel
  const TriangleMesh& mesh() const { return mesh_; }

 private:
  Vec3 pseudo_normal(int triangle, const Vec3& on_it) const;

  TriangleMesh mesh_;
  MeshDistance unsigned_;
  std::vector<Vec3> face_, corner_;
  std::vector<std::array<Vec3, 3>> edge_;  // per triangle, of the edge from corner k to k + 1
};

/// Distance along `direction` (unit) from x to the first triangle of `mesh` within `limit` that
/// `tree` (its triangles' boxes) knows; infinity: none.
double first_crossing(const TriangleMesh& mesh, const BoxTree& tree, const Vec3& x,
                      const Vec3& direction, double limit);

/// The boxes of all triangles, in order.
BoxTree triangle_tree(const TriangleMesh& mesh);

}  // namespace vstent::sdf
