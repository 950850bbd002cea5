// How a design opens on a balloon: its ends first, its length as it goes, and what it gives back.
#pragma once

#include <vector>

#include "stents/design.hpp"

namespace vstent::stents {

/// A balloon opens the ends first, where nothing beside them holds. The place zeta = 2 share - 1 of
/// the stent starts at the moment delay (1 - |zeta|^sharpness), takes 1 - delay, and opens along
/// 3 x^2 - 2 x^3. Diameters are outer, mm.
struct Inflation {
  double crimped_diameter = 0, inflated_diameter = 0;
  double delay = 0.3;    ///< of the middle behind the ends, share of the whole time
  double sharpness = 3;  ///< of the step from the ends to the middle
};

/// Radii at a moment of the inflation, 0 .. 1.
RadiusProfile dog_bone(const Inflation& inflation, double moment);

/// (end diameter - middle diameter) / end diameter.
double dog_boning(const RadiusProfile& outer_radius);

/// 1 - length at `to` / length at `from`, outer diameters (mm).
double foreshortening(const Design& design, double from, double to);

/// A moment of an expansion; foreshortening counts from the crimped length.
struct ExpansionState {
  double moment = 0;
  double end_diameter = 0, middle_diameter = 0, length = 0;  ///< mm
  double dog_boning = 0, foreshortening = 0;
};

/// The states at `moments` + 1 evenly spaced moments of the inflation and one more after
/// deflation, where the diameter is the share `recoil` less.
std::vector<ExpansionState> expansion_history(const Design& design, const Inflation& inflation,
                                              int moments, double recoil);

}  // namespace vstent::stents
