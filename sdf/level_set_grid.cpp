#include "sdf/level_set_grid.hpp"

#include <openvdb/io/File.h>
#include <openvdb/tools/VolumeToMesh.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <mutex>
#include <sstream>
#include <stdexcept>

#include "sdf/surface_settling.hpp"

namespace vstent::sdf {
namespace {

using openvdb::FloatGrid;
using openvdb::FloatTree;
using LeafNode = FloatTree::LeafNodeType;
using openvdb::Coord;

constexpr int kBlockSide = kLeafSide * LeafPage::kSide;

Coord leaf_origin(const IndexTable::Index& leaf, const Coord& first_node) {
  return Coord(kLeafSide * leaf[0], kLeafSide * leaf[1], kLeafSide * leaf[2]) - first_node;
}

/// A copy of leaves that are ours. Its indices count from the first block on, so that the tree's
/// root has few children.
FloatGrid::ConstPtr copy_leaves(const LeafField& field) {
  const LeafDirectory& leaves = field.leaves;
  Coord first_node = Coord::max();
  for (std::size_t n = 0; n < leaves.size(); ++n) {
    const auto [i, j, k] = leaves.block(n);
    first_node.minComponent(Coord(kBlockSide * i, kBlockSide * j, kBlockSide * k));
  }
  const auto grid = FloatGrid::create(field.outside);
  openvdb::tree::ValueAccessor<FloatTree> accessor(grid->tree());
  for_each_leaf(leaves, [&](const IndexTable::Index& index, const float* values) {
    const Coord origin = leaf_origin(index, first_node);
    if (values == leaves.inside()) accessor.addTile(1, origin, field.inside, false);
    if (!leaves.is_leaf(values)) return;
    auto leaf = std::make_unique<LeafNode>(origin, field.outside);
    std::copy_n(values, kLeafNodes, leaf->buffer().data());
    for (openvdb::Index n = 0; n < kLeafNodes; ++n)
      if (std::abs(values[n]) < field.outside) leaf->getValueMask().setOn(n);
    accessor.addLeaf(leaf.release());
  });
  const auto transform = openvdb::math::Transform::createLinearTransform(field.voxel_size);
  transform->postTranslate(field.voxel_size * first_node.asVec3d());
  grid->setTransform(transform);
  grid->setGridClass(openvdb::GRID_LEVEL_SET);
  return grid;
}

FloatGrid::ConstPtr grid_of(const LevelSet::Implementation& level_set) {
  if (level_set.grid) return level_set.grid->grid;
  initialise_openvdb();
  return copy_leaves(level_set.field);
}

// A .vdb file starts with a magic number (8 bytes), three versions (4 each), a flag (1) and 36
// characters that OpenVDB fills at random. Ours hold a checksum of all that follows: equal grids
// give equal files, and damage is noticed.
constexpr std::size_t kStampOffset = 8 + 4 + 4 + 4 + 1;
constexpr std::size_t kStampLength = 36;
constexpr std::string_view kStampMark = "76737465-6e74-8000-";

std::string stamp_of(std::string_view file) {
  std::uint64_t hash = 0xCBF29CE484222325u;  // FNV-1a
  for (const char c : file.substr(kStampOffset + kStampLength)) {
    hash = (hash ^ static_cast<unsigned char>(c)) * 0x100000001B3u;
  }
  std::ostringstream text;
  text << std::hex << std::setfill('0') << kStampMark << std::setw(4) << (hash >> 48) << '-'
       << std::setw(12) << (hash & 0xFFFFFFFFFFFFu);
  return text.str();
}

std::string whole_file(const std::filesystem::path& path) {
  std::ifstream in(path, std::ios::binary);
  std::ostringstream bytes;
  bytes << in.rdbuf();
  if (!in || !bytes) throw std::runtime_error("cannot be read");
  return std::move(bytes).str();
}

template <class Iterator>
IndexTable::Index index_of(const Iterator& node, int shift) {
  const Coord origin = node.getCoord() >> static_cast<std::size_t>(shift);
  return {origin.x(), origin.y(), origin.z()};
}

/// The leaves of OpenVDB's tree, and where they are inside.
LeafDirectory directory_of(const FloatTree& tree, float outside, float inside) {
  IndexTable blocks;
  const auto for_each_of_tree = [&](auto&& visit_leaf, auto&& visit_inside) {
    for (auto upper = tree.cbeginRootChildren(); upper; ++upper) {
      for (auto lower = upper->cbeginChildOn(); lower; ++lower) {
        for (auto leaf = lower->cbeginChildOn(); leaf; ++leaf)
          visit_leaf(index_of(leaf, 3), leaf->buffer().data());
        for (auto tile = lower->cbeginValueAll(); tile; ++tile)
          if (*tile < 0) visit_leaf(index_of(tile, 3), nullptr);
      }
      for (auto tile = upper->cbeginValueAll(); tile; ++tile)
        if (*tile < 0) visit_inside(index_of(tile, 7), 1);
    }
    for (auto tile = tree.root().cbeginValueAll(); tile; ++tile)
      if (*tile < 0) visit_inside(index_of(tile, 7), 32);
  };
  for_each_of_tree(
      [&](const IndexTable::Index& leaf, const float*) {
        blocks.find_or_add({leaf[0] >> 2, leaf[1] >> 2, leaf[2] >> 2});
      },
      [](const IndexTable::Index&, int) {});
  LeafDirectory leaves(std::move(blocks), outside, inside);
  for (std::size_t n = 0; n < leaves.size(); ++n) leaves.page(n).fill_own(leaves.outside());
  for_each_of_tree(
      [&](const IndexTable::Index& leaf, const float* values) {
        leaves.put(leaf, values ? values : leaves.inside());
      },
      [&](const IndexTable::Index& first, int cubes) {
        for (int i = 0; i < cubes; ++i) {
          for (int j = 0; j < cubes; ++j) {
            for (int k = 0; k < cubes; ++k)
              leaves.put_inside_cube({first[0] + i, first[1] + j, first[2] + k});
          }
        }
      });
  leaves.complete();
  return leaves;
}

void check_grid(const FloatGrid& grid) {
  const auto& transform = grid.transform();
  const openvdb::Vec3d size = transform.voxelSize();
  if (!transform.isLinear() || !transform.hasUniformScale() || !std::isfinite(size[0]) ||
      !(size[0] > 0)) {
    throw std::runtime_error("its voxels are not cubes");
  }
  const openvdb::Vec3d origin = transform.indexToWorld(openvdb::Vec3d(0.0));
  for (int axis = 0; axis < 3; ++axis) {
    openvdb::Vec3d step(0.0);
    step[axis] = 1;
    const openvdb::Vec3d along = transform.indexToWorld(step) - origin;
    if (!(std::abs(along[axis] - size[0]) <= 1e-9 * size[0] + 1e-12 * origin.length())) {
      throw std::runtime_error("its voxels are rotated");
    }
  }
  const float background = grid.background();
  if (!std::isfinite(background) || !(background > 0))
    throw std::runtime_error("its background is not positive");
  if (grid.activeVoxelCount() == 0) throw std::runtime_error("it holds no active voxel");
  for (auto value = grid.cbeginValueAll(); value; ++value) {
    if (!std::isfinite(*value)) throw std::runtime_error("it holds a value that is not finite");
  }
}

}  // namespace

void initialise_openvdb() {
  static std::once_flag once;
  std::call_once(once, [] { openvdb::initialize(); });
}

LevelSet level_set_of(FloatGrid::ConstPtr grid, float inside) {
  const double h = grid->voxelSize()[0];
  const float outside = grid->background();
  if (!(inside < 0)) inside = -outside;
  const openvdb::Vec3d origin = grid->indexToWorld(Coord(0));
  const auto node = [&](int axis) { return static_cast<int>(std::lround(origin[axis] / h)); };
  return LevelSet(std::make_shared<const LevelSet::Implementation>(
      LeafField{.leaves = directory_of(grid->tree(), outside, inside),
                .voxel_size = h,
                .origin = {origin[0], origin[1], origin[2]},
                .outside = outside,
                .inside = inside},
      grid->activeVoxelCount(),
      std::make_shared<const VdbGrid>(VdbGrid{grid, {node(0), node(1), node(2)}})));
}

std::size_t memory_bytes(const VdbGrid& grid) { return grid.grid->memUsage(); }

double node_value(const VdbGrid& grid, const std::array<int, 3>& index) {
  return static_cast<double>(grid.grid->tree().getValue(grid.coord(index)));
}

bool node_is_active(const VdbGrid& grid, const std::array<int, 3>& index) {
  return grid.grid->tree().isValueOn(grid.coord(index));
}

void LevelSet::for_each_active(const std::function<void(const Vec3&, double)>& visit) const {
  const FloatGrid::ConstPtr grid = grid_of(*implementation_);
  const openvdb::Vec3d origin = grid->indexToWorld(Coord(0));
  for (auto value = grid->cbeginValueOn(); value; ++value) {
    const Coord last = value.getBoundingBox().max();
    for (auto node = value.getBoundingBox().begin(); node; ++node) {
      const openvdb::Vec3d x = origin + voxel_size() * (*node).asVec3d();
      visit({x[0], x[1], x[2]}, static_cast<double>(*value));
      if (*node == last) break;
    }
  }
}

TriangleMesh LevelSet::surface() const {
  std::vector<openvdb::Vec3s> points;
  std::vector<openvdb::Vec3I> triangles;
  std::vector<openvdb::Vec4I> quads;
  openvdb::tools::volumeToMesh(*grid_of(*implementation_), points, triangles, quads, 0.0, 0.0);
  TriangleMesh mesh;
  mesh.points.reserve(points.size());
  for (const auto& p : points) {
    mesh.points.emplace_back(static_cast<double>(p[0]), static_cast<double>(p[1]),
                             static_cast<double>(p[2]));
  }
  const auto index = [](openvdb::Index32 i) { return static_cast<int>(i); };
  // OpenVDB orders its polygons clockwise seen from outside.
  for (const auto& t : triangles) mesh.triangles.push_back({index(t[0]), index(t[2]), index(t[1])});
  for (const auto& q : quads) {
    mesh.triangles.push_back({index(q[0]), index(q[2]), index(q[1])});
    mesh.triangles.push_back({index(q[0]), index(q[3]), index(q[2])});
  }
  settle(mesh, implementation_->field);
  return mesh;
}

void LevelSet::write(const std::filesystem::path& path, const std::string& grid_name) const {
  std::filesystem::path draft = path;
  draft += ".part" + std::to_string(::getpid());
  try {
    // The copy is shallow: it shares the tree, and only its name is its own.
    FloatGrid::Ptr named = openvdb::ConstPtrCast<FloatGrid>(grid_of(*implementation_))->copy();
    named->setName(grid_name);
    openvdb::io::File file(draft.string());
    file.write(openvdb::GridCPtrVec{named});
    file.close();
    const std::string stamp = stamp_of(whole_file(draft));
    std::fstream bytes(draft, std::ios::binary | std::ios::in | std::ios::out);
    bytes.seekp(static_cast<std::streamoff>(kStampOffset));
    bytes.write(stamp.data(), static_cast<std::streamsize>(stamp.size()));
    bytes.close();
    if (!bytes) throw std::runtime_error("the disk may be full");
    std::filesystem::rename(draft, path);
  } catch (const std::exception& error) {
    std::error_code ignored;
    std::filesystem::remove(draft, ignored);
    throw std::runtime_error(path.string() + ": cannot be written: " + error.what());
  }
}

LevelSet LevelSet::read(const std::filesystem::path& path) {
  try {
    initialise_openvdb();
    const std::string bytes = whole_file(path);
    if (bytes.size() < kStampOffset + kStampLength)
      throw std::runtime_error("too short for a .vdb file");
    const auto stamp = std::string_view(bytes).substr(kStampOffset, kStampLength);
    if (stamp.starts_with(kStampMark) && stamp != stamp_of(bytes)) {
      throw std::runtime_error("damaged: its checksum does not match its contents");
    }
    openvdb::io::File file(path.string());
    file.open(/*delayLoad=*/false);
    const openvdb::GridPtrVecPtr grids = file.getGrids();
    file.close();
    if (!grids || grids->empty()) throw std::runtime_error("it holds no grid");
    const auto grid = openvdb::gridPtrCast<FloatGrid>(grids->front());
    if (!grid)
      throw std::runtime_error("its first grid is of type " + grids->front()->type() +
                               ", not float");
    if (grid->getGridClass() != openvdb::GRID_LEVEL_SET)
      throw std::runtime_error("its first grid is not a level set");
    check_grid(*grid);
    return level_set_of(grid);
  } catch (const std::exception& error) {
    throw std::runtime_error(path.string() + ": not a readable level set: " + error.what());
  }
}

}  // namespace vstent::sdf
