// Room for the values of leaves. Inside this folder only.
#pragma once

#include <array>
#include <cstddef>
#include <memory>
#include <mutex>
#include <vector>

#include "sdf/leaf_kernels.hpp"

namespace vstent::sdf {

/// Owns the values of a level set's leaves, in slabs. Slabs that are no longer needed are kept for
/// the next level set, up to 64 MiB in the whole program: a stent that grows is voxelised again
/// and again, and fresh memory costs as much as filling it.
class LeafStore {
 public:
  struct Slab {
    alignas(64) std::array<std::array<float, kLeafNodes>, 64> leaves;
  };

  LeafStore() = default;
  LeafStore(const LeafStore&) = delete;
  LeafStore& operator=(const LeafStore&) = delete;
  ~LeafStore();

  std::size_t bytes() const { return slabs_.size() * sizeof(Slab); }

  /// One thread's way to add leaves.
  class Writer {
   public:
    explicit Writer(LeafStore& store) : store_(store) {}
    /// Room for the next leaf, the same until keep().
    float* spare() {
      if (!slab_ || used_ == slab_->leaves.size()) slab_ = store_.add_slab(), used_ = 0;
      return slab_->leaves[used_].data();
    }
    void keep() { ++used_; }

   private:
    LeafStore& store_;
    Slab* slab_ = nullptr;
    std::size_t used_ = 0;
  };

 private:
  Slab* add_slab();

  std::mutex mutex_;
  std::vector<std::unique_ptr<Slab>> slabs_;
};

}  // namespace vstent::sdf
