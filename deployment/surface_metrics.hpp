// How a stent's surface lies in the vessel: what strut_metrics.hpp is for struts.
#pragma once

#include "deployment/surface_design.hpp"
#include "measure/strut_metrics.hpp"
#include "stents/surface_map.hpp"

namespace vstent::deployment {

using measure::StentEnvelope;
using measure::StrutMetrics;

/// Shares are of the area of the outer surface, `outer_area`; gaps are looked for from half the
/// metal's thickness below it. Depths of the wall in the metal are exact distances to the surface
/// as `map` places it. \param wall_triangles 1 for those of the patch that may have moved
StrutMetrics measure_surface(const TriangleMesh& wall, std::span<const char> wall_triangles,
                             const SurfaceDesign& design, const stents::SurfaceMap& map,
                             const StentEnvelope& envelope);

}  // namespace vstent::deployment
