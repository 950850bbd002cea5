#include "stents/design.hpp"

#include <cstdio>
#include <stdexcept>

namespace vstent::stents {

Pattern Design::expanded(double outer_diameter) const {
  return expanded([outer_diameter](double) { return 0.5 * outer_diameter; });
}

void require_within(const Limits& limits, double outer_radius) {
  // a diameter that was computed from the limit may be off by its last bits
  if (outer_radius > 0 && 2 * outer_radius <= limits.largest_diameter * (1 + 1e-12)) return;
  char text[160];
  if (outer_radius > 0) {
    std::snprintf(text, sizeof text,
                  "a diameter of %.4g mm is more than the design's largest, %.4g mm, where its "
                  "metal is stretched straight",
                  2 * outer_radius, limits.largest_diameter);
  } else {
    std::snprintf(text, sizeof text, "the diameter must be positive, is %.4g mm", 2 * outer_radius);
  }
  throw std::invalid_argument(text);
}

}  // namespace vstent::stents
