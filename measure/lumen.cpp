#include "measure/lumen.hpp"

#include <algorithm>
#include <numbers>

namespace vstent::measure {
namespace {

constexpr double kLandingZone = 5;  // mm beyond either end, or a diameter where that is more

double disc(double diameter) { return 0.25 * std::numbers::pi * diameter * diameter; }

std::optional<double> smaller(const std::optional<double>& known, double value) {
  return known ? std::min(*known, value) : value;
}

/// Largest whole lumen before with from <= arc length <= to.
std::optional<double> largest_before(const std::vector<Station>& stations, double from, double to) {
  std::optional<double> largest;
  for (const Station& s : stations) {
    if (s.arc_length < from || s.arc_length > to || s.in_stent || !s.whole_before()) continue;
    largest = std::max(largest.value_or(0), s.before->equivalent_diameter);
  }
  return largest;
}

void measure_narrowest(LumenMetrics& m) {
  const double from = m.treated_from - kLandingZone, to = m.treated_to + kLandingZone;
  const auto note = [](const Station& s, double diameter, double& narrowest, double& place) {
    if (narrowest > 0 && diameter >= narrowest) return;
    narrowest = diameter;
    place = s.arc_length;
  };
  for (const Station& s : m.stations) {
    if (s.arc_length < from || s.arc_length > to) continue;
    if (s.whole_before()) {
      m.min_area_before = smaller(m.min_area_before, s.before->area);
      if (s.in_stent)
        note(s, s.before->equivalent_diameter, m.narrowest_before, m.narrowest_before_at);
    }
    if (s.whole_after()) {
      m.min_area_after = smaller(m.min_area_after, s.after->area);
      if (!s.in_stent) continue;
      note(s, s.after->equivalent_diameter, m.narrowest_after, m.narrowest_after_at);
      m.min_stent_area = smaller(m.min_stent_area, s.after->area);
      m.symmetry_after = smaller(m.symmetry_after, s.after->min_diameter / s.after->max_diameter);
    }
  }
}

void measure_stenosis(LumenMetrics& m) {
  const auto zone = [&](auto first, auto last) {
    double diameter = 0;
    for (auto s = first; s != last && diameter == 0; ++s)
      if (s->in_stent && s->whole_before()) diameter = s->before->equivalent_diameter;
    return std::max(kLandingZone, diameter);
  };
  const double proximal = zone(m.stations.begin(), m.stations.end());
  const double distal = zone(m.stations.rbegin(), m.stations.rend());
  m.reference_proximal = largest_before(m.stations, m.treated_from - proximal, m.treated_from);
  m.reference_distal = largest_before(m.stations, m.treated_to, m.treated_to + distal);
  if (m.reference_proximal) m.reference_diameter = *m.reference_proximal;
  if (m.reference_distal)
    m.reference_diameter = m.reference_proximal
                               ? std::min(m.reference_diameter, *m.reference_distal)
                               : *m.reference_distal;
  if (!(m.reference_diameter > 0)) return;
  const auto lost = [&](double d) {
    return d > 0 ? std::optional(100 * (1 - d / m.reference_diameter)) : std::nullopt;
  };
  const auto lost_area = [&](double d) {
    return d > 0 ? std::optional(100 * (1 - disc(d) / disc(m.reference_diameter))) : std::nullopt;
  };
  m.stenosis_before = lost(m.narrowest_before);
  m.stenosis_after = lost(m.narrowest_after);
  m.area_stenosis_before = lost_area(m.narrowest_before);
  m.area_stenosis_after = lost_area(m.narrowest_after);
  if (m.reference_proximal && m.reference_distal && m.min_stent_area) {
    m.expansion_of_reference =
        200 * *m.min_stent_area / (disc(*m.reference_proximal) + disc(*m.reference_distal));
  }
}

void measure_volume(LumenMetrics& m) {
  const Station* last = nullptr;
  for (const Station& s : m.stations) {
    if (!s.in_stent || !s.whole_before() || !s.whole_after()) continue;
    if (last) {
      const double half = 0.5 * (s.arc_length - last->arc_length);
      m.volume_before = m.volume_before.value_or(0) + half * (last->before->area + s.before->area);
      m.volume_after = m.volume_after.value_or(0) + half * (last->after->area + s.after->area);
    }
    last = &s;
  }
}

void measure_expansion(LumenMetrics& m) {
  double counted = 0, ratio = 0, stations = 0, opened = 0, opened_ratio = 0;
  for (const Station& s : m.stations) {
    if (!s.in_stent || !(s.target > 0)) continue;
    stations += 1;
    if (!s.whole_after()) continue;
    const double share = s.after->equivalent_diameter / s.target;
    counted += 1;
    ratio += share;
    m.expansion_min = smaller(m.expansion_min, 100 * share);
    if (!s.whole_before() || s.before->equivalent_diameter >= s.target) continue;
    opened += 1;
    opened_ratio += share;
    if (m.opened_min_diameter == 0 || s.after->min_diameter < m.opened_min_diameter)
      m.opened_min_diameter = s.after->min_diameter;
  }
  m.has_target = stations > 0;
  if (counted > 0) m.expansion_mean = 100 * ratio / counted;
  if (opened > 0) m.opened_mean_over_target = opened_ratio / opened;
  if (stations > 0) m.opened_share = opened / stations;
}

}  // namespace

LumenMetrics measure_lumen(std::vector<Station> stations) {
  LumenMetrics m;
  m.stations = std::move(stations);
  const auto in_stent = [](const Station& s) { return s.in_stent; };
  const auto first = std::find_if(m.stations.begin(), m.stations.end(), in_stent);
  const auto last = std::find_if(m.stations.rbegin(), m.stations.rend(), in_stent);
  if (first == m.stations.end()) return m;
  m.treated_from = first->arc_length;
  m.treated_to = last->arc_length;
  measure_narrowest(m);
  measure_stenosis(m);
  measure_volume(m);
  measure_expansion(m);
  return m;
}

}  // namespace vstent::measure
