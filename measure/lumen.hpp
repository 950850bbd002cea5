// Is the vessel open? Diameters, areas and stenosis of a profile.
#pragma once

#include "measure/profile.hpp"

namespace vstent::measure {

/// Diameters are equivalent diameters in mm unless said otherwise, areas mm2. Sections that run
/// into a branch do not count. `treated`: the stations in the stent.
struct LumenMetrics {
  std::vector<Station> stations;
  double treated_from = 0, treated_to = 0;                 ///< arc length along the way, mm
  double narrowest_before = 0, narrowest_after = 0;        ///< in the treated length
  double narrowest_before_at = 0, narrowest_after_at = 0;  ///< arc length, mm
  std::optional<double> min_area_before, min_area_after;   ///< 5 mm beyond the treated length too
  std::optional<double> min_stent_area;
  std::optional<double> reference_proximal, reference_distal;  ///< largest in the landing zone
  double reference_diameter = 0;  ///< the smaller of the two; 0: neither can be measured
  std::optional<double> stenosis_before, stenosis_after;            ///< % of the reference diameter
  std::optional<double> area_stenosis_before, area_stenosis_after;  ///< % of its area
  std::optional<double> volume_before, volume_after;                ///< of the treated length, mm3
  std::optional<double> symmetry_after;  ///< smallest min / max diameter in the treated length
  /// Where the lumen was narrower than its target: mean equivalent diameter over target, smallest
  /// diameter of any direction (mm), and the share of the stented length that is so.
  double opened_mean_over_target = 0, opened_min_diameter = 0, opened_share = 0;
  /// % of the nominal diameter, mean and smallest over the stent; % of the mean reference area.
  std::optional<double> expansion_mean, expansion_min, expansion_of_reference;
  bool has_target = false;
};

/// Takes the profile's stations, which say which of them are in the stent.
LumenMetrics measure_lumen(std::vector<Station> stations);

}  // namespace vstent::measure
