#include "sdf/leaf_kernels_body.hpp"

namespace vstent::sdf {

const LeafKernels* avx2_leaf_kernels() {
  return __builtin_cpu_supports("avx2") ? &kTable : nullptr;
}

}  // namespace vstent::sdf
