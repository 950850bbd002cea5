#include "stents/pattern.hpp"

#include <cmath>
#include <numbers>

#include "stents/link_curve.hpp"

namespace vstent::stents {

double arc_length(const Member& member) {
  const std::vector<PatternPoint>& points = member.points;
  if (points.size() < 2) return 0;
  double sum = 0;
  for (std::size_t i = 1; i < points.size(); ++i) sum += cone_length(points[i - 1], points[i]);
  if (member.closed) {
    PatternPoint again = points.front();
    again.angle = points.back().angle +
                  std::remainder(again.angle - points.back().angle, 2 * std::numbers::pi);
    sum += cone_length(points.back(), again);
  }
  return sum;
}

}  // namespace vstent::stents
