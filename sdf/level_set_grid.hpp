// What LevelSet hides: the OpenVDB grid, and a table of its leaves for sampling. Included by the
// two files that see OpenVDB.
#pragma once

#include <openvdb/openvdb.h>

#include <array>
#include <cstdint>
#include <vector>

#include "sdf/level_set.hpp"

namespace vstent::sdf {

/// Finds the values of the 8^3 leaf at given leaf coordinates (node index >> 3) by hashing; nothing
/// for absent leaves.
class LeafTable {
 public:
  void build(const openvdb::FloatTree& tree);
  const float* find(int i, int j, int k) const {
    for (std::size_t slot = hash(i, j, k) & mask_;; slot = (slot + 1) & mask_) {
      const Entry& entry = entries_[slot];
      if (!entry.values || (entry.i == i && entry.j == j && entry.k == k)) return entry.values;
    }
  }
  std::size_t bytes() const { return entries_.size() * sizeof(Entry); }

 private:
  struct Entry {
    int i = 0, j = 0, k = 0;
    const float* values = nullptr;
  };
  static std::size_t hash(int i, int j, int k) {
    std::uint64_t h = static_cast<std::uint32_t>(i) * 0x9E3779B97F4A7C15u;
    h = (h ^ static_cast<std::uint32_t>(j)) * 0xC2B2AE3D27D4EB4Fu;
    h = (h ^ static_cast<std::uint32_t>(k)) * 0x165667B19E3779F9u;
    return h ^ (h >> 32);
  }
  std::vector<Entry> entries_ = std::vector<Entry>(1);
  std::size_t mask_ = 0;
};

struct LevelSet::Implementation {
  explicit Implementation(openvdb::FloatGrid::Ptr level_set);

  openvdb::FloatGrid::ConstPtr grid;
  LeafTable leaves;
  double voxel_size = 0;
  Vec3 origin = Vec3::Zero();  ///< world position of node (0, 0, 0)
  float outside = 0;           ///< the value beyond the band, outside
  float inside = 0;            ///< and inside, negative
};

/// Registers OpenVDB's types once; any number of threads may call it.
void initialise_openvdb();

/// \throws std::invalid_argument a voxel size that is not positive and finite, a half width below 1
void check(const VoxelOptions& options);

/// \throws std::length_error with the figures of the refusal; a fitting voxel size of 0 means that
/// none fits
[[noreturn]] void refuse_memory(const VoxelOptions& options, double needed,
                                double fitting_voxel_size);

/// \throws std::length_error `needed_at(voxel size)` exceeds the limit; says how much and what
/// voxel size fits
template <class NeededAt>
void check_memory(const VoxelOptions& options, NeededAt&& needed_at) {
  const auto limit = static_cast<double>(options.memory_limit);
  const double needed = needed_at(options.voxel_size);
  if (needed <= limit) return;
  double too_fine = options.voxel_size;
  double fits = 2 * too_fine;
  for (int i = 0; i < 200 && needed_at(fits) > limit; ++i) fits *= 2;
  for (int i = 0; i < 40; ++i) {
    const double middle = 0.5 * (too_fine + fits);
    (needed_at(middle) > limit ? too_fine : fits) = middle;
  }
  refuse_memory(options, needed, needed_at(fits) <= limit ? fits : 0);
}

}  // namespace vstent::sdf
