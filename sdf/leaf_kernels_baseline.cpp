#include "sdf/leaf_kernels_body.hpp"

namespace vstent::sdf {

const LeafKernels& baseline_leaf_kernels() { return kTable; }

const LeafKernels& leaf_kernels() {
  const LeafKernels* wide = avx2_leaf_kernels();
  return wide ? *wide : baseline_leaf_kernels();
}

}  // namespace vstent::sdf
