// Where a stent that gives way is at rest: few unknowns, and a wall that has to settle for every
// look at its forces.
#pragma once

#include <Eigen/Core>
#include <optional>

#include "deployment/yielding_stent.hpp"

namespace vstent::deployment {

/// Quasi-Newton search (Broyden, Fletcher, Goldfarb & Shanno, damped after Powell 1978) for the
/// place where all forces on the stent's unknowns vanish, which is a minimum of the energy of wall
/// and stent. The stent's own stiffness is known; the wall's is a guess, uniform along the stent,
/// that every look corrects.
class RestSearch {
 public:
  /// `largest_move`: of the axis or the radii in one look, mm, root mean square.
  RestSearch(const YieldingStent& stent, double largest_move);

  const Eigen::VectorXd& place() const { return trial_; }  ///< to look at next
  /// Forces at `place()`, all of them; the energy (N mm) of wall and stent there; and the sum of
  /// all pushes (N). Afterwards `place()` is another one.
  void looked(const Eigen::VectorXd& forces, double energy, double contact_force);
  /// The wall is another one: earlier forces and energies say nothing, stiffness does.
  void forget_forces();

 private:
  double size(const Eigen::VectorXd& move) const;
  void guess_stiffness(double contact_force);
  void scale_guess(const Eigen::VectorXd& moved, const Eigen::VectorXd& resisted);
  void learn(const Eigen::VectorXd& moved, const Eigen::VectorXd& resisted);

  const YieldingStent& stent_;
  double largest_move_;
  Eigen::VectorXd trial_;
  struct Look {
    Eigen::VectorXd place, forces;
    double energy = 0;
  };
  std::optional<Look> best_;
  Eigen::MatrixXd wall_;  // its stiffness as felt by the stent
  bool scaled_ = false;
};

}  // namespace vstent::deployment
