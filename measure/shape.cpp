#include "measure/shape.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "sdf/polyline.hpp"
#include "stents/axis.hpp"

namespace vstent::measure {
namespace {

constexpr double kDegrees = 180 / std::numbers::pi;

double angle(const Vec3& a, const Vec3& b) { return std::atan2(a.cross(b).norm(), a.dot(b)); }

/// Of the points first..last; `reach` points beyond either end count as its edge.
Curve curve_of(const Polyline& axis, const std::vector<double>& curvature, std::size_t first,
               std::size_t last, std::size_t reach) {
  Curve c;
  const auto largest_between = [&](std::size_t from, std::size_t to) {
    return *std::max_element(curvature.begin() + static_cast<std::ptrdiff_t>(from),
                             curvature.begin() + static_cast<std::ptrdiff_t>(to) + 1);
  };
  double length = 0;
  for (std::size_t i = first; i < last; ++i) {
    const double step = (axis[i + 1] - axis[i]).norm();
    length += step;
    c.total += 0.5 * step * (curvature[i] + curvature[i + 1]);
  }
  if (!(length > 0)) return c;
  c.mean = c.total / length;
  c.total *= kDegrees;
  c.largest = largest_between(first, last);
  c.tortuosity = length / (axis[last] - axis[first]).norm() - 1;
  const std::size_t fifth = std::max<std::size_t>(1, (last - first) / 5);
  c.bend = kDegrees * angle(axis[first + fifth] - axis[first], axis[last] - axis[last - fifth]);
  const auto edge = [&](std::size_t i) {
    return largest_between(i > reach ? i - reach : 0, std::min(i + reach, axis.size() - 1));
  };
  c.proximal_edge = edge(first);
  c.distal_edge = edge(last);
  return c;
}

}  // namespace

ShapeMetrics measure_shape(const Profile& profile, const Polyline& stent_axis_before,
                           const Polyline& stent_axis_after) {
  ShapeMetrics m;
  const std::vector<Station>& stations = profile.stations;
  std::vector<double> before, after;
  std::optional<std::size_t> first;
  std::size_t last = 0;
  double diameter = 0, sections = 0;
  for (std::size_t i = 0; i < stations.size(); ++i) {
    before.push_back(stations[i].curvature_before);
    after.push_back(stations[i].curvature_after);
    m.lateral_shift =
        std::max(m.lateral_shift, (profile.axis_after[i] - profile.axis_before[i]).norm());
    if (!stations[i].in_stent) continue;
    if (!first) first = i;
    last = i;
    if (stations[i].whole_after()) {
      diameter += stations[i].after->equivalent_diameter;
      sections += 1;
    }
  }
  if (first && last > *first && sections > 0) {
    const auto reach = static_cast<std::size_t>(diameter / sections / profile.spacing);
    m.curve_before = curve_of(profile.axis_before, before, *first, last, reach);
    m.curve_after = curve_of(profile.axis_after, after, *first, last, reach);
  }
  m.lumen_bend_before = m.curve_before.bend;
  m.lumen_bend_after = m.curve_after.bend;
  if (stent_axis_before.size() > 1 && stent_axis_after.size() > 1) {
    m.stent_bend_before = kDegrees * stents::end_tangent_angle(stent_axis_before);
    m.stent_bend_after = kDegrees * stents::end_tangent_angle(stent_axis_after);
    m.bend_before = *m.stent_bend_before;
    m.bend_after = *m.stent_bend_after;
  }
  return m;
}

}  // namespace vstent::measure
