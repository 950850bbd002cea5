// The bulk shape of a stent, as in the paper: a tube around a curved axis, constant, tapered or
// flared at its ends.
#pragma once

#include "sdf/geometry.hpp"

namespace vstent::stents {

/// Open-cell designs follow the vessel's axis; closed-cell designs straighten it.
enum class Cell { open, closed };

/// Outer dimensions at nominal expansion, mm.
struct SmoothTube {
  double length = 0;
  double diameter = 0;         ///< at the proximal end; everywhere unless tapered or flared
  double distal_diameter = 0;  ///< a linear taper towards it; 0: as `diameter`
  double flare_diameter = 0;   ///< that both ends widen to; 0: no flare
  double flare_length = 0;     ///< over which they do, from each end
};

/// Outer radius (mm) at arc length s of the stent, 0 <= s <= length. Flares widen along half a
/// cosine.
double outer_radius(const SmoothTube& tube, double s);

/// Radii on the way from a tube of radius `start` everywhere (expansion 0) to nominal (expansion
/// 1), at arc lengths `arc`.
std::vector<double> expanded_radii(const SmoothTube& tube, const std::vector<double>& arc,
                                   double start, double expansion);

}  // namespace vstent::stents
