// What every stent design answers: what am I at this diameter, and how far may I go?
#pragma once

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "stents/pattern.hpp"
#include "stents/smooth_tube.hpp"

namespace vstent::stents {

/// Outer radius (mm, of the metal's outer surface) at a share, 0 proximal .. 1 distal, of the
/// stent's length. Tapers, flares and dog-boning are radius profiles.
using RadiusProfile = std::function<double(double share)>;

/// Dimensions that bound a design's use. Diameters are outer, mm.
struct Limits {
  double crimped_diameter = 0;
  double nominal_diameter = 0;
  double largest_diameter = 0;  ///< where its struts are straight around the circumference
};

/// \throws std::invalid_argument a radius (mm) that is not positive or beyond the largest diameter,
/// naming it
void require_within(const Limits& limits, double outer_radius);

/// A design of a certain size: rings, cells or wires are counted out, struts have their lengths.
/// Strut lengths are the same at every expansion.
class Design {
 public:
  virtual ~Design() = default;

  /// The straight stent with this outer radius. Below the crimped diameter the pattern is the
  /// crimped one drawn on a smaller cylinder: no stent is so small, but a simulation may start so.
  /// \throws std::invalid_argument beyond largest_diameter; the message names the limit in mm
  virtual Pattern expanded(const RadiusProfile& outer_radius) const = 0;
  Pattern expanded(double outer_diameter) const;  ///< uniform

  virtual Limits limits() const = 0;
  virtual Cell cell() const = 0;  ///< open: rings that follow the vessel; closed: straightens it
};

}  // namespace vstent::stents
