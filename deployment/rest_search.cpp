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
// Of the largest move: what forces change by on shorter ones is the wall's tolerance.
constexpr double kLeastMove = 2e-3;
// Powell's: how much softer than known so far a direction may turn out in one look.
constexpr double kSoftest = 0.2;

}  // namespace

RestSearch::RestSearch(const YieldingStent& stent, double largest_move)
    : stent_(stent), largest_move_(largest_move), trial_(VectorXd::Zero(stent.unknowns())) {}

/// mm, root mean square along the stent.
double RestSearch::size(const VectorXd& move) const {
  return std::sqrt(move.dot(stent_.mean_square() * move));
}

/// A wall that bears on the stent with a force would bear less by about that force if it were given
/// a radius.
void RestSearch::guess_stiffness(double contact_force) {
  const StentLine line = stent_.shape(VectorXd::Zero(stent_.unknowns()));
  const double radius = *std::max_element(line.radii.begin(), line.radii.end());
  wall_ = contact_force / radius * stent_.mean_square();
}

/// The guess for the axis, and that for the radii, may be wrong by a factor: the first look tells.
void RestSearch::scale_guess(const VectorXd& moved, const VectorXd& resisted) {
  const Eigen::Index losses = stent_.losses(), axis = stent_.unknowns() - losses;
  const auto scale = [&](Eigen::Index from, Eigen::Index count) {
    if (count == 0) return;
    auto block = wall_.block(from, from, count, count);
    const auto part = moved.segment(from, count);
    const double guessed = part.dot(block * part);
    if (!(guessed > 0)) return;
    const double factor =
        std::clamp(part.dot(resisted.segment(from, count)) / guessed, kSoftest * kSoftest, 100.0);
    block *= factor;
  };
  scale(0, axis);
  scale(axis, losses);
}

void RestSearch::learn(const VectorXd& moved, const VectorXd& resisted) {
  if (!std::exchange(scaled_, true)) scale_guess(moved, resisted);
  const VectorXd known = wall_ * moved;
  const double expected = moved.dot(known);
  if (!(expected > 0)) return;
  const double found = moved.dot(resisted);
  const double keep =
      found >= kSoftest * expected ? 1 : (1 - kSoftest) * expected / (expected - found);
  const VectorXd damped = keep * resisted + (1 - keep) * known;
  wall_ += damped * damped.transpose() / moved.dot(damped) - known * known.transpose() / expected;
}

void RestSearch::looked(const VectorXd& forces, double energy, double contact_force) {
  if (wall_.size() == 0) guess_stiffness(contact_force);
  const bool tells = best_ && size(trial_ - best_->place) > kLeastMove * largest_move_;
  if (tells) {
    const VectorXd moved = trial_ - best_->place;
    learn(moved, best_->forces - forces - stent_.stiffness() * moved);
  }
  const auto worse = [&] {
    return energy > best_->energy + kEnergyNoise * std::abs(best_->energy) &&
           largest_force(stent_, forces) > largest_force(stent_, best_->forces);
  };
  // What was not learned from must not be tried again.
  if (!tells || !worse()) best_ = Look{trial_, forces, energy};
  VectorXd move = (stent_.stiffness() + wall_).ldlt().solve(best_->forces);
  const double reach = size(move);
  if (reach > largest_move_) move *= largest_move_ / reach;
  trial_ = best_->place + move;
}

void RestSearch::forget_forces() {
  if (best_) trial_ = best_->place;
  best_.reset();
}

}  // namespace vstent::deployment
