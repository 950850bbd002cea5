// How a strut design lies in the vessel: apposition, prolapse, penetration; measured on the written
// surface and on the placed struts.
#pragma once

#include <array>
#include <nlohmann/json_fwd.hpp>
#include <span>

#include "sdf/solid.hpp"
#include "stents/place.hpp"

namespace vstent::measure {

/// Shares are of the length of all struts, connectors and wires. Lengths in mm.
struct StrutMetrics {
  double strut_length = 0;  ///< of all centre lines
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
