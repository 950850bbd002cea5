#include "sdf/block_kernel_body.hpp"
#include "sdf/leaf_kernels_body.hpp"
#include "sdf/sample_kernel_body.hpp"

namespace vstent::sdf {
namespace {

constexpr LeafKernels kTable{lower_to_thin, lower_to_thick,  lower_to_struts, lower_to_cut_capsules,
                             lower_to_cone, lower_to_larger, store,           store_thin,
                             find_near,     locate,          sample};

}  // namespace

const LeafKernels* avx2_leaf_kernels() {
  return __builtin_cpu_supports("avx2") ? &kTable : nullptr;
}

}  // namespace vstent::sdf
