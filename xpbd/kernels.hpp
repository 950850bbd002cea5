// The inner loops, compiled once for any machine and twice for wide registers; all give the same
// bits.
#pragma once

#include <span>

#include "xpbd/batches.hpp"

namespace vstent::xpbd {

template <class Real>
struct StepKernels {
  using Distances = DistanceBatchOf<Real>;
  using Bendings = BendingBatchOf<Real>;
  /// One Gauss-Seidel pass: dlambda = -(C + compliance lambda) / (compliance + sum mobility |grad
  /// C|^2), moving particles.
  void (*project_distances)(std::span<Distances>, SlotOf<Real>* particles, bool backward);
  void (*project_bendings)(std::span<Bendings>, SlotOf<Real>* particles, bool backward);
  /// Adds the kept multipliers' forces along the present gradients.
  void (*kept_distance_forces)(std::span<const Distances>, const SlotOf<Real>* particles,
                               SlotOf<Real>* forces);
  void (*kept_bending_forces)(std::span<const Bendings>, const SlotOf<Real>* particles,
                              SlotOf<Real>* forces);
};

struct Kernels {
  StepKernels<double> step;
  StepKernels<float> step_in_single;
  void (*project_triangles)(std::span<TriangleBatch>, Slot* particles, bool backward);
  void (*kept_triangle_forces)(std::span<const TriangleBatch>, const Slot* particles, Slot* forces);
  /// Adds the elastic forces -C / compliance along the present gradients, whatever the multipliers.
  Tally (*elastic_distance_forces)(std::span<const DistanceBatch>, const Slot* particles,
                                   Slot* forces);
  Tally (*elastic_bending_forces)(std::span<const BendingBatch>, const Slot* particles,
                                  Slot* forces);
  Tally (*elastic_triangle_forces)(std::span<const TriangleBatch>, const Slot* particles,
                                   Slot* forces);
};

const Kernels& baseline_kernels();
/// Null where the program was not built for, or does not run on, a machine with AVX2.
const Kernels* avx2_kernels();
/// The same for AVX-512 (F, BW, DQ and VL).
const Kernels* avx512_kernels();
/// The widest that this machine runs.
const Kernels& kernels();

}  // namespace vstent::xpbd
