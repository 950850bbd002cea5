// Where the values of each leaf of 8^3 nodes are, whoever owns them. Inside this folder only.
#pragma once

#include <array>
#include <cstddef>
#include <memory>

#include "sdf/index_table.hpp"

namespace vstent::sdf {

/// The leaves of a block of 4^3, and those that follow it along each axis: so the eight leaves from
/// any one of its own on are in one page.
struct LeafPage {
  static constexpr int kSide = 4;  ///< leaves

  /// Of leaf (i, j, k) counted from the block's first.
  static std::size_t place(int i, int j, int k) {
    return static_cast<std::size_t>(25 * i + 5 * j + k);
  }
  /// The inverse.
  static std::array<int, 3> indices(int place) { return {place / 25, place / 5 % 5, place % 5}; }
  void fill_own(const float* values);

  std::array<const float*, 125> leaves;
};

/// Finds the 512 values of the leaf (i, j, k), which begins at node 8 (i, j, k). Where no leaf was
/// put, they are all `outside`, or `inside` where that was said.
class LeafDirectory {
 public:
  /// Of leaves in these blocks only; block (i, j, k) begins at leaf 4 (i, j, k). Pages are not
  /// filled.
  LeafDirectory(IndexTable blocks, float outside, float inside);

  const float* outside() const { return constants_->outside.data(); }
  const float* inside() const { return constants_->inside.data(); }
  std::size_t size() const { return blocks_.size(); }
  const IndexTable::Index& block(std::size_t page) const { return blocks_.index(page); }
  LeafPage& page(std::size_t number) { return pages_[number]; }
  const LeafPage& page(std::size_t number) const { return pages_[number]; }
  /// Into a page that has been filled.
  void put(const IndexTable::Index& leaf, const float* values);
  /// A cube of 4^3 blocks that lies inside, but for those that have pages; the first is 4 (i, j, k).
  void put_inside_cube(const IndexTable::Index& cube) { inside_cubes_.find_or_add(cube); }
  /// Once all pages have their own leaves: adds those that follow, in parallel.
  void complete();

  /// Null where the block has none.
  const LeafPage* find_page(const IndexTable::Index& block) const {
    const int page = blocks_.find(block);
    return page < 0 ? nullptr : &pages_[static_cast<std::size_t>(page)];
  }
  const float* find(int i, int j, int k) const {
    const LeafPage* page = find_page({i >> 2, j >> 2, k >> 2});
    if (page) return page->leaves[LeafPage::place(i & 3, j & 3, k & 3)];
    return inside_cubes_.find({i >> 4, j >> 4, k >> 4}) < 0 ? outside() : inside();
  }
  bool is_leaf(const float* values) const { return values != outside() && values != inside(); }
  std::size_t bytes() const;

 private:
  struct Constants {
    alignas(64) std::array<float, 512> outside, inside;
  };

  IndexTable blocks_, inside_cubes_;
  std::unique_ptr<LeafPage[]> pages_;  // of the blocks
  std::unique_ptr<Constants> constants_;
};

/// Visits all places for leaves in a fixed order: visit(index, the values there).
template <class Visit>
void for_each_leaf(const LeafDirectory& leaves, Visit&& visit) {
  constexpr int kSide = LeafPage::kSide;
  for (std::size_t n = 0; n < leaves.size(); ++n) {
    const auto [x, y, z] = leaves.block(n);
    for (int i = 0; i < kSide; ++i) {
      for (int j = 0; j < kSide; ++j) {
        for (int k = 0; k < kSide; ++k) {
          const float* values = leaves.page(n).leaves[LeafPage::place(i, j, k)];
          visit(IndexTable::Index{kSide * x + i, kSide * y + j, kSide * z + k}, values);
        }
      }
    }
  }
}

}  // namespace vstent::sdf
