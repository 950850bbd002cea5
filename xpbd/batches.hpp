// What the solver's inner loops run over: particles and constraints, several at a time, no two of a
// batch sharing a vertex.
#pragma once

#include <array>
#include <cstddef>

namespace vstent::xpbd {

/// Two registers of 256 bits, or one of 512: while one computes, the other's numbers are on their
/// way.
template <class Real>
inline constexpr std::size_t kLanesOf = 64 / sizeof(Real);
template <class Real>
using LanesOf = std::array<Real, kLanesOf<Real>>;
template <class Real>
using IndicesOf = std::array<int, kLanesOf<Real>>;

inline constexpr std::size_t kLanes = kLanesOf<double>;
using Lanes = LanesOf<double>;
using Indices = IndicesOf<double>;

/// A particle's place and its mobility dt^2 / m (mm/N), so that a force moves it by mobility *
/// force in one step; also used for sums of forces, where the fourth component stays 0.
template <class Real>
struct alignas(4 * sizeof(Real)) SlotOf {
  Real x = 0, y = 0, z = 0, mobility = 0;
};
using Slot = SlotOf<double>;

/// Multipliers are kept as forces (lambda / dt^2: N, or N mm for angles), compliances as 1 /
/// stiffness: neither depends on the time step. A short batch is filled up with copies of its first
/// constraint, which do no harm: they compute and store the same values.
template <class Real>
struct alignas(64) DistanceBatchOf {
  LanesOf<Real> rest, compliance, force;
  std::array<IndicesOf<Real>, 2> vertex;
};
using DistanceBatch = DistanceBatchOf<double>;

template <class Real>
struct alignas(64) BendingBatchOf {
  LanesOf<Real> rest, compliance, force;
  std::array<IndicesOf<Real>, 4> vertex;  ///< edge_a, edge_b, wing_a, wing_b
};
using BendingBatch = BendingBatchOf<double>;

/// The gradients of a triangle's deformation, by its edges from corner 0: column 0 is `along` times
/// the edge to corner 1, column 1 `across` times that to corner 2 less `skew` times the first.
/// Compliance is 1.
struct alignas(64) TriangleBatch {
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
