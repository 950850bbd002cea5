// The lumen's outlines at the stations of the profile.
#pragma once

#include <nlohmann/json.hpp>

#include "vessels/file_arrays.hpp"

namespace vstent::report {

/// Outlines (closed, the first point not repeated) of `before` and `after` at the stations that
/// metrics.json lists, normal to the centerline where case.json places the stent. Line arrays:
/// Station, the index into the list, and After, 0 or 1. A section that is open there is left out.
/// For folders without sections.vtp; empty when the folder does not say where the stations are.
vessels::PolylineFile cut_outlines(const TriangleMesh& before, const TriangleMesh& after,
                                   const std::filesystem::path& centerline,
                                   vessels::LengthUnit unit, const nlohmann::json& specification,
                                   const nlohmann::json& metrics);

}  // namespace vstent::report
