// What LevelSet hides. Inside this folder only.
#pragma once

#include "sdf/leaf_field.hpp"
#include "sdf/leaf_store.hpp"
#include "sdf/level_set.hpp"

namespace vstent::sdf {

struct VdbGrid;  // level_set_grid.hpp

/// Either the leaves are ours and OpenVDB sees a copy when it is asked to do something, or they are
/// those of a grid that OpenVDB made.
struct LevelSet::Implementation {
  explicit Implementation(LeafField leaves) : field(std::move(leaves)) {}
  Implementation(LeafField leaves, std::size_t active, std::shared_ptr<const VdbGrid> of_openvdb)
      : field(std::move(leaves)), active_voxels(active), grid(std::move(of_openvdb)) {}

  LeafField field;
  LeafStore store;
  std::size_t active_voxels = 0;
  std::shared_ptr<const VdbGrid> grid;
};

std::size_t memory_bytes(const VdbGrid& grid);
double node_value(const VdbGrid& grid, const std::array<int, 3>& index);
bool node_is_active(const VdbGrid& grid, const std::array<int, 3>& index);

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
