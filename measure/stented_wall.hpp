// The wall around the stent: which triangles it is, how it stretched, what it comes close to.
#pragma once

#include <optional>

#include "measure/profile.hpp"

namespace vstent::measure {

/// Triangles around the stations in the stent: their centroid's nearest place on the axis is one of
/// those, no farther than 1.1 times the farthest point of the sections there, and they do not
/// belong to a branch (see sample_profile). One mark per triangle.
std::vector<char> stented_triangles(const TriangleMesh& mesh, const Polyline& axis,
                                    const std::vector<Station>& stations, bool after,
                                    std::span<const SideBranchPoint> branches);

/// Area-weighted.
struct Percentiles {
  double p5 = 0, p50 = 0, p95 = 0, p99 = 0;
};

/// How one triangle went over into the other: F maps the edges before to those after.
struct WallStretch {
  std::vector<double> circumferential, axial;  ///< |F e| along and around the axis, per triangle
  std::vector<double> area_ratio;
  std::vector<double> largest, smallest;  ///< principal: singular values of F
};
/// Around and along `axis` (before), in each triangle's plane. 1 for triangles that did not move
/// and for those without area.
WallStretch wall_stretch(const TriangleMesh& before, std::span<const Vec3> points_after,
                         const Polyline& axis);

/// Circumferential stretches that `overstretched` counts: stated, not prescribed; none is a limit
/// of injury.
inline constexpr std::array<double, 3> kOverstretch{1.2, 1.5, 2.0};

/// Of the stented wall, weighted with areas before.
struct WallMetrics {
  double area_before = 0;  ///< mm2
  Percentiles circumferential, axial, area_ratio, largest, smallest;
  std::array<double, 3> overstretched{};  ///< % of the area above kOverstretch
};
std::optional<WallMetrics> measure_wall(const TriangleMesh& before, const WallStretch& stretch,
                                        std::span<const char> stented);

/// Distance (mm) of the stented wall to wall that is near in space only: within `within`, but
/// farther than twice that along the surface. Nothing where there is none.
std::optional<double> distance_to_neighbours(const TriangleMesh& mesh,
                                             std::span<const char> stented, double within);

}  // namespace vstent::measure
