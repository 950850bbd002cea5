// What LevelSet hides: the OpenVDB grid, and where its leaves are for sampling. Included by the two
// files that see OpenVDB.
#pragma once

#include <openvdb/openvdb.h>

#include "sdf/leaf_field.hpp"
#include "sdf/level_set.hpp"

namespace vstent::sdf {

struct LevelSet::Implementation {
  /// `inside` is the value deeper than the band; 0 stands for minus the background.
  explicit Implementation(openvdb::FloatGrid::Ptr level_set, float inside = 0);

  openvdb::Coord coord(const std::array<int, 3>& node) const {
    return {node[0] - first_node[0], node[1] - first_node[1], node[2] - first_node[2]};
  }

  openvdb::FloatGrid::ConstPtr grid;
  LeafField field;
  std::array<int, 3> first_node{};  ///< the grid's node (0, 0, 0) is at first_node * voxel size
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
