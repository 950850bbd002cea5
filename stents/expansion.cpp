#include "stents/expansion.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>

namespace vstent::stents {
namespace {

ExpansionState state_of(const Design& design, const RadiusProfile& outer_radius, double moment,
                        double crimped_length) {
  ExpansionState state;
  state.moment = moment;
  state.end_diameter = 2 * outer_radius(0);
  state.middle_diameter = 2 * outer_radius(0.5);
  state.length = design.expanded(outer_radius).length;
  state.dog_boning = dog_boning(outer_radius);
  state.foreshortening = 1 - state.length / crimped_length;
  return state;
}

}  // namespace

RadiusProfile dog_bone(const Inflation& i, double moment) {
  if (!(i.delay >= 0 && i.delay < 1))
    throw std::invalid_argument("the delay of an inflation must be from 0 to below 1");
  return [i, moment](double share) {
    const double from_middle = std::min(1.0, std::abs(2 * share - 1));
    const double start = i.delay * (1 - std::pow(from_middle, i.sharpness));
    const double x = std::clamp((moment - start) / (1 - i.delay), 0.0, 1.0);
    const double opened = x * x * (3 - 2 * x);
    return 0.5 * (i.crimped_diameter + opened * (i.inflated_diameter - i.crimped_diameter));
  };
}

double dog_boning(const RadiusProfile& outer_radius) {
  const double end = 0.5 * (outer_radius(0) + outer_radius(1));
  return (end - outer_radius(0.5)) / end;
}

double foreshortening(const Design& design, double from, double to) {
  return 1 - design.expanded(to).length / design.expanded(from).length;
}

std::vector<ExpansionState> expansion_history(const Design& design, const Inflation& inflation,
                                              int moments, double recoil) {
  const double crimped_length = design.expanded(inflation.crimped_diameter).length;
  std::vector<ExpansionState> history;
  for (int i = 0; i <= moments; ++i) {
    const double moment = static_cast<double>(i) / moments;
    history.push_back(state_of(design, dog_bone(inflation, moment), moment, crimped_length));
  }
  const double released = 0.5 * inflation.inflated_diameter * (1 - recoil);
  history.push_back(state_of(
      design, [released](double) { return released; }, 1, crimped_length));
  return history;
}

}  // namespace vstent::stents
