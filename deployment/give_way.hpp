// A run's stent that gives way to the wall: where it is, and whether its forces balance.
#pragma once

#include "deployment/rest_search.hpp"
#include "deployment/stent_model.hpp"

namespace vstent::deployment {

/// Where a stent that gave way came to rest.
struct GivenWay {
  double shift = 0;           ///< mm, largest, of the axis from where it was prescribed
  double unbalanced = 0;      ///< force on it that nothing balances, over the sum of contact forces
  double smallest_share = 1;  ///< of the unloaded diameter, where it is narrowed most
  double smallest_diameter = 0;  ///< mm, outer, there
  int looks = 0;                 ///< settled walls that it took
};

/// Where the wall takes more than a twentieth of its diameter.
std::optional<std::string> narrowed_warning(const GivenWay& given);

/// The expanded stent of a case with `gives_way`. While it looks for its rest the wall lies on its
/// envelope, without what a balloon is wider by for recoil.
class GiveWay {
 public:
  explicit GiveWay(const Setup& setup);

  StentState envelope() const;  ///< that the wall is to settle on next
  /// The wall settled on `envelope()`: measures the balance there. `contact_forces`: on the wall,
  /// by vertex, N. `energy`: of the wall, N mm.
  void settled(std::span<const Vec3> places, std::span<const Vec3> contact_forces, double energy);
  void move_on();   ///< to where forces are likely to balance
  void new_wall();  ///< another one comes next: starts anew from the best place

  StentState at_rest() const;  ///< the stent itself, where the wall settled last
  const GivenWay& report() const { return report_; }

 private:
  const Setup& setup_;
  StentState prescribed_;
  double beyond_;  // mm, of the envelope over the radii
  YieldingStent stent_;
  RestSearch search_;
  StentLine line_;
  Eigen::VectorXd forces_;
  double energy_ = 0, contact_force_ = 0;
  GivenWay report_;
};

}  // namespace vstent::deployment
