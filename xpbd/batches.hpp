// What the solver's inner loops run over: particles and constraints, four at a time, no two of a
// batch sharing a vertex.
#pragma once

#include <array>
#include <cstddef>

namespace vstent::xpbd {

inline constexpr int kLanes = 4;
using Lanes = std::array<double, kLanes>;
using Indices = std::array<int, kLanes>;

/// A particle's place and its mobility dt^2 / m (mm/N), so that a force moves it by mobility *
/// force in one step; also used for sums of forces, where the fourth component stays 0.
struct alignas(32) Slot {
  double x = 0, y = 0, z = 0, mobility = 0;
};

/// Multipliers are kept as forces (lambda / dt^2: N, or N mm for angles), compliances as 1 /
/// stiffness: neither depends on the time step. A short batch is filled up with copies of its first
/// constraint, which do no harm: they compute and store the same values.
struct alignas(32) DistanceBatch {
  Lanes rest, compliance, force;
  Indices i, j;
};

struct alignas(32) BendingBatch {
  Lanes rest, compliance, force;
  std::array<Indices, 4> vertex;  ///< edge_a, edge_b, wing_a, wing_b
};

/// The gradients of a triangle's deformation, by its edges from corner 0: column 0 is `along` times
/// the edge to corner 1, column 1 `across` times that to corner 2 less `skew` times the first.
/// Compliance is 1.
struct alignas(32) TriangleBatch {
  Lanes along, skew, across;  ///< 1/mm
  Lanes weight;               ///< shear modulus times volume, N mm
  Lanes bulk;                 ///< bulk over shear modulus
  Lanes force;                ///< sqrt(N mm)
  std::array<Indices, 3> vertex;
};

/// Sums over constraints that ForceBalance needs.
struct Tally {
  double energy = 0;           ///< N mm
  double carried_squares = 0;  ///< N^2
  double carried = 0;          ///< number of constraints
};

inline void add(const Tally& part, Tally& total) {
  total.energy += part.energy;
  total.carried_squares += part.carried_squares;
  total.carried += part.carried;
}

}  // namespace vstent::xpbd
