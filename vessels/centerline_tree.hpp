// Trees of axis points: how they become branches, how they are centred in a lumen, smoothed and
// evenly spaced.
#pragma once

#include "sdf/mesh_distance.hpp"
#include "vessels/centerline.hpp"

namespace vstent::vessels {

/// Points joined to their parents, parents before children; the root's parent is -1.
struct AxisTree {
  std::vector<Vec3> points;
  std::vector<double> radii;
  std::vector<int> parent;

  int add(const Vec3& point, double radius, int parent_node) {
    points.push_back(point);
    radii.push_back(radius);
    parent.push_back(parent_node);
    return static_cast<int>(points.size()) - 1;
  }
};

/// Branches between the root, the forks and the leaves; at forks the child with the largest mean
/// radius comes first.
Centerline branches_of(const AxisTree& tree);

/// The path between the ends of `guess` with the least integral of ds / distance to the wall: that
/// of the guess's stations, each moved in its normal disc, over discs that shrink from level to
/// level (dynamic programming).
Polyline centre(const Polyline& guess, const sdf::MeshDistance& wall);

/// Points along `line` from arc length `from`, `fraction` of the local distance to the wall apart;
/// both ends included.
Polyline adaptive_stations(const Polyline& line, const sdf::MeshDistance& wall, double fraction,
                           double from = 0.0);

/// Least squares: min sum |y - x|^2 ds + (width R)^6 |y'''|^2 ds along every way from the root to a
/// leaf. The trunk is shared, root and leaves stay. A bend of curvature k moves by about (width R
/// k)^6 / k, nothing else; wiggles shorter than 2 pi width R go.
void smooth(AxisTree& tree, double width);

/// Every branch on a cubic spline, at an even spacing of at most `spacing` (mm), its tangents
/// shared at forks. Radii are interpolated.
Centerline evenly_spaced(const Centerline& centerline, double spacing);

}  // namespace vstent::vessels
