#include "sdf/level_set.hpp"

#include <openvdb/io/File.h>
#include <openvdb/tools/VolumeToMesh.h>
#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>
#include <unistd.h>

#include <algorithm>
#include <cassert>
#include <cmath>
#include <cstring>
#include <fstream>
#include <mutex>
#include <sstream>
#include <stdexcept>

#include "sdf/level_set_grid.hpp"
#include "sdf/prepared_segment.hpp"
#include "sdf/rasteriser.hpp"

namespace vstent::sdf {
namespace {

using openvdb::FloatGrid;
using openvdb::FloatTree;
using LeafNode = FloatTree::LeafNodeType;

openvdb::Coord to_coord(const Index3& index) { return {index[0], index[1], index[2]}; }

std::unique_ptr<LeafNode> to_leaf(const RasterLeaf& raster, float background) {
  auto leaf = std::make_unique<LeafNode>(to_coord(raster.origin), background, false);
  std::copy(raster.values.begin(), raster.values.end(), leaf->buffer().data());
  LeafNode::NodeMaskType mask;
  for (openvdb::Index word = 0; word < 8; ++word)
    mask.getWord<openvdb::Index64>(word) = raster.active[word];
  leaf->setValueMask(mask);
  return leaf;
}

FloatGrid::Ptr to_grid(std::vector<RasterPiece> pieces, double voxel_size, double band) {
  const auto background = static_cast<float>(band);
  std::vector<std::vector<std::unique_ptr<LeafNode>>> leaves(pieces.size());
  tbb::parallel_for(std::size_t{0}, pieces.size(), [&](std::size_t i) {
    for (auto& raster : pieces[i].leaves) {
      leaves[i].push_back(to_leaf(*raster, background));
      raster.reset();
    }
  });
  auto grid = FloatGrid::create(background);
  FloatTree& tree = grid->tree();
  openvdb::tree::ValueAccessor<FloatTree> accessor(tree);
  for (std::size_t i = 0; i < pieces.size(); ++i) {
    for (auto& leaf : leaves[i]) accessor.addLeaf(leaf.release());
    for (const InsideBlock& block : pieces[i].inside) {
      const openvdb::Coord origin = to_coord(block.origin);
      if (block.size == 8) {
        accessor.addTile(1, origin, -background, false);
      } else {
        tree.fill(openvdb::CoordBBox::createCube(origin, block.size), -background, false);
      }
    }
  }
  grid->setTransform(openvdb::math::Transform::createLinearTransform(voxel_size));
  grid->setGridClass(openvdb::GRID_LEVEL_SET);
  return grid;
}

/// The nodes around a point: 4^3 of them, of which value and nodal gradient need all but the
/// corners.
struct Stencil {
  std::array<std::array<std::array<float, 4>, 4>, 4> values;

  /// Nodes in no leaf lie beyond the band: they get the value `absent`.
  void gather(const LeafTable& leaves, const std::array<int, 3>& base, float absent) {
    const float* leaf = nullptr;
    int leaf_i = 0, leaf_j = 0, leaf_k = 0;
    const auto find = [&](int i, int j, int k) {
      if (!leaf || i != leaf_i || j != leaf_j || k != leaf_k) {
        leaf = leaves.find(i, j, k);
        leaf_i = i, leaf_j = j, leaf_k = k;
      }
      return leaf;
    };
    const int x0 = base[0] - 1, y0 = base[1] - 1, z0 = base[2] - 1;
    const int z_split = std::min(4, 8 - (z0 & 7));  // nodes of a row before it enters the next leaf
    for (int z = 0; z < 4; z = z == 0 ? z_split : 4) {
      const int run = z == 0 ? z_split : 4 - z_split;
      for (int i = 0; i < 4; ++i) {
        for (int j = 0; j < 4; ++j) {
          if ((i == 0 || i == 3) && (j == 0 || j == 3)) continue;
          const float* found = find((x0 + i) >> 3, (y0 + j) >> 3, (z0 + z) >> 3);
          if (!found) {
            std::fill_n(row(i, j) + z, run, absent);
            continue;
          }
          const int offset = ((x0 + i) & 7) << 6 | ((y0 + j) & 7) << 3 | ((z0 + z) & 7);
          std::copy_n(found + offset, run, row(i, j) + z);
        }
      }
    }
  }

