// Two equations in two unknowns, for lengths that two measures of a wire must meet.
#pragma once

#include <Eigen/Dense>

namespace vstent::stents {

/// Newton with differences of size `difference` per unknown, steps halved until they help. Returns
/// the excess that is left (largest absolute value); `x` comes with a start and leaves with the
/// root.
template <class Excess>
double solve_two(const Excess& excess, Eigen::Vector2d& x, const Eigen::Vector2d& difference,
                 double tolerance) {
  Eigen::Vector2d left = excess(x);
  for (int round = 0; round < 80 && !(left.cwiseAbs().maxCoeff() <= tolerance); ++round) {
    Eigen::Matrix2d slope;
    for (const int k : {0, 1}) {
      const Eigen::Vector2d step = difference[k] * Eigen::Vector2d::Unit(k);
      slope.col(k) = (excess(x + step) - excess(x - step)) / (2 * difference[k]);
    }
    const Eigen::Vector2d step = slope.fullPivLu().solve(left);
    bool better = false;
    for (double part = 1; part > 1e-5 && !better; part *= 0.5) {
      const Eigen::Vector2d trial = x - part * step;
      const Eigen::Vector2d trial_left = excess(trial);
      if (!(trial_left.norm() < left.norm())) continue;
      x = trial;
      left = trial_left;
      better = true;
    }
    if (!better) break;
  }
  return left.cwiseAbs().maxCoeff();
}

}  // namespace vstent::stents
