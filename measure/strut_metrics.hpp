// How a strut design lies in the vessel: apposition, prolapse, penetration; measured on the written
// surface and on the placed struts.
#pragma once

#include <array>
#include <nlohmann/json_fwd.hpp>
#include <span>

#include "sdf/solid.hpp"
#include "stents/place.hpp"

namespace vstent::measure {

/// Shares are of the length of all struts, connectors and wires, or of the area of a surface's
/// outer side. Lengths in mm.
struct StrutMetrics {
  double strut_length = 0;  ///< of all centre lines; 0 for a surface
  double outer_area = 0;    ///< mm^2, of a surface; 0 for struts
  /// Gap from the outer face of the metal to the wall beyond it, along the way out from the axis.
  double mean_gap = 0, largest_gap = 0;
  std::array<double, 4> share_with_gap{};  ///< above kGaps
  double share_over_openings = 0;          ///< no wall within a stent radius: an ostium or an end
  /// How far the wall comes inside the stent's outer surface between struts.
  double mean_prolapse = 0, largest_prolapse = 0;
  /// Of any vertex, edge or triangle of the wall into metal, by the exact distance.
  double deepest_penetration = 0;
};

/// mm. An abluminal gap is a strut that optical coherence tomography calls malapposed; clinical
/// series count from a tenth of a millimetre on.
inline constexpr std::array<double, 4> kGaps{0.01, 0.1, 0.2, 0.4};

/// Gaps between metal and wall, each weighed by the length or the area that it stands for.
struct GapSums {
  double all = 0, in_vessel = 0, over_openings = 0, sum = 0, largest = 0;
  std::array<double, kGaps.size()> above{};
  void add(double gap, double weight);  ///< infinite where there is no wall
  void put_into(StrutMetrics& metrics) const;
};

/// Mean and largest depth of the wall inside the stent's outer surface; gives back those samples
/// that metal up to `near` (mm) below that surface could reach.
std::vector<Vec3> put_prolapse(std::span<const Vec3> samples, std::span<const double> depths,
                               double near, StrutMetrics& metrics);

/// The stent's axis and outer radii, proximal to distal.
struct StentEnvelope {
  Polyline axis;
  std::vector<double> radii;
};

/// `wall_triangles`: 1 for those of the patch that may have moved.
StrutMetrics measure_struts(const TriangleMesh& wall, std::span<const char> wall_triangles,
                            const stents::PlacedStent& struts, const sdf::Solid& metal,
                            const StentEnvelope& envelope);

nlohmann::ordered_json to_json(const StrutMetrics& metrics);

}  // namespace vstent::measure
