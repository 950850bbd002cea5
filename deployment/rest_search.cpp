#include "deployment/rest_search.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <utility>

#include "sdf/polyline.hpp"

namespace vstent::deployment {
namespace {

using Eigen::VectorXd;

// Of the energy: what a wall that has settled to its tolerance may be wrong by.
constexpr double kEnergyNoise = 1e-7;
// Powell's: how much softer than known so far a direction may turn out in one look.
constexpr double kSoftest = 0.2;

}  // namespace

RestSearch::RestSearch(const YieldingStent& stent, double largest_move)
    : stent_(stent), largest_move_(largest_move), trial_(VectorXd::Zero(stent.unknowns())) {}

/// A wall that bears on the stent with a force would bear less by about that force if it were given
/// a radius.
void RestSearch::guess_stiffness(double contact_force) {
  const StentLine line = stent_.shape(VectorXd::Zero(stent_.unknowns()));
  const double radius = *std::max_element(line.radii.begin(), line.radii.end());
  stiffness_ = stent_.stiffness() + contact_force / radius * stent_.mean_square();
}

/// The guess for the axis, and that for the radii, may be wrong by a factor: the first look tells.
void RestSearch::scale_guess(const VectorXd& moved, const VectorXd& resisted) {
  const Eigen::MatrixXd wall = stiffness_ - stent_.stiffness();
  const VectorXd by_wall = resisted - stent_.stiffness() * moved;
  const Eigen::Index losses = stent_.losses(), axis = stent_.unknowns() - losses;
  const auto scale = [&](Eigen::Index from, Eigen::Index count) {
    if (count == 0) return;
    const auto block = wall.block(from, from, count, count);
    const auto part = moved.segment(from, count);
    const double guessed = part.dot(block * part);
    if (!(guessed > 0)) return;
    const double factor =
        std::clamp(part.dot(by_wall.segment(from, count)) / guessed, kSoftest * kSoftest, 100.0);
    stiffness_.block(from, from, count, count) += (factor - 1) * block;
  };
  scale(0, axis);
  scale(axis, losses);
}

void RestSearch::learn(const VectorXd& moved, const VectorXd& resisted) {
  if (!std::exchange(scaled_, true)) scale_guess(moved, resisted);
  const VectorXd known = stiffness_ * moved;
  const double expected = moved.dot(known);
  if (!(expected > 0)) return;
  const double found = moved.dot(resisted);
  const double keep = found >= kSoftest * expected
                          ? 1
                          : (1 - kSoftest) * expected / (expected - found);
  const VectorXd damped = keep * resisted + (1 - keep) * known;
  stiffness_ += damped * damped.transpose() / moved.dot(damped) -
                known * known.transpose() / expected;
}

void RestSearch::looked(const VectorXd& forces, double energy, double contact_force) {
  if (stiffness_.size() == 0) guess_stiffness(contact_force);
  if (best_) learn(trial_ - best_->place, best_->forces - forces);
  const auto worse = [&] {
    return energy > best_->energy + kEnergyNoise * std::abs(best_->energy) &&
           largest_force(stent_, forces) > largest_force(stent_, best_->forces);
  };
  if (!best_ || !worse()) best_ = Look{trial_, forces, energy};
  VectorXd move = stiffness_.ldlt().solve(best_->forces);
  const double size = std::sqrt(move.dot(stent_.mean_square() * move));
  if (size > largest_move_) move *= largest_move_ / size;
  trial_ = best_->place + move;
}

void RestSearch::forget_forces() {
  if (best_) trial_ = best_->place;
  best_.reset();
}

}  // namespace vstent::deployment
