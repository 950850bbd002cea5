#include "xpbd/kernels_body.hpp"

namespace vstent::xpbd {

const Kernels& baseline_kernels() { return kTable; }

const Kernels& kernels() {
  if (const Kernels* widest = avx512_kernels()) return *widest;
  const Kernels* wide = avx2_kernels();
  return wide ? *wide : baseline_kernels();
}

}  // namespace vstent::xpbd
