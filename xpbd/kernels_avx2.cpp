#include "xpbd/kernels_body.hpp"

namespace vstent::xpbd {

const Kernels* avx2_kernels() { return __builtin_cpu_supports("avx2") ? &kTable : nullptr; }

}  // namespace vstent::xpbd
