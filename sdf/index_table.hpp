// Numbers cells of a lattice in the order in which they are first met.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

namespace vstent::sdf {

/// A hash table from lattice indices to 0, 1, 2, ...
class IndexTable {
 public:
  using Index = std::array<int, 3>;

  std::size_t size() const { return indices_.size(); }
  const Index& index(std::size_t number) const { return indices_[number]; }
  std::size_t bytes() const {
    return slots_.capacity() * sizeof(int) + indices_.capacity() * sizeof(Index);
  }

  /// -1 for an absent one.
  int find(const Index& index) const {
    for (std::size_t slot = hash(index) & mask();; slot = (slot + 1) & mask()) {
      const int number = slots_[slot];
      if (number < 0 || equal(indices_[static_cast<std::size_t>(number)], index)) return number;
    }
  }

  int find_or_add(const Index& index) {
    const int found = find(index);
    if (found >= 0) return found;
    if (3 * (indices_.size() + 1) > slots_.size()) {
      slots_.assign(4 * slots_.size(), -1);
      for (std::size_t i = 0; i < indices_.size(); ++i) occupy(indices_[i], static_cast<int>(i));
    }
    indices_.push_back(index);
    occupy(index, static_cast<int>(indices_.size()) - 1);
    return static_cast<int>(indices_.size()) - 1;
  }

 private:
  std::size_t mask() const { return slots_.size() - 1; }
  static bool equal(const Index& a, const Index& b) {  // without a call
    return ((a[0] ^ b[0]) | (a[1] ^ b[1]) | (a[2] ^ b[2])) == 0;
  }
  void occupy(const Index& index, int number) {
    std::size_t slot = hash(index) & mask();
    while (slots_[slot] >= 0) slot = (slot + 1) & mask();
    slots_[slot] = number;
  }
  static std::size_t hash(const Index& index) {
    std::uint64_t h = static_cast<std::uint32_t>(index[0]) * 0x9E3779B97F4A7C15u;
    h = (h ^ static_cast<std::uint32_t>(index[1])) * 0xC2B2AE3D27D4EB4Fu;
    h = (h ^ static_cast<std::uint32_t>(index[2])) * 0x165667B19E3779F9u;
    return h ^ (h >> 32);
  }

  std::vector<int> slots_ = std::vector<int>(16, -1);
  std::vector<Index> indices_;
};

}  // namespace vstent::sdf