  bool is_within(float inside, float outside) const {
    bool within = true;
    for (std::size_t i = 0; i < 4; ++i) {
      for (std::size_t j = 0; j < 4; ++j) {
        const bool middle_i = i == 1 || i == 2;
        const bool middle_j = j == 1 || j == 2;
        if (!middle_i && !middle_j) continue;
        const auto& row = values[i][j];
        within &= row[1] > inside && row[1] < outside && row[2] > inside && row[2] < outside;
        if (middle_i && middle_j)
          within &= row[0] > inside && row[0] < outside && row[3] > inside && row[3] < outside;
      }
    }
    return within;
  }

 private:
  float* row(int i, int j) {
    return values[static_cast<std::size_t>(i)][static_cast<std::size_t>(j)].data();
  }
};

/// Weights of four nodes for the value, and for the derivative by central differences, linear in
/// between.
struct Weights {
  std::array<double, 4> value, slope;
  explicit Weights(double f)
      : value{0, 1 - f, f, 0}, slope{-0.5 * (1 - f), -0.5 * f, 0.5 * (1 - f), 0.5 * f} {}
};

Sample interpolate(const Stencil& stencil, const Vec3& fraction) {
  const Weights x(fraction.x()), y(fraction.y()), z(fraction.z());
  double value = 0;
  Vec3 gradient = Vec3::Zero();
  for (std::size_t i = 0; i < 4; ++i) {
    double plane_value = 0, plane_dy = 0, plane_dz = 0;
    const bool middle_i = i == 1 || i == 2;
    for (std::size_t j = 0; j < 4; ++j) {
      const bool middle_j = j == 1 || j == 2;
      if (!middle_i && !middle_j) continue;
      const auto& row = stencil.values[i][j];
      const double row_value =
          z.value[1] * static_cast<double>(row[1]) + z.value[2] * static_cast<double>(row[2]);
      plane_value += y.value[j] * row_value;
      if (!middle_i) continue;
      plane_dy += y.slope[j] * row_value;
      if (!middle_j) continue;
      double row_slope = 0;
      for (std::size_t k = 0; k < 4; ++k) row_slope += z.slope[k] * static_cast<double>(row[k]);
      plane_dz += y.value[j] * row_slope;
    }
    value += x.value[i] * plane_value;
    gradient += Vec3(x.slope[i] * plane_value, x.value[i] * plane_dy, x.value[i] * plane_dz);
  }
  const double norm = gradient.norm();
  return {value, norm > 0 ? Vec3(gradient / norm) : Vec3(Vec3::Zero())};
}

Sample sample_grid(const LevelSet::Implementation& level_set, const Vec3& x) {
  const auto beyond = [](float background) {
    return Sample{static_cast<double>(background), Vec3::Zero()};
  };
  const Vec3 index = (x - level_set.origin) / level_set.voxel_size;
  constexpr double kLargestIndex = 1 << 30;
  if (!((index.array().abs() < kLargestIndex).all())) return beyond(level_set.outside);
  const Vec3 floor = index.array().floor();
  const std::array<int, 3> base{static_cast<int>(floor.x()), static_cast<int>(floor.y()),
                                static_cast<int>(floor.z())};
  const auto beyond_at_base = [&] {
    const float nearest = level_set.grid->tree().getValue({base[0], base[1], base[2]});
    return beyond(nearest < 0 ? level_set.inside : level_set.outside);
  };
  Stencil stencil;
  stencil.gather(level_set.leaves, base, level_set.outside);
  if (!stencil.is_within(level_set.inside, level_set.outside)) return beyond_at_base();
  const Sample sample = interpolate(stencil, index - floor);
  if (sample.distance >= static_cast<double>(level_set.outside) - level_set.voxel_size)
    return beyond(level_set.outside);
  if (sample.distance <= static_cast<double>(level_set.inside) + level_set.voxel_size)
    return beyond(level_set.inside);
  return sample;
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

void LeafTable::build(const FloatTree& tree) {
  const std::size_t leaves = tree.leafCount();
  std::size_t slots = 16;
  while (slots < 3 * leaves) slots *= 2;
  entries_.assign(slots, {});
  mask_ = slots - 1;
  for (auto leaf = tree.cbeginLeaf(); leaf; ++leaf) {
    const openvdb::Coord origin = leaf->origin();
    const int i = origin.x() >> 3, j = origin.y() >> 3, k = origin.z() >> 3;
    std::size_t slot = hash(i, j, k) & mask_;
    while (entries_[slot].values) slot = (slot + 1) & mask_;
    entries_[slot] = {i, j, k, leaf->buffer().data()};
  }
}

LevelSet::Implementation::Implementation(FloatGrid::Ptr level_set)
    : grid(level_set), voxel_size(level_set->voxelSize()[0]), outside(level_set->background()) {
  const openvdb::Vec3d node = level_set->indexToWorld(openvdb::Coord(0));
  origin = Vec3(node[0], node[1], node[2]);
  inside = -outside;
  leaves.build(level_set->tree());
}

LevelSet::LevelSet(std::shared_ptr<const Implementation> implementation)
    : implementation_(std::move(implementation)) {}

double LevelSet::voxel_size() const { return implementation_->voxel_size; }
double LevelSet::background() const { return static_cast<double>(implementation_->outside); }
std::size_t LevelSet::active_voxels() const { return implementation_->grid->activeVoxelCount(); }
std::size_t LevelSet::memory_bytes() const {
  return implementation_->grid->memUsage() + implementation_->leaves.bytes();
}

double LevelSet::node_value(const std::array<int, 3>& index) const {
  return static_cast<double>(implementation_->grid->tree().getValue(to_coord(index)));
}

bool LevelSet::node_is_active(const std::array<int, 3>& index) const {
  return implementation_->grid->tree().isValueOn(to_coord(index));
}

void LevelSet::for_each_active(const std::function<void(const Vec3&, double)>& visit) const {
  for (auto value = implementation_->grid->cbeginValueOn(); value; ++value) {
    openvdb::Coord last = value.getBoundingBox().max();
    for (auto node = value.getBoundingBox().begin(); node; ++node) {
      const Vec3 index((*node).x(), (*node).y(), (*node).z());
      visit(implementation_->origin + implementation_->voxel_size * index,
            static_cast<double>(*value));
      if (*node == last) break;
    }
  }
}

Sample LevelSet::sample(const Vec3& x) const { return sample_grid(*implementation_, x); }

void LevelSet::sample(std::span<const Vec3> points, std::span<Sample> samples) const {
  assert(points.size() == samples.size());
  tbb::parallel_for(tbb::blocked_range<std::size_t>(0, points.size(), 512), [&](const auto& range) {
    for (std::size_t i = range.begin(); i != range.end(); ++i)
      samples[i] = sample_grid(*implementation_, points[i]);
  });
}

TriangleMesh LevelSet::surface() const {
  std::vector<openvdb::Vec3s> points;
  std::vector<openvdb::Vec3I> triangles;
  std::vector<openvdb::Vec4I> quads;
  openvdb::tools::volumeToMesh(*implementation_->grid, points, triangles, quads, 0.0, 0.0);
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
  return mesh;
}

void LevelSet::write(const std::filesystem::path& path, const std::string& grid_name) const {
  std::filesystem::path draft = path;
  draft += ".part" + std::to_string(::getpid());
  try {
    // The copy is shallow: it shares the tree, and only its name is its own.
    FloatGrid::Ptr named = openvdb::ConstPtrCast<FloatGrid>(implementation_->grid)->copy();
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
    return LevelSet(std::make_shared<const Implementation>(grid));
  } catch (const std::exception& error) {
    throw std::runtime_error(path.string() + ": not a readable level set: " + error.what());
  }
}

LevelSet voxelise(const Solid& solid, const VoxelOptions& options) {
  initialise_openvdb();
  check(options);
  check(solid);
  const double band = options.half_width * options.voxel_size;
  double largest_coordinate = band;
  for (const Segment& s : solid.segments) {
    const double reach = std::max(s.radius_a, s.radius_b) + band;
    largest_coordinate = std::max(
        {largest_coordinate, s.a.cwiseAbs().maxCoeff() + reach, s.b.cwiseAbs().maxCoeff() + reach});
  }
  if (largest_coordinate / options.voxel_size > (1 << 29)) {
    throw std::length_error("a coordinate of " + std::to_string(largest_coordinate) +
                            " mm cannot be indexed with voxels of " +
                            std::to_string(options.voxel_size) + " mm");
  }
  check_memory(options, [&](double h) { return estimated_bytes(solid, h, options.half_width); });
  return LevelSet(std::make_shared<const LevelSet::Implementation>(
      to_grid(rasterise(solid, options.voxel_size, band), options.voxel_size, band)));
}

}  // namespace vstent::sdf
