// Sums that a force balance is made of, kept per chunk of particles and merged in order.
#pragma once

#include <cmath>
#include <limits>

#include "xpbd/batches.hpp"
#include "xpbd/solver.hpp"

namespace vstent::xpbd {

struct Unbalanced {
  double squares = 0, largest = 0, contact_sum = 0;
  int free = 0, in_contact = 0, worst = -1;

  /// What is left at a free vertex after contact reactions.
  void add(const Vec3& residual, int vertex) {
    const double square = residual.squaredNorm();
    squares += square;
    ++free;
    if (square > largest) {
      largest = square;
      worst = vertex;
    }
  }

  void add_contact(double push) {
    contact_sum += push;
    ++in_contact;
  }

  void merge(const Unbalanced& other) {
    squares += other.squares;
    contact_sum += other.contact_sum;
    free += other.free;
    in_contact += other.in_contact;
    if (other.largest > largest) {
      largest = other.largest;
      worst = other.worst;
    }
  }

  ForceBalance conclude(const Tally& tally) const {
    ForceBalance balance;
    balance.energy = tally.energy;
    balance.contact_force_sum = contact_sum;
    balance.in_contact = in_contact;
    balance.worst_vertex = worst;
    balance.residual_max = std::sqrt(largest);
    if (free > 0) balance.residual_rms = std::sqrt(squares / free);
    if (in_contact > 0) balance.contact_force_mean = contact_sum / in_contact;
    const double carried = tally.carried > 0 ? std::sqrt(tally.carried_squares / tally.carried) : 0;
    const double scale = in_contact > 0 ? balance.contact_force_mean : carried;
    // Loads that nothing carries yet are as far from balance as can be.
    if (balance.residual_rms > 0)
      balance.relative =
          scale > 0 ? balance.residual_rms / scale : std::numeric_limits<double>::infinity();
    return balance;
  }
};

}  // namespace vstent::xpbd
