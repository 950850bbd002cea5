// What the solvers' inner loops run over: particles and constraints, several at a time, no two of a
// batch sharing a vertex.
#pragma once

#include <array>
#include <cstddef>
#include <span>
#include <type_traits>

namespace vstent::xpbd {

/// Constraints of a batch: one register of 512 bits in single precision; in double two, and while
/// one computes, the other's numbers are on their way.
inline constexpr std::size_t kLanes = 16;
template <class Number>
using Lanes = std::array<Number, kLanes>;

/// A particle's place and its mobility dt^2 / m (mm/N), so that a force moves it by mobility *
/// force in one step; also used for sums of forces, where the fourth component stays 0.
template <class Real>
struct alignas(4 * sizeof(Real)) SlotOf {
  Real x = 0, y = 0, z = 0, mobility = 0;
};
using Slot = SlotOf<double>;

/// What resists a change of length or of angle. Multipliers are kept as forces (lambda / dt^2: N,
/// or N mm for angles), compliances as 1 / stiffness: neither depends on the time step. Both in
/// single precision, for any sweep: a compliance is that much a matter of choice, and what a sweep
/// applies is what it keeps, so that a kept force is never wrong, only one of 2^24 steps.
struct Springs {
  Lanes<double> rest;
  Lanes<float> compliance, force;
};

/// A short batch is filled up with copies of its first constraint, which do no harm: they compute
/// and store the same values.
struct alignas(64) DistanceBatch {
  Springs length;
  std::array<Lanes<int>, 2> vertex;
};

struct alignas(64) BendingBatch {
  Springs fold;
  std::array<Lanes<int>, 4> vertex;  ///< edge_a, edge_b, wing_a, wing_b
};

/// Edges that have both: their particles are fetched once.
struct alignas(64) HingedEdgeBatch {
  Springs length, fold;
  std::array<Lanes<int>, 4> vertex;  ///< edge_a, edge_b, wing_a, wing_b
};

/// The gradients of a triangle's deformation, by its edges from corner 0: column 0 is `along` times
/// the edge to corner 1, column 1 `across` times that to corner 2 less `skew` times the first.
/// Compliance is 1.
struct alignas(64) TriangleBatch {
  Lanes<double> along, skew, across;  ///< 1/mm
  Lanes<double> weight;               ///< shear modulus times volume, N mm
  Lanes<double> bulk;                 ///< bulk over shear modulus
  Lanes<double> force;                ///< sqrt(N mm)
  std::array<Lanes<int>, 3> vertex;
};

template <class Batch>
bool is_copy(const Batch& batch, std::size_t lane) {
  return lane > 0 && batch.vertex[0][lane] == batch.vertex[0][0];
}

/// Some of a layout's batches.
template <bool kConst>
struct BatchesOf {
  template <class Batch>
  using Span = std::span<std::conditional_t<kConst, const Batch, Batch>>;

  Span<DistanceBatch> distances;
  Span<HingedEdgeBatch> hinged_edges;
  Span<TriangleBatch> triangles;
  Span<BendingBatch> bendings;
};
using Batches = BatchesOf<false>;
using ConstBatches = BatchesOf<true>;

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
