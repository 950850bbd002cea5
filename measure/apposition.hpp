// Does the stent lie on the wall?
#pragma once

#include "measure/profile.hpp"
#include "sdf/level_set.hpp"

namespace vstent::measure {

/// A stent as a level set says it, in mm; its band may be narrow.
class StentBody {
 public:
  explicit StentBody(sdf::LevelSet level_set);
  const TriangleMesh& surface() const { return surface_; }
  /// Signed distances of points (mm, negative inside): the level set's within its band, beyond it
  /// that to its surface. In parallel.
  std::vector<double> distances(std::span<const Vec3> points) const;

 private:
  sdf::LevelSet level_set_;
  TriangleMesh surface_;
  sdf::MeshDistance to_surface_;
};

/// mm. Clinical series of optical coherence tomography count gaps from a tenth of a millimetre on;
/// 0.4 mm is what the European consensus of 2018 calls extensive.
inline constexpr std::array<double, 3> kAppositionGaps{0.1, 0.2, 0.4};

/// Of the stent's abluminal surface: facets that face away from the axis within 45 degrees.
struct AppositionMetrics {
  double area = 0;                         ///< mm2, abluminal, openings left out
  std::array<double, 3> share_with_gap{};  ///< % of it above kAppositionGaps
  double mean_gap = 0, largest_gap = 0;    ///< mm, to the nearest wall; 0 where it touches
  double over_openings = 0;  ///< % of the abluminal surface more than 0.1 mm from any wall, with
                             ///< none ahead within the stent's radius: an ostium or an end
  double deepest_penetration = 0;  ///< mm, of any wall vertex
};
AppositionMetrics measure_apposition(const StentBody& stent, const CutSurface& after,
                                     const Polyline& axis_after,
                                     std::span<const double> vertex_distances);

}  // namespace vstent::measure
