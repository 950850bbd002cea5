// A solid voxelised into a narrow-band level set, sampled with gradients, that OpenVDB meshes,
// reads and writes. OpenVDB stays behind this header.
#pragma once

#include <array>
#include <cstddef>
#include <filesystem>
#include <functional>
#include <memory>
#include <span>
#include <string>

#include "sdf/solid.hpp"

namespace vstent::sdf {

struct VoxelOptions {
  double voxel_size = 0;  ///< mm
  double half_width = 3;  ///< narrow band on each side of the surface, in voxels
  std::size_t memory_limit =
      std::size_t{2} << 30;  ///< bytes; a level set that needs more is refused before it is built.
                             ///< surface() and write() copy it into an OpenVDB grid in passing
};

/// An immutable narrow-band signed distance field. Copies share the nodes; any number of threads
/// may sample it.
class LevelSet {
 public:
  double voxel_size() const;  ///< mm
  double background() const;  ///< mm: half_width * voxel_size
  std::size_t active_voxels() const;
  std::size_t memory_bytes() const;

  /// In single precision: trilinear value and central-difference (nodal) gradient, normalised:
  /// value within 1.1 h^2/(8 rho), gradient within 0.25 (h/rho)^2 rad away from seams. Outside the
  /// band: +-background and a zero gradient.
  Sample sample(const Vec3& x) const;
  void sample(std::span<const Vec3> points, std::span<Sample> samples) const;  ///< in parallel

  /// The nodes themselves, at world position index * voxel_size: for checks, not for speed.
  double node_value(const std::array<int, 3>& index) const;
  bool node_is_active(const std::array<int, 3>& index) const;
  void for_each_active(const std::function<void(const Vec3& node, double value)>& visit) const;

  /// Zero level set as triangles, outward: dual marching cubes of the OpenVDB tools, whose points
  /// are then moved so that the facets lie on it in the mean. A strut of 3 voxels per radius keeps
  /// its volume and area within 2 %, sharp edges apart.
  TriangleMesh surface() const;

  /// Writes a .vdb whose world units are millimetres. \throws std::runtime_error when the file
  /// cannot be written whole
  void write(const std::filesystem::path& path, const std::string& grid_name) const;
  static LevelSet read(const std::filesystem::path& path);

  struct Implementation;
  explicit LevelSet(std::shared_ptr<const Implementation> implementation);

 private:
  std::shared_ptr<const Implementation> implementation_;
};

/// Rasterises the solid leaf by leaf, in parallel; the same bits for any number of threads.
/// \throws std::invalid_argument a voxel size that is not positive, a half width below 1; an empty
/// or impossible solid \throws std::length_error the level set would need more than the memory
/// limit; says how much and what voxel size fits
LevelSet voxelise(const Solid& solid, const VoxelOptions& options);

/// The same for a closed, outward oriented surface (exact distances, signs by OpenVDB);
/// `interior_width` (mm) keeps exact distances that deep inside, for lumens.
LevelSet voxelise(const TriangleMesh& closed_surface, const VoxelOptions& options,
                  double interior_width = 0);

}  // namespace vstent::sdf
