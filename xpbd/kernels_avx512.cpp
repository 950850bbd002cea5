#include "xpbd/kernels_body.hpp"

namespace vstent::xpbd {

const Kernels* avx512_kernels() {
  const bool runs = __builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512bw") &&
                    __builtin_cpu_supports("avx512dq") && __builtin_cpu_supports("avx512vl");
  return runs ? &kTable : nullptr;
}

}  // namespace vstent::xpbd
