#include "sdf/level_set.hpp"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <cassert>
#include <cmath>
#include <sstream>
#include <stdexcept>
#include <utility>

#include "sdf/level_set_implementation.hpp"
#include "sdf/memory.hpp"
#include "sdf/prepared_solid.hpp"
#include "sdf/rasteriser.hpp"

namespace vstent::sdf {

void check(const VoxelOptions& options) {
  if (!(options.voxel_size > 0) || !std::isfinite(options.voxel_size)) {
    throw std::invalid_argument("voxel size " + std::to_string(options.voxel_size) +
                                " mm is not positive");
  }
  if (!(options.half_width >= 1) || !std::isfinite(options.half_width)) {
    throw std::invalid_argument("half width " + std::to_string(options.half_width) +
                                " voxels is below 1");
  }
}

void refuse_memory(const VoxelOptions& options, double needed, double fitting_voxel_size) {
  std::ostringstream message;
  message.precision(3);
  message << "a level set with voxels of " << options.voxel_size << " mm needs about "
          << needed / (1 << 20) << " MiB, more than the limit of "
          << static_cast<double>(options.memory_limit) / (1 << 20) << " MiB; ";
  message.precision(6);
  if (fitting_voxel_size > 0) {
    message << "voxels of " << 1.001 * fitting_voxel_size << " mm fit";
  } else {
    message << "no voxel size fits";
  }
  throw std::length_error(message.str());
}

LevelSet::LevelSet(std::shared_ptr<const Implementation> implementation)
    : implementation_(std::move(implementation)) {}

double LevelSet::voxel_size() const { return implementation_->field.voxel_size; }
double LevelSet::background() const { return static_cast<double>(implementation_->field.outside); }
std::size_t LevelSet::active_voxels() const { return implementation_->active_voxels; }
std::size_t LevelSet::memory_bytes() const {
  const Implementation& own = *implementation_;
  return own.field.leaves.bytes() + own.store.bytes() +
         (own.grid ? sdf::memory_bytes(*own.grid) : 0);
}

double LevelSet::node_value(const std::array<int, 3>& index) const {
  const Implementation& own = *implementation_;
  if (own.grid) return sdf::node_value(*own.grid, index);
  const auto [i, j, k] = index;
  return static_cast<double>(
      own.field.leaves.find(i >> 3, j >> 3, k >> 3)[(i & 7) << 6 | (j & 7) << 3 | (k & 7)]);
}

bool LevelSet::node_is_active(const std::array<int, 3>& index) const {
  if (implementation_->grid) return sdf::node_is_active(*implementation_->grid, index);
  return std::abs(node_value(index)) < background();
}

Sample LevelSet::sample(const Vec3& x) const {
  return LeafCursor(implementation_->field).sample(x);
}

void LevelSet::sample(std::span<const Vec3> points, std::span<Sample> samples) const {
  assert(points.size() == samples.size());
  tbb::parallel_for(tbb::blocked_range<std::size_t>(0, points.size(), 512), [&](const auto& range) {
    LeafCursor(implementation_->field)
        .sample(points.subspan(range.begin(), range.size()),
                samples.subspan(range.begin(), range.size()));
  });
}

LevelSet voxelise(const Solid& solid, const VoxelOptions& options) {
  check(options);
  PreparedSolid pieces(solid);
  const double band = options.half_width * options.voxel_size;
  double largest_coordinate = band;
  const auto include = [&](const Vec3& end, double radius) {
    largest_coordinate = std::max(largest_coordinate, end.cwiseAbs().maxCoeff() + radius + band);
  };
  for (const Segment& s : solid.segments) include(s.a, s.radius_a), include(s.b, s.radius_b);
  for (const Strut& s : solid.struts) {
    const double radius = prepare(s).outer_radius();
    include(s.a, radius), include(s.b, radius);
  }
  if (largest_coordinate / options.voxel_size > (1 << 29)) {
    throw std::length_error("a coordinate of " + std::to_string(largest_coordinate) +
                            " mm cannot be indexed with voxels of " +
                            std::to_string(options.voxel_size) + " mm");
  }
  check_memory(options, [&](double h) { return estimated_bytes(solid, h, options.half_width); });
  const Rasteriser rasteriser(solid, std::move(pieces), options.voxel_size, band);
  const auto background = static_cast<float>(band);
  const auto level_set = std::make_shared<LevelSet::Implementation>(
      LeafField{.leaves = {rasteriser.blocks(), background, -background},
                .voxel_size = options.voxel_size,
                .outside = background,
                .inside = -background});
  level_set->active_voxels = rasteriser.run(level_set->field.leaves, level_set->store);
  return LevelSet(level_set);
}

}  // namespace vstent::sdf
