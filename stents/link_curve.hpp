// Connectors: curves of a given length between two places of a cone.
#pragma once

#include <vector>

#include "stents/parameters.hpp"
#include "stents/pattern.hpp"

namespace vstent::stents {

/// Points from `from` to `to` whose line has the length `length` (mm, of pattern.hpp's arc_length);
/// a straight one is the straight line whatever its length.
/// u: a half circle aside in its middle, on legs where it must be deep. n: three limbs, the outer
/// ones half as long as the middle one along the circumference, rounded where they join. s: a cubic
/// with horizontal ends. All solved for their width. `chords` is the number of pieces.
/// \throws std::invalid_argument a length shorter than the distance, saying both
std::vector<PatternPoint> link_curve(Link shape, const PatternPoint& from, const PatternPoint& to,
                                     double length, int chords);

/// Length (mm) of the piece between two points of a cone, radius, angle and z linear along it.
double cone_length(const PatternPoint& a, const PatternPoint& b);

}  // namespace vstent::stents
