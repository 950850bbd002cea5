#include "sdf/leaf_store.hpp"

namespace vstent::sdf {
namespace {

class Pool {
 public:
  std::unique_ptr<LeafStore::Slab> take() {
    {
      const std::lock_guard lock(mutex_);
      if (!slabs_.empty()) {
        auto slab = std::move(slabs_.back());
        slabs_.pop_back();
        return slab;
      }
    }
    return std::make_unique_for_overwrite<LeafStore::Slab>();
  }

  void give_back(std::vector<std::unique_ptr<LeafStore::Slab>>& slabs) {
    constexpr std::size_t kMostSlabs = (std::size_t{64} << 20) / sizeof(LeafStore::Slab);
    const std::lock_guard lock(mutex_);
    slabs_.reserve(kMostSlabs);
    while (!slabs.empty() && slabs_.size() < kMostSlabs) {
      slabs_.push_back(std::move(slabs.back()));
      slabs.pop_back();
    }
  }

 private:
  std::mutex mutex_;
  std::vector<std::unique_ptr<LeafStore::Slab>> slabs_;
};

/// Never destroyed, so that level sets of any lifetime can give back to it.
Pool& pool() {
  static Pool& instance = *new Pool;
  return instance;
}

}  // namespace

LeafStore::~LeafStore() { pool().give_back(slabs_); }

LeafStore::Slab* LeafStore::add_slab() {
  auto slab = pool().take();
  const std::lock_guard lock(mutex_);
  return slabs_.emplace_back(std::move(slab)).get();
}

}  // namespace vstent::sdf
