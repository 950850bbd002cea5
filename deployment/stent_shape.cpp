#include "deployment/stent_shape.hpp"

#include "sdf/exact_field.hpp"
#include "sdf/signed_mesh_distance.hpp"

namespace vstent::deployment {

sdf::LevelSet voxelised(const StentShape& shape, const sdf::VoxelOptions& options) {
  return std::visit([&](const auto& stent) { return sdf::voxelise(stent, options); }, shape);
}

TriangleMesh surface_of(const StentShape& shape, const sdf::LevelSet& level_set) {
  const auto* mesh = std::get_if<TriangleMesh>(&shape);
  return mesh ? *mesh : level_set.surface();
}

TriangleMesh surface_of(const StentShape& shape, const sdf::VoxelOptions& options) {
  const auto* mesh = std::get_if<TriangleMesh>(&shape);
  return mesh ? *mesh : voxelised(shape, options).surface();
}

std::vector<double> exact_distances(const StentShape& shape, std::span<const Vec3> points) {
  std::vector<double> result(points.size());
  if (const auto* mesh = std::get_if<TriangleMesh>(&shape)) {
    sdf::SignedMeshDistance(*mesh).distances(points, result);
    return result;
  }
  std::vector<sdf::Sample> samples(points.size());
  sdf::ExactField(std::get<sdf::Solid>(shape)).sample(points, samples);
  for (std::size_t i = 0; i < samples.size(); ++i) result[i] = samples[i].distance;
  return result;
}

}  // namespace vstent::deployment
