#include "deployment/wall_material.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <string>

#include "vessels/error.hpp"
#include "vessels/file_arrays.hpp"
#include "vessels/text.hpp"

namespace vstent::deployment {
namespace {

// Where a pressure-strain modulus Ep = dP D / dD is known, E = Ep R / h.
constexpr std::array kPresets{
    WallPreset{"aorta", 0.33, 0.125,
               "thoracic aorta of young adults: distensibility 5-8e-3 per mmHg, so Ep = 2 / 6.5e-3 "
               "mmHg = 41 kPa; h/R 0.125 (1.5 mm in 12 mm); remembered figures"},
    WallPreset{
        "pulmonary", 0.26, 0.1,
        "proximal pulmonary arteries by intravascular ultrasound, controls: Ep 198 +/- 19 mmHg "
        "(26.4 kPa); 720 +/- 64 mmHg, E 0.96 MPa, in pulmonary hypertension; h/R 0.1 assumed"},
    WallPreset{
        "coronary", 1.0, 0.61,
        "13 human left anterior descending arteries: wall over outer diameter 0.189 +/- 0.014, "
        "so h/R 0.61; modulus of 0.5-2 MPa as commonly taken"},
    WallPreset{
        "carotid", 0.34, 0.23,
        "common carotid artery: Ep 60-100 kPa; h/R 0.23 (0.7 mm in 3 mm); remembered figures"},
    WallPreset{
        "iliofemoral", 1.5, 0.18,
        "femoral artery of adults below 35 years: Ep 0.26 MPa (Mozersky et al. 1972); h/R 0.18 "
        "(0.8 mm in 4.5 mm); remembered figures"},
};

/// A point array of the surface that a wall property is read from, times `unit`; whatever is no
/// positive number is refused.
std::vector<double> wall_property(const vessels::Surface& surface, const std::string& name,
                                  const char* key, double unit) {
  const vessels::Fields fields = vessels::vertex_fields(surface);
  const auto found = fields.find(name);
  const std::size_t count = surface.mesh.points.size();
  if (found == fields.end() || found->second.size() != count) {
    std::string names;
    for (const auto& [other, values] : fields)
      if (values.size() == count) names += (names.empty() ? "" : ", ") + other;
    throw Error(ExitCode::input_file,
                surface.path + ": has no point array \"" + name + "\" (" + key + "); " +
                    (names.empty() ? "it has none of one number per point" : "it has " + names));
  }
  std::vector<double> values = found->second;
  for (std::size_t v = 0; v < count; ++v) {
    if (!(values[v] > 0) || !std::isfinite(values[v]))
      throw Error(ExitCode::input_file, surface.path + ": point array \"" + name + "\" is " +
                                            vessels::number(values[v]) + " at vertex " +
                                            std::to_string(v) +
                                            "; a wall needs a positive number everywhere");
    values[v] *= unit;
  }
  return values;
}

}  // namespace

std::span<const WallPreset> wall_presets() { return kPresets; }

const WallPreset* find_wall_preset(std::string_view name) {
  const auto found = std::find_if(kPresets.begin(), kPresets.end(),
                                  [&](const WallPreset& preset) { return preset.name == name; });
  return found == kPresets.end() ? nullptr : &*found;
}

std::vector<double> wall_thickness(const vessels::Surface& surface, const Case& c) {
  return wall_property(surface, c.thickness_array, "/wall/thickness_array",
                       vessels::millimetres_per(c.unit));
}

WallMaterial wall_material(const vessels::Surface& surface, const vessels::Region& region,
                           const Case& c) {
  if (c.paper_wall()) return {};
  const auto on_patch = [&](const std::vector<double>& all) {
    std::vector<double> patch;
    for (const int v : region.vertices) patch.push_back(all[static_cast<std::size_t>(v)]);
    return patch;
  };
  WallMaterial material{std::vector<double>(region.vertices.size(), c.youngs_modulus.value_or(0)),
                        std::vector<double>(region.vertices.size(), c.thickness.value_or(0))};
  if (!c.thickness_array.empty()) material.thickness = on_patch(wall_thickness(surface, c));
  if (!c.modulus_array.empty()) {
    double unit = 1;
    for (const auto& [name, megapascals] : kModulusUnits)
      if (name == c.modulus_unit) unit = megapascals;
    material.youngs_modulus =
        on_patch(wall_property(surface, c.modulus_array, "/wall/modulus_array", unit));
  }
  return material;
}

}  // namespace vstent::deployment
