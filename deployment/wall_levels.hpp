// The wall at several resolutions: a coarse one grows fast, finer ones take over its shape.
#pragma once

#include <memory>
#include <span>
#include <vector>

#include "deployment/setup.hpp"
#include "deployment/wall_material.hpp"
#include "sdf/geometry.hpp"
#include "xpbd/sheet.hpp"

namespace vstent::deployment {

/// A triangulated wall; pinned vertices stay where they are.
struct WallMesh {
  std::vector<Vec3> points;  ///< mm, at rest
  std::vector<Triangle> triangles;
  std::vector<char> pinned;
  WallMaterial material;
};

/// Vertices of `fine` about `spacing` (mm, along edges) apart, joined where their neighbourhoods
/// meet: the dual of a Voronoi diagram on the surface, so that triangles are near equilateral
/// whatever the input's are.
WallMesh coarsened(const WallMesh& fine, double spacing);

/// Carries the motion of a coarse wall over to a finer one: each fine vertex goes with the point of
/// the coarse wall nearest to it at rest that faces the same way (not with a vessel beside its
/// own), and keeps its height above it.
class Prolongation {
 public:
  Prolongation(const WallMesh& coarse, const WallMesh& fine);
  /// Positions of the fine wall's vertices for those of the coarse one; pinned ones stay.
  std::vector<Vec3> operator()(std::span<const Vec3> coarse_positions) const;

 private:
  struct Anchor {
    Triangle corners{-1, -1, -1};
    Vec3 weights = Vec3::Zero();
    Vec3 offset = Vec3::Zero();  // in the frame of the coarse triangle
  };
  std::vector<Vec3> rest_;
  std::vector<Anchor> anchors_;  // of corners -1: stays
};

/// The paper's constants make another wall of every mesh, and soft contact sinks in with the edges:
/// they are solved on the patch alone.
inline bool grows_on_coarser_walls(const Case& c) {
  return !c.paper_wall() && c.contact_stiffness.value_or(0) == 0;
}

/// The edge lengths (mm) of the levels that a wall of so many vertices is solved on, from the
/// coarsest down to, but without, the wall itself; empty for walls that are coarse enough.
std::vector<double> level_spacings(std::size_t vertices, double median_edge);

/// The setup's patch as a wall.
WallMesh patch_of(const Setup& setup);

/// The wall's surface, which does not pass through itself.
xpbd::SurfaceOfWall surface_of(const WallMesh& wall);

/// Whether the wall passes through itself at rest, as coarse ones may where vessels touch.
bool crosses_itself(const WallMesh& wall);

}  // namespace vstent::deployment
