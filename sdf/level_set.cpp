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
#include "sdf/memory.hpp"
#include "sdf/prepared_solid.hpp"
#include "sdf/rasteriser.hpp"

namespace vstent::sdf {
namespace {

using openvdb::FloatGrid;
using openvdb::FloatTree;
using LeafNode = FloatTree::LeafNodeType;

openvdb::Coord to_coord(const Index3& index) { return {index[0], index[1], index[2]}; }

/// What a block adds to the tree.
struct BlockLeaves {
  std::vector<std::unique_ptr<LeafNode>> leaves;
  std::vector<std::pair<openvdb::Coord, int>> inside;
  std::unique_ptr<LeafNode> spare;
};

LeafSink sink_into(BlockLeaves& block, const openvdb::Coord& first_node) {
  return {.spare =
              [&block] {
                if (!block.spare) {
                  block.spare =
                      std::make_unique<LeafNode>(openvdb::PartialCreate(), openvdb::Coord());
                  block.spare->buffer().allocate();
                }
                return block.spare->buffer().data();
              },
          .keep =
              [&block, &first_node](const Index3& origin, const LeafMask& active) {
                block.spare->setOrigin(to_coord(origin) - first_node);
                for (openvdb::Index word = 0; word < 8; ++word)
                  block.spare->getValueMask().getWord<openvdb::Index64>(word) = active[word];
                block.leaves.push_back(std::move(block.spare));
              },
          .fill_inside =
              [&block, &first_node](const Index3& origin, int size) {
                block.inside.emplace_back(to_coord(origin) - first_node, size);
              }};
}

/// The grid's indices count from the first block on, so that the tree's root has few children.
FloatGrid::Ptr build_grid(const Solid& solid, double voxel_size, double band) {
  const Rasteriser rasteriser(solid, voxel_size, band);
  const openvdb::Coord first_node = to_coord(rasteriser.first_node());
  std::vector<BlockLeaves> blocks(rasteriser.block_count());
  rasteriser.run([&](std::size_t block) { return sink_into(blocks[block], first_node); });

  const auto background = static_cast<float>(band);
  auto grid = FloatGrid::create(background);
  FloatTree& tree = grid->tree();
  openvdb::tree::ValueAccessor<FloatTree> accessor(tree);
  for (BlockLeaves& block : blocks) {
    for (auto& leaf : block.leaves) accessor.addLeaf(leaf.release());
    for (const auto& [origin, size] : block.inside) {
      for (int i = 0; i < size; i += kLeafSide) {
        for (int j = 0; j < size; j += kLeafSide) {
          for (int k = 0; k < size; k += kLeafSide)
            accessor.addTile(1, origin.offsetBy(i, j, k), -background, false);
        }
      }
    }
  }
  const auto transform = openvdb::math::Transform::createLinearTransform(voxel_size);
  transform->postTranslate(voxel_size * first_node.asVec3d());
  grid->setTransform(transform);
  grid->setGridClass(openvdb::GRID_LEVEL_SET);
  return grid;
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

/// Tells the directory where the tree's leaves are, and which tiles are inside.
void put_leaves(const FloatTree& tree, LeafDirectory& leaves) {
  const auto put_pages = [&](const openvdb::Coord& origin, int pages) {
    for (int i = 0; i < pages; ++i) {
      for (int j = 0; j < pages; ++j) {
        for (int k = 0; k < pages; ++k) {
          leaves.put_inside_page((origin.x() >> 7) + i, (origin.y() >> 7) + j,
                                 (origin.z() >> 7) + k);
        }
      }
    }
  };
  for (auto upper = tree.cbeginRootChildren(); upper; ++upper) {
    for (auto lower = upper->cbeginChildOn(); lower; ++lower) {
      for (auto leaf = lower->cbeginChildOn(); leaf; ++leaf) {
        const openvdb::Coord& origin = leaf->origin();
        leaves.put(origin.x() >> 3, origin.y() >> 3, origin.z() >> 3, leaf->buffer().data());
      }
      for (auto tile = lower->cbeginValueAll(); tile; ++tile) {
        const openvdb::Coord origin = tile.getCoord();
        if (*tile < 0) leaves.put_inside(origin.x() >> 3, origin.y() >> 3, origin.z() >> 3);
      }
    }
    for (auto tile = upper->cbeginValueAll(); tile; ++tile)
      if (*tile < 0) put_pages(tile.getCoord(), 1);
  }
  for (auto tile = tree.root().cbeginValueAll(); tile; ++tile)
    if (*tile < 0) put_pages(tile.getCoord(), 32);
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

/// Moves each point along its gradient by what step(point number, sample there) asks for.
template <class Step>
void move_points(std::vector<Vec3>& points, const LeafField& field, Step&& step) {
  tbb::parallel_for(tbb::blocked_range<std::size_t>(0, points.size(), 512), [&](const auto& range) {
    LeafCursor cursor(field);
    for (std::size_t i = range.begin(); i != range.end(); ++i) {
      const Sample sample = cursor.sample_closely(points[i]);
      points[i] -= step(i, sample) * sample.gradient;
    }
  });
}

/// OpenVDB's points are means of the crossings around them and lie inside of convex surfaces, and
/// its facets farther inside. Puts the points onto the zero level, then as far outwards as their
/// facets lie inwards on the mean, so that the volume is kept.
void settle(TriangleMesh& mesh, const LeafField& field) {
  for (int i = 0; i < 2; ++i)
    move_points(mesh.points, field, [](std::size_t, const Sample& s) { return s.distance; });
  std::vector<double> means(mesh.triangles.size());
  const auto corner = [&](const Triangle& t, std::size_t n) -> const Vec3& {
    return mesh.points[static_cast<std::size_t>(t[n % 3])];
  };
  tbb::parallel_for(tbb::blocked_range<std::size_t>(0, means.size(), 512), [&](const auto& range) {
    LeafCursor cursor(field);
    for (std::size_t i = range.begin(); i != range.end(); ++i) {
      const Triangle& t = mesh.triangles[i];
      for (std::size_t n = 0; n < 3; ++n)  // exact for a quadratic distance
        means[i] += cursor.sample_closely(0.5 * (corner(t, n) + corner(t, n + 1))).distance / 3;
    }
  });
  std::vector<double> weighted(mesh.points.size()), weights(mesh.points.size());
  for (std::size_t i = 0; i < means.size(); ++i) {
    const Triangle& t = mesh.triangles[i];
    const Vec3& a = corner(t, 0);
    const double area = (corner(t, 1) - a).cross(corner(t, 2) - a).norm();
    for (const int point : t) {
      weighted[static_cast<std::size_t>(point)] += area * means[i];
      weights[static_cast<std::size_t>(point)] += area;
    }
  }
  move_points(mesh.points, field, [&](std::size_t i, const Sample&) {
    return weights[i] > 0 ? weighted[i] / weights[i] : 0.0;
  });
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

LevelSet::Implementation::Implementation(FloatGrid::Ptr level_set, float inside)
    : grid(level_set),
      field{.leaves = {level_set->background(), inside < 0 ? inside : -level_set->background()},
            .voxel_size = level_set->voxelSize()[0],
            .outside = level_set->background(),
            .inside = inside < 0 ? inside : -level_set->background()} {
  const openvdb::Vec3d node = level_set->indexToWorld(openvdb::Coord(0));
  for (int axis = 0; axis < 3; ++axis) {
    field.origin[axis] = node[axis];
    first_node[static_cast<std::size_t>(axis)] =
        static_cast<int>(std::lround(node[axis] / field.voxel_size));
  }
  put_leaves(level_set->tree(), field.leaves);
}

LevelSet::LevelSet(std::shared_ptr<const Implementation> implementation)
    : implementation_(std::move(implementation)) {}

double LevelSet::voxel_size() const { return implementation_->field.voxel_size; }
double LevelSet::background() const { return static_cast<double>(implementation_->field.outside); }
std::size_t LevelSet::active_voxels() const { return implementation_->grid->activeVoxelCount(); }
std::size_t LevelSet::memory_bytes() const {
  return implementation_->grid->memUsage() + implementation_->field.leaves.bytes();
}

double LevelSet::node_value(const std::array<int, 3>& index) const {
  return static_cast<double>(implementation_->grid->tree().getValue(implementation_->coord(index)));
}

bool LevelSet::node_is_active(const std::array<int, 3>& index) const {
  return implementation_->grid->tree().isValueOn(implementation_->coord(index));
}

void LevelSet::for_each_active(const std::function<void(const Vec3&, double)>& visit) const {
  for (auto value = implementation_->grid->cbeginValueOn(); value; ++value) {
    openvdb::Coord last = value.getBoundingBox().max();
    for (auto node = value.getBoundingBox().begin(); node; ++node) {
      const Vec3 index((*node).x(), (*node).y(), (*node).z());
      visit(implementation_->field.origin + implementation_->field.voxel_size * index,
            static_cast<double>(*value));
      if (*node == last) break;
    }
  }
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
  settle(mesh, implementation_->field);
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
  return LevelSet(std::make_shared<const LevelSet::Implementation>(
      build_grid(solid, options.voxel_size, band)));
}

}  // namespace vstent::sdf
