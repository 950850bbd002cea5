#include "sdf/leaf_directory.hpp"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

namespace vstent::sdf {

void LeafPage::fill_own(const float* values) {
  for (int i = 0; i < kSide; ++i) {
    for (int j = 0; j < kSide; ++j) {
      for (int k = 0; k < kSide; ++k) leaves[place(i, j, k)] = values;
    }
  }
}

LeafDirectory::LeafDirectory(IndexTable blocks, float outside, float inside)
    : blocks_(std::move(blocks)),
      pages_(std::make_unique_for_overwrite<LeafPage[]>(blocks_.size())),
      constants_(std::make_unique<Constants>()) {
  constants_->outside.fill(outside);
  constants_->inside.fill(inside);
}

void LeafDirectory::put(const IndexTable::Index& leaf, const float* values) {
  const auto [i, j, k] = leaf;
  const auto page = static_cast<std::size_t>(blocks_.find({i >> 2, j >> 2, k >> 2}));
  pages_[page].leaves[LeafPage::place(i & 3, j & 3, k & 3)] = values;
}

void LeafDirectory::complete() {
  constexpr int kSide = LeafPage::kSide;
  const auto complete_page = [&](std::size_t number) {
    const auto [x, y, z] = block(number);
    LeafPage& own = pages_[number];
    for (int next = 1; next < 8; ++next) {
      const int dx = next >> 2, dy = next >> 1 & 1, dz = next & 1;
      const LeafPage* page = find_page({x + dx, y + dy, z + dz});
      const float* constant =
          page ? nullptr : find(kSide * (x + dx), kSide * (y + dy), kSide * (z + dz));
      for (int i = 0; i < (dx ? 1 : kSide); ++i) {
        for (int j = 0; j < (dy ? 1 : kSide); ++j) {
          for (int k = 0; k < (dz ? 1 : kSide); ++k) {
            own.leaves[LeafPage::place(i + kSide * dx, j + kSide * dy, k + kSide * dz)] =
                page ? page->leaves[LeafPage::place(i, j, k)] : constant;
          }
        }
      }
    }
  };
  tbb::parallel_for(tbb::blocked_range<std::size_t>(0, size(), 16), [&](const auto& range) {
    for (std::size_t n = range.begin(); n != range.end(); ++n) complete_page(n);
  });
}

std::size_t LeafDirectory::bytes() const {
  return size() * sizeof(LeafPage) + sizeof(Constants) + blocks_.bytes() + inside_cubes_.bytes();
}

}  // namespace vstent::sdf
