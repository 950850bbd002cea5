#include "stents/smooth_tube.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace vstent::stents {

double outer_radius(const SmoothTube& tube, double s) {
  const double distal = tube.distal_diameter > 0 ? tube.distal_diameter : tube.diameter;
  const double body =
      0.5 * (tube.diameter + (distal - tube.diameter) * std::clamp(s / tube.length, 0.0, 1.0));
  if (tube.flare_diameter <= 0 || tube.flare_length <= 0) return body;
  const double from_end = std::max(0.0, std::min(s, tube.length - s));
  if (from_end >= tube.flare_length) return body;
  const double share = 0.5 * (1 + std::cos(std::numbers::pi * from_end / tube.flare_length));
  return body + share * (0.5 * tube.flare_diameter - body);
}

std::vector<double> expanded_radii(const SmoothTube& tube, const std::vector<double>& arc,
                                   double start, double expansion) {
  std::vector<double> radii(arc.size());
  for (std::size_t i = 0; i < arc.size(); ++i) {
    radii[i] = start + expansion * (outer_radius(tube, arc[i]) - start);
  }
  return radii;
}

}  // namespace vstent::stents
