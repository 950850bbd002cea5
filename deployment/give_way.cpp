#include "deployment/give_way.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "vessels/error.hpp"
#include "vessels/text.hpp"

namespace vstent::deployment {
namespace {

// Of the stent's radius, in one look: the wall follows that far without folding.
constexpr double kLargestMove = 0.15;
// Of its diameter.
constexpr double kNotableLoss = 0.05;
// Of its radius: no stent is crimped so far, and beyond nothing it has no shape.
constexpr double kCrushed = 0.1;

}  // namespace

GiveWay::GiveWay(const Setup& setup)
    : setup_(setup),
      prescribed_(stent_state(setup, 1)),
      beyond_(envelope_beyond(setup, prescribed_)),
      stent_({prescribed_.axis, prescribed_.radii},
             {setup.specification.bending_stiffness, setup.specification.radial_stiffness}),
      search_(stent_, kLargestMove * setup.stent.diameter / 2),
      line_(stent_.shape(search_.place())) {}

StentState GiveWay::envelope() const {
  StentState state = prescribed_;
  state.axis = line_.axis;
  state.radii = line_.radii;
  for (double& r : state.radii) r += beyond_;
  return state;
}

void GiveWay::settled(std::span<const Vec3> places, std::span<const Vec3> contact_forces,
                      double energy) {
  std::vector<Push> pushes;
  contact_force_ = 0;
  for (std::size_t i = 0; i < places.size(); ++i) {
    if (contact_forces[i].isZero(0)) continue;
    pushes.push_back({places[i], -contact_forces[i]});
    contact_force_ += contact_forces[i].norm();
  }
  forces_ = stent_.forces(search_.place(), pushes);
  energy_ = energy + stent_.energy(search_.place());
  report_.unbalanced = contact_force_ > 0 ? largest_force(stent_, forces_) / contact_force_ : 0;
  report_.shift = 0;
  report_.smallest_share = std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i < line_.axis.size(); ++i) {
    report_.shift = std::max(report_.shift, (line_.axis[i] - prescribed_.axis[i]).norm());
    const double share = line_.radii[i] / prescribed_.radii[i];
    if (share >= report_.smallest_share) continue;
    report_.smallest_share = share;
    report_.smallest_diameter = 2 * line_.radii[i];
  }
  ++report_.looks;
}

void GiveWay::move_on() {
  search_.looked(forces_, energy_, contact_force_);
  line_ = stent_.shape(search_.place());
  for (std::size_t i = 0; i < line_.radii.size(); ++i) {
    if (line_.radii[i] >= kCrushed * prescribed_.radii[i]) continue;
    throw Error(ExitCode::numerical,
                setup_.specification.surface.string() + ": the wall crushes the stent, whose " +
                    "radial stiffness is " +
                    vessels::number(*setup_.specification.radial_stiffness) +
                    " N/mm2, to less than " + vessels::number(100 * kCrushed) +
                    " % of its diameter; a stiffer stent or a softer wall may balance");
  }
}

void GiveWay::new_wall() {
  search_.forget_forces();
  line_ = stent_.shape(search_.place());
}

StentState GiveWay::at_rest() const { return yielded_state(setup_, line_); }

std::optional<std::string> narrowed_warning(const GivenWay& given) {
  if (given.smallest_share > 1 - kNotableLoss) return std::nullopt;
  return "the wall holds the stent down to " + vessels::mm(given.smallest_diameter) + ", " +
         vessels::number(std::round(1000 * (1 - given.smallest_share)) / 10) +
         " % short of its diameter there; a stiffer or larger stent opens it further";
}

}  // namespace vstent::deployment
