// Cross-sections of a lumen: the closed outline of the vessel asked for, where a plane cuts the
// surface.
#pragma once

#include <optional>

#include "sdf/box_tree.hpp"
#include "sdf/geometry.hpp"

namespace vstent::vessels {

/// Where an outline crosses a mesh edge: (1 - share) p[from] + share p[to].
struct EdgeCrossing {
  int from = 0, to = 0;
  double share = 0;
  int triangle = 0;  ///< the one in which the outline runs on to its next point
};

/// One outline of a plane cut. Lengths in mm, areas in mm2.
struct Section {
  std::vector<Vec3> outline;            ///< in order, not repeated at the end
  std::vector<EdgeCrossing> crossings;  ///< where each of its points lies on the mesh
  Vec3 centroid = Vec3::Zero();         ///< of the enclosed area
  double area = 0;
  double perimeter = 0;
  double equivalent_diameter = 0;             ///< of the circle of equal area
  double min_diameter = 0, max_diameter = 0;  ///< shortest and longest chord through the centroid
};

/// Cuts one mesh many times. Immutable after construction.
class Sectioner {
 public:
  explicit Sectioner(const TriangleMesh& mesh);

  /// The closed outline around `centre`, in the plane through it, of triangles within `reach` (mm)
  /// of it: the smallest that winds around the centre. Nothing when the plane leaves the surface
  /// open there or the centre lies outside.
  std::optional<Section> cut(const Vec3& centre, const Vec3& normal, double reach) const;

  /// The same, with `reach` doubled until an outline closes or all of the mesh lies within it:
  /// nothing then means that the surface itself is open there.
  std::optional<Section> cut_within_growing_reach(const Vec3& centre, const Vec3& normal,
                                                  double reach) const;

 private:
  TriangleMesh mesh_;
  sdf::BoxTree tree_;
  Box bounds_;
};

}  // namespace vstent::vessels
