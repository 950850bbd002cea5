#include <openvdb/tools/ChangeBackground.h>
#include <openvdb/tools/MeshToVolume.h>
#include <openvdb/tree/LeafManager.h>

#include <Eigen/Geometry>
#include <cmath>
#include <stdexcept>

#include "sdf/level_set_grid.hpp"
#include "sdf/memory.hpp"
#include "sdf/mesh_distance.hpp"

namespace vstent::sdf {
namespace {

void check(const TriangleMesh& surface) {
  if (surface.triangles.empty()) throw std::invalid_argument("surface: no triangles");
  const int points = static_cast<int>(surface.points.size());
  for (std::size_t i = 0; i < surface.triangles.size(); ++i) {
    for (const int point : surface.triangles[i]) {
      if (point < 0 || point >= points) {
        throw std::invalid_argument("surface: triangle " + std::to_string(i) +
                                    " names a point that does not exist");
      }
      if (!surface.points[static_cast<std::size_t>(point)].allFinite()) {
        throw std::invalid_argument("surface: point " + std::to_string(point) + " is not finite");
      }
    }
  }
}

double area(const TriangleMesh& surface) {
  double total = 0;
  for (const auto& [i, j, k] : surface.triangles) {
    const Vec3& a = surface.points[static_cast<std::size_t>(i)];
    const Vec3& b = surface.points[static_cast<std::size_t>(j)];
    const Vec3& c = surface.points[static_cast<std::size_t>(k)];
    total += 0.5 * (b - a).cross(c - a).norm();
  }
  return total;
}

/// What OpenVDB's converter asks of a mesh: points in index space.
struct IndexSpaceMesh {
  const TriangleMesh& mesh;
  double voxel_size;

  std::size_t polygonCount() const { return mesh.triangles.size(); }
  std::size_t pointCount() const { return mesh.points.size(); }
  std::size_t vertexCount(std::size_t) const { return 3; }
  void getIndexSpacePoint(std::size_t polygon, std::size_t corner, openvdb::Vec3d& position) const {
    const Vec3 p =
        mesh.points[static_cast<std::size_t>(mesh.triangles[polygon][corner])] / voxel_size;
    position = openvdb::Vec3d(p.x(), p.y(), p.z());
  }
};

/// The converter knows inside from outside but its distances err by a good part of a voxel: each
/// active node gets the exact one, with the sign it has, and leaves the band if that lies beyond
/// it.
void make_exact(openvdb::FloatGrid& grid, const TriangleMesh& surface, double outside,
                double inside) {
  const MeshDistance distance(surface);
  const double h = grid.voxelSize()[0];
  openvdb::tree::LeafManager<openvdb::FloatTree> leaves(grid.tree());
  leaves.foreach ([&](openvdb::FloatTree::LeafNodeType& leaf, std::size_t) {
    for (auto node = leaf.beginValueOn(); node; ++node) {
      const openvdb::Coord index = node.getCoord();
      const Vec3 x = h * Vec3(index.x(), index.y(), index.z());
      const auto old = static_cast<double>(*node);
      auto closest =
          distance.closest(x, std::abs(old) + 0.5 * h);  // a near guess prunes the search
      if (closest.triangle < 0) closest = distance.closest(x);
      node.setValue(static_cast<float>(std::copysign(closest.distance, old)));
      if (closest.distance >= (old < 0 ? inside : outside)) node.setValueOff();
    }
  });
}

}  // namespace

LevelSet voxelise(const TriangleMesh& closed_surface, const VoxelOptions& options,
                  double interior_width) {
  initialise_openvdb();
  check(options);
  check(closed_surface);
  const double h = options.voxel_size;
  if (!(interior_width >= 0)) throw std::invalid_argument("interior width is negative");
  for (const Vec3& p : closed_surface.points) {
    if (!(p.cwiseAbs().maxCoeff() / h < (1 << 29))) {
      throw std::length_error("a coordinate of " + std::to_string(p.cwiseAbs().maxCoeff()) +
                              " mm cannot be indexed with voxels of " + std::to_string(h) + " mm");
    }
  }
  const double surface_area = area(closed_surface);
  check_memory(options, [&](double voxel_size) {
    return estimated_bytes(surface_area, voxel_size, options.half_width + 1,
                           1 + std::max(options.half_width, interior_width / voxel_size));
  });
  const double inside_width = std::max(options.half_width, interior_width / h);
  const IndexSpaceMesh mesh{closed_surface, h};
  const auto transform = openvdb::math::Transform::createLinearTransform(h);
  // One voxel more than asked for, since the converter judges the band's edge by its own distances.
  auto grid = openvdb::tools::meshToVolume<openvdb::FloatGrid>(
      mesh, *transform, static_cast<float>(options.half_width + 1),
      static_cast<float>(inside_width + 1), openvdb::tools::DISABLE_RENORMALIZATION);
  make_exact(*grid, closed_surface, options.half_width * h, inside_width * h);
  openvdb::tools::changeAsymmetricLevelSetBackground(grid->tree(),
                                                     static_cast<float>(options.half_width * h),
                                                     static_cast<float>(-inside_width * h));
  grid->setGridClass(openvdb::GRID_LEVEL_SET);
  return level_set_of(grid, static_cast<float>(-inside_width * h));
}

}  // namespace vstent::sdf
