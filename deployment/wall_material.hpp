// What the wall is made of: by the vessel it belongs to, or vertex by vertex from the surface file.
#pragma once

#include <span>
#include <string_view>
#include <utility>
#include <vector>

#include "deployment/case.hpp"
#include "vessels/region.hpp"
#include "vessels/surface.hpp"

namespace vstent::deployment {

/// Of an artery at rest, as one layer. Starting points for studies, not a patient's wall.
struct WallPreset {
  std::string_view name;
  double youngs_modulus = 0;       ///< MPa, in the physiological range
  double thickness_to_radius = 0;  ///< wall over lumen radius
  std::string_view source;         ///< and how the figures follow from it
};

std::span<const WallPreset> wall_presets();

/// Units that a vessel file's modulus may be in, and the MPa in one of each.
inline constexpr std::pair<std::string_view, double> kModulusUnits[] = {
    {"MPa", 1}, {"kPa", 1e-3}, {"Pa", 1e-6}, {"dyn/cm2", 1e-7}};

/// Null where there is none of this name.
const WallPreset* find_wall_preset(std::string_view name);

/// Per vertex of a patch; empty for the paper's wall, whose constants are of no material.
struct WallMaterial {
  std::vector<double> youngs_modulus;  ///< MPa
  std::vector<double> thickness;       ///< mm
};

/// The thickness (mm) at every vertex of the surface, from the array that the case names.
/// \throws Error (input_file) an array that is not there, or not positive everywhere
std::vector<double> wall_thickness(const vessels::Surface& surface, const Case& c);

/// \throws Error (input_file) as wall_thickness
WallMaterial wall_material(const vessels::Surface& surface, const vessels::Region& region,
                           const Case& c);

}  // namespace vstent::deployment
