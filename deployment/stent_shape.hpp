// A stent in space: pieces with closed forms, or a closed surface.
#pragma once

#include <span>
#include <variant>

#include "sdf/level_set.hpp"

namespace vstent::deployment {

using StentShape = std::variant<sdf::Solid, TriangleMesh>;

sdf::LevelSet voxelised(const StentShape& shape, const sdf::VoxelOptions& options);

/// Its surface: that of the level set, or the surface that it is.
TriangleMesh surface_of(const StentShape& shape, const sdf::LevelSet& level_set);
TriangleMesh surface_of(const StentShape& shape, const sdf::VoxelOptions& options);

/// Exact distances (mm, negative inside), in parallel.
std::vector<double> exact_distances(const StentShape& shape, std::span<const Vec3> points);

}  // namespace vstent::deployment
