// The diameters of a sweep, and the search for the one that a target asks for.
#pragma once

#include <optional>
#include <string>
#include <vector>

namespace vstent::apps {

/// "6mm:12mm:7" (first, last, how many) or "6mm,7.5mm,9mm"; in mm, rising. \throws Error (usage)
std::vector<double> parse_diameters(const std::string& text);

/// A diameter (mm) and the pressure drop (mmHg) that it leaves.
struct Trial {
  double diameter = 0, drop = 0;
};

struct Bracket {
  Trial above, below;  ///< neighbours: the drop is above the target in one, not in the next
};

/// The narrowest pair of neighbours between which the drop reaches the target; nothing where the
/// first is there already or none is. `trials` by rising diameter.
std::optional<Bracket> bracket(const std::vector<Trial>& trials, double target);

/// Where to try next, to 0.01 mm: as a power of the diameter between the two (linear in the drop
/// where one is not positive), off their ends by a tenth; nothing when they are less than 0.1 mm
/// apart.
std::optional<double> next_diameter(const Bracket& bracket, double target);

}  // namespace vstent::apps
