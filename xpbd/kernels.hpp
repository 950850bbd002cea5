// The inner loops, compiled once for any machine and twice for wide registers; all give the same
// bits.
#pragma once

#include "xpbd/batches.hpp"

namespace vstent::xpbd {

/// Triangles are taken in double precision only.
template <class Real>
struct StepKernels {
  /// One Gauss-Seidel pass: dlambda = -(C + compliance lambda) / (compliance + sum mobility |grad
  /// C|^2), moving particles; backward in the opposite order.
  void (*project)(const Batches&, SlotOf<Real>* particles, bool backward);
  /// Adds the kept multipliers' forces along the present gradients.
  void (*add_kept_forces)(const ConstBatches&, const SlotOf<Real>* particles, SlotOf<Real>* forces);
};

struct Kernels {
  StepKernels<double> step;
  StepKernels<float> step_in_single;
  /// Adds the elastic forces -C / compliance along the present gradients, whatever the multipliers.
  Tally (*add_elastic_forces)(const ConstBatches&, const Slot* particles, Slot* forces);
};

const Kernels& baseline_kernels();
/// Null where the program was not built for, or does not run on, a machine with AVX2.
const Kernels* avx2_kernels();
/// The same for AVX-512 (F, BW, DQ and VL).
const Kernels* avx512_kernels();
/// The widest that this machine runs.
const Kernels& kernels();

}  // namespace vstent::xpbd
