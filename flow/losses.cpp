#include "flow/losses.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace vstent::flow {
namespace {

constexpr double kPi = std::numbers::pi;
constexpr double kWidening = 1.1;     // of the area; what widens less does not separate
constexpr double kRecovery = 10;      // throat diameters behind a throat: there the jet has spread
constexpr double kSeparation = 1.52;  // K_t
constexpr double kLengthShare = 0.83, kEntrance = 1.64;  // effective length, Seeley and Young 1976

double diameter_of(double area) { return std::sqrt(4 * area / kPi); }

double area_of(double diameter) { return 0.25 * kPi * diameter * diameter; }

std::size_t widest(const std::vector<double>& area, std::size_t from, std::size_t to) {
  return static_cast<std::size_t>(
      std::max_element(area.begin() + static_cast<std::ptrdiff_t>(from),
                       area.begin() + static_cast<std::ptrdiff_t>(to) + 1) -
      area.begin());
}

}  // namespace

std::vector<Stenosis> find_stenoses(const Lumen& lumen) {
  const std::vector<double>& area = lumen.area;
  std::vector<Stenosis> found;
  std::size_t throat = 0, top = 0, begin = 0;
  bool widening = false;
  const auto close = [&](std::size_t last) {
    if (widening) {
      const std::size_t start = widest(area, begin, throat);
      const double reference = diameter_of(std::min(area[start], area[top]));
      found.push_back({start, throat, top, 100 * (1 - diameter_of(area[throat]) / reference)});
      begin = top;
    }
    widening = false;
    throat = top = last;
  };
  for (std::size_t i = 0; i < area.size(); ++i) {
    if (!widening) {
      if (area[i] <= area[throat]) throat = top = i;
      widening = area[i] >= kWidening * area[throat];
    }
    if (!widening) continue;
    if (lumen.arc[i] > lumen.arc[throat] + kRecovery * diameter_of(area[throat])) {
      close(i);
    } else if (area[i] > area[top]) {
      top = i;
    } else if (area[i] * kWidening < area[top]) {
      close(i);
    }
  }
  close(0);
  return found;
}

Losses losses_along(const Lumen& lumen, const Blood& blood, const LossModel& model) {
  const std::size_t count = lumen.area.size();
  Losses losses;
  losses.viscous.assign(count, 0);
  losses.separation.assign(count, 0);
  losses.inertance.assign(count, 0);
  losses.stenoses = find_stenoses(lumen);
  for (std::size_t i = 1; i < count; ++i) {
    // Exact for a cone.
    const double h = lumen.arc[i] - lumen.arc[i - 1];
    const double a = diameter_of(lumen.area[i - 1]), b = diameter_of(lumen.area[i]);
    losses.viscous[i] = losses.viscous[i - 1] + 128 * blood.viscosity * h / (3 * kPi) *
                                                    (a * a + a * b + b * b) / std::pow(a * b, 3);
    losses.inertance[i] = losses.inertance[i - 1] + blood.density * 4 * h / (kPi * a * b);
  }
  for (const Stenosis& s : losses.stenoses) {
    const double throat = lumen.area[s.throat];
    const double entrance =
        model.entrance * diameter_of(throat) * 8 * kPi * blood.viscosity / (throat * throat);
    // Lost as the dynamic pressure goes down, so that pressure neither overshoots nor dips.
    const double end = lumen.area[s.end];
    const double whole = 0.5 * model.separation * blood.density * std::pow(1 / throat - 1 / end, 2);
    double area = throat;
    for (std::size_t i = s.throat + 1; i < count; ++i) {
      area = i < s.end ? std::max(area, lumen.area[i]) : end;
      losses.separation[i] += whole * (1 / (throat * throat) - 1 / (area * area)) /
                              (1 / (throat * throat) - 1 / (end * end));
    }
    for (std::size_t i = s.throat; i < count; ++i) losses.viscous[i] += entrance;
  }
  return losses;
}

YoungTsai young_tsai(double diameter, double throat, double length, double flow,
                     const Blood& blood) {
  const double velocity = flow / area_of(diameter), ratio = area_of(diameter) / area_of(throat);
  const double viscous =
      32 * (kLengthShare * length + kEntrance * throat) / diameter * ratio * ratio;
  return {
      viscous * blood.viscosity / diameter * velocity,
      0.5 * kSeparation * blood.density * std::pow(ratio - 1, 2) * velocity * std::abs(velocity)};
}

}  // namespace vstent::flow
