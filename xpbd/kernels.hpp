// The inner loops, compiled once for any machine and once for wide registers; both give the same
// bits.
#pragma once

#include <span>

#include "xpbd/batches.hpp"

namespace vstent::xpbd {

struct Kernels {
  /// One Gauss-Seidel pass: dlambda = -(C + compliance lambda) / (compliance + sum mobility |grad
  /// C|^2), moving particles.
  void (*project_distances)(std::span<DistanceBatch>, Slot* particles, bool backward);
  void (*project_bendings)(std::span<BendingBatch>, Slot* particles, bool backward);
  void (*project_triangles)(std::span<TriangleBatch>, Slot* particles, bool backward);
  /// Adds the kept multipliers' forces along the present gradients.
  void (*kept_distance_forces)(std::span<const DistanceBatch>, const Slot* particles, Slot* forces);
  void (*kept_bending_forces)(std::span<const BendingBatch>, const Slot* particles, Slot* forces);
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
/// The widest that this machine runs.
const Kernels& kernels();

}  // namespace vstent::xpbd
