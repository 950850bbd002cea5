#include "sdf/rasteriser.hpp"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "sdf/prepared_segment.hpp"

namespace vstent::sdf {
namespace {

constexpr int kLeafSide = 8;
constexpr int kTileSide =
    4;  // a leaf is evaluated in eight tiles, each with its own short list of segments
constexpr int kTaskSide = 64;  // blocks of this size are the parallel tasks
constexpr int kTileNodes = kTileSide * kTileSide * kTileSide;

struct Block {
  Index3 origin;
  int size;
};

Block child(const Block& block, int octant) {
  const int half = block.size / 2;
  return {{block.origin[0] + (octant & 4 ? half : 0), block.origin[1] + (octant & 2 ? half : 0),
           block.origin[2] + (octant & 1 ? half : 0)},
          half};
}

enum class Verdict { outside, inside, band };

/// Everything that the tasks share and only read.
struct Scene {
  const Solid& solid;
  std::vector<PreparedSegment> segments;
  std::vector<Vec3> centres;  // bounding balls of the segments
  std::vector<double> ball_radii;
  double voxel_size;
  double band;

  const PreparedSegment& segment(int index) const {
    return segments[static_cast<std::size_t>(index)];
  }
  /// Convex in x, and with a known curvature bound: not cut by a plane.
  bool is_plain(const PreparedSegment& s) const {
    return solid.joints == Joints::round && s.start_cap < 0 && s.end_cap < 0;
  }
  Vec3 centre_of(const Block& block) const {
    const double middle = 0.5 * (block.size - 1);
    return voxel_size *
           Vec3(block.origin[0] + middle, block.origin[1] + middle, block.origin[2] + middle);
  }
};

Scene make_scene(const Solid& solid, double voxel_size, double band) {
  Scene scene{.solid = solid,
              .segments = {},
              .centres = {},
              .ball_radii = {},
              .voxel_size = voxel_size,
              .band = band};
  scene.segments.reserve(solid.segments.size());
  for (const Segment& segment : solid.segments) {
    const PreparedSegment& prepared = scene.segments.emplace_back(prepare(segment, solid.joints));
    scene.centres.push_back(prepared.a + 0.5 * prepared.length * prepared.axis);
    scene.ball_radii.push_back(0.5 * prepared.length + prepared.largest_radius());
  }
  return scene;
}

/// The solid cut by planes is smaller than its segments, but each cut distance is one of the
/// solid's own points', so bounds on the least distance hold with the cut distances too.
class Culler {
 public:
  explicit Culler(const Scene& scene) : scene_(scene) {}

  /// Keeps the candidates that can be nearest to a node of the block, in their order.
  Verdict cull(const Block& block, const std::vector<int>& candidates, std::vector<int>& kept) {
    const Vec3 centre = scene_.centre_of(block);
    const double reach =
        0.5 * std::numbers::sqrt3 * (block.size - 1) * scene_.voxel_size;  // centre to corner node
    const double limit = (scene_.band + reach) * (1 + 1e-9);
    kept.clear();
    near_.clear();
    double least = std::numeric_limits<double>::infinity();
    std::size_t nearest = 0;
    for (const int candidate : candidates) {
      const auto index = static_cast<std::size_t>(candidate);
      const double ball = limit + scene_.ball_radii[index];
      if ((centre - scene_.centres[index]).squaredNorm() > ball * ball) continue;
      const Sample sample =
          distance_to(scene_.segments[index], scene_.solid.caps, scene_.solid.joints, centre);
      if (sample.distance > limit) continue;
      if (sample.distance < least) {
        least = sample.distance;
        nearest = near_.size();
      }
      near_.push_back({candidate, sample});
    }
    if (near_.empty()) return Verdict::outside;
    if (least < -limit) return Verdict::inside;

    const Near& best = near_[nearest];
    const PreparedSegment& best_segment = scene_.segment(best.segment);
    // Distance from the centre to the nearest ball's centre: the best segment's distance at centre
    // + v is at most d + g.v + |v|^2 / (2 arm); any other plain one's is at least its d + g.v,
    // being convex.
    const double arm = best.sample.distance + smallest_radius(best_segment);
    const bool bend_known = scene_.is_plain(best_segment) && arm > 0;
    for (const Near& other : near_) {
      const double excess = other.sample.distance - least;
      if (excess > 2 * reach) continue;
      if (bend_known && scene_.is_plain(scene_.segment(other.segment)) &&
          excess >
              reach * ((other.sample.gradient - best.sample.gradient).norm() + reach / (2 * arm))) {
        continue;
      }
      kept.push_back(other.segment);
    }
    return Verdict::band;
  }

 private:
  struct Near {
    int segment;
    Sample sample;
  };

  static double smallest_radius(const PreparedSegment& s) {
    return s.sine >= 0 ? s.radius_at(s.length) : s.radius;
  }

  const Scene& scene_;
  std::vector<Near> near_;
};

/// Offsets (in mm) of a tile's nodes from the first one, and their least distances so far.
struct TileNodes {
  std::array<double, kTileNodes> x, y, z;
};

using TileValues = std::array<double, kTileNodes>;

TileNodes tile_nodes(double voxel_size) {
  TileNodes nodes;
  for (int n = 0; n < kTileNodes; ++n) {
    const auto i = static_cast<std::size_t>(n);
    nodes.x[i] = voxel_size * (n / (kTileSide * kTileSide));
    nodes.y[i] = voxel_size * (n / kTileSide % kTileSide);
    nodes.z[i] = voxel_size * (n % kTileSide);
  }
  return nodes;
}

/// Least squared distances to the segment's axis.
void lower_squared(const PreparedSegment& segment, const Vec3& first, const TileNodes& nodes,
                   TileValues& squared) {
  const Vec3 from_a = first - segment.a;
  const double ux = segment.axis.x(), uy = segment.axis.y(), uz = segment.axis.z();
  const double qx = from_a.x(), qy = from_a.y(), qz = from_a.z();
  const double length = segment.length;
  for (std::size_t i = 0; i < kTileNodes; ++i) {
    const double px = qx + nodes.x[i], py = qy + nodes.y[i], pz = qz + nodes.z[i];
    double s = px * ux + py * uy + pz * uz;
    s = s < 0 ? 0 : s;
    s = s > length ? length : s;
    const double ox = px - s * ux, oy = py - s * uy, oz = pz - s * uz;
    const double d = ox * ox + oy * oy + oz * oz;
    squared[i] = d < squared[i] ? d : squared[i];
  }
}

/// Least distances to a cone.
void lower_to_cone(const PreparedSegment& segment, const Vec3& first, const TileNodes& nodes,
                   TileValues& distances) {
  const Vec3 from_a = first - segment.a;
  const double ux = segment.axis.x(), uy = segment.axis.y(), uz = segment.axis.z();
  const double qx = from_a.x(), qy = from_a.y(), qz = from_a.z();
  const double length = segment.length, sine = segment.sine, tangent = segment.tangent,
               radius = segment.radius;
  for (std::size_t i = 0; i < kTileNodes; ++i) {
    const double px = qx + nodes.x[i], py = qy + nodes.y[i], pz = qz + nodes.z[i];
    const double t = px * ux + py * uy + pz * uz;
    const double ox = px - t * ux, oy = py - t * uy, oz = pz - t * uz;
    const double squared_rho = ox * ox + oy * oy + oz * oz;
    double s = t - std::sqrt(squared_rho) * tangent;
    s = s < 0 ? 0 : s;
    s = s > length ? length : s;
    const double e = t - s;
    const double d = std::sqrt(squared_rho + e * e) - radius + s * sine;
    distances[i] = d < distances[i] ? d : distances[i];
  }
}

class BlockRasteriser {
 public:
  explicit BlockRasteriser(const Scene& scene)
      : scene_(scene), culler_(scene), nodes_(tile_nodes(scene.voxel_size)) {}

  RasterPiece operator()(const Block& block, const std::vector<int>& candidates) {
    visit(block, candidates, 0);
    return std::move(piece_);
  }

 private:
  void visit(const Block& block, const std::vector<int>& candidates, std::size_t depth) {
    std::vector<int>& kept = lists_[depth];
    const Verdict verdict = culler_.cull(block, candidates, kept);
    if (verdict == Verdict::inside) piece_.inside.push_back({block.origin, block.size});
    if (verdict != Verdict::band) return;
    if (block.size == kLeafSide) {
      add_leaf(block, kept);
    } else {
      for (int octant = 0; octant < 8; ++octant) visit(child(block, octant), kept, depth + 1);
    }
  }

  void add_leaf(const Block& block, const std::vector<int>& candidates) {
    auto leaf = std::make_unique<RasterLeaf>();
    leaf->origin = block.origin;
    bool any_active = false;
    for (int octant = 0; octant < 8; ++octant) {
      const Block tile = child(block, octant);
      const Verdict verdict = culler_.cull(tile, candidates, tile_list_);
      if (verdict == Verdict::band) {
        evaluate(tile);
      } else {
        const double beyond = std::numeric_limits<double>::infinity();
        values_.fill(verdict == Verdict::inside ? -beyond : beyond);
      }
      any_active |= store(tile, *leaf);
    }
    if (any_active) {
      piece_.leaves.push_back(std::move(leaf));
    } else if (leaf->values[0] <
               0) {  // neighbouring nodes differ by less than the band, so all have one sign
      piece_.inside.push_back({block.origin, block.size});
    }
  }

  /// The least distance over the tile's list. Runs of plain capsules of one radius share their
  /// square roots.
  void evaluate(const Block& tile) {
    const Vec3 first = scene_.voxel_size * Vec3(tile.origin[0], tile.origin[1], tile.origin[2]);
    values_.fill(std::numeric_limits<double>::infinity());
    for (std::size_t i = 0; i < tile_list_.size();) {
      const PreparedSegment& segment = scene_.segment(tile_list_[i]);
      if (!scene_.is_plain(segment)) {
        for (std::size_t n = 0; n < kTileNodes; ++n) {
          const Vec3 x = first + Vec3(nodes_.x[n], nodes_.y[n], nodes_.z[n]);
          values_[n] = std::min(
              values_[n], distance_to(segment, scene_.solid.caps, scene_.solid.joints, x).distance);
        }
        ++i;
      } else if (segment.sine != 0) {
        lower_to_cone(segment, first, nodes_, values_);
        ++i;
      } else {
        TileValues squared;
        squared.fill(std::numeric_limits<double>::infinity());
        const double radius = segment.radius;
        for (; i < tile_list_.size(); ++i) {
          const PreparedSegment& next = scene_.segment(tile_list_[i]);
          if (!scene_.is_plain(next) || next.sine != 0 || next.radius != radius) break;
          lower_squared(next, first, nodes_, squared);
        }
        for (std::size_t n = 0; n < kTileNodes; ++n) {
          const double d = std::sqrt(squared[n]) - radius;
          values_[n] = d < values_[n] ? d : values_[n];
        }
      }
    }
  }

  bool store(const Block& tile, RasterLeaf& leaf) const {
    bool any_active = false;
    const auto background = static_cast<float>(scene_.band);
    const auto local = [&](int axis) {
      const auto a = static_cast<std::size_t>(axis);
      return static_cast<std::size_t>(tile.origin[a] - leaf.origin[a]);
    };
    std::size_t n = 0;
    for (std::size_t i = local(0); i < local(0) + kTileSide; ++i) {
      for (std::size_t j = local(1); j < local(1) + kTileSide; ++j) {
        for (std::size_t k = local(2); k < local(2) + kTileSide; ++k, ++n) {
          const double d = values_[n];
          const bool is_active = std::abs(d) < scene_.band;
          leaf.values[64 * i + 8 * j + k] = is_active ? static_cast<float>(d)
                                            : d < 0   ? -background
                                                      : background;
          leaf.active[i] |= std::uint64_t{is_active} << (8 * j + k);
          any_active |= is_active;
        }
      }
    }
    return any_active;
  }

  const Scene& scene_;
  Culler culler_;
  TileNodes nodes_;
  TileValues values_{};
  std::vector<int> tile_list_;
  std::array<std::vector<int>, 4> lists_;  // 64, 32, 16, 8
  RasterPiece piece_;
};

struct Pending {
  Block block;
  std::vector<int> candidates;
};

/// Blocks that cover the band, few and large.
std::vector<Block> root_blocks(const Scene& scene) {
  Box box;
  for (std::size_t i = 0; i < scene.segments.size(); ++i) {
    const PreparedSegment& s = scene.segments[i];
    const double margin = s.largest_radius() + scene.band + scene.voxel_size;
    Box own;
    own.include(s.a);
    own.include(Vec3(s.a + s.length * s.axis));
    own.pad(margin);
    box.include(own);
  }
  for (int size = kTaskSide;; size *= 2) {
    Index3 lower, upper;
    long count = 1;
    for (int axis = 0; axis < 3; ++axis) {
      const auto a = static_cast<std::size_t>(axis);
      lower[a] = static_cast<int>(std::floor(box.lower[axis] / scene.voxel_size / size));
      upper[a] = static_cast<int>(std::floor(box.upper[axis] / scene.voxel_size / size));
      count *= upper[a] - lower[a] + 1;
    }
    if (count > 8) continue;
    std::vector<Block> blocks;
    for (int i = lower[0]; i <= upper[0]; ++i) {
      for (int j = lower[1]; j <= upper[1]; ++j) {
        for (int k = lower[2]; k <= upper[2]; ++k)
          blocks.push_back({{i * size, j * size, k * size}, size});
      }
    }
    return blocks;
  }
}

/// Leaves that meet a band from `inner` to `outer` (mm, as radii): those whose centre lies within
/// the mean leaf width of it, 1.5 sides for random directions.
double leaves_in_shell(double shell_volume, double voxel_size) {
  const double side = kLeafSide * voxel_size;
  return shell_volume / (side * side * side);
}

double bytes_of_leaves(double leaves) {
  // One raster leaf and one OpenVDB leaf with its bookkeeping, and a share of the internal nodes
  // above.
  return leaves * (sizeof(RasterLeaf) + 2250.0 + 400.0) + 4e6;
}

}  // namespace

std::vector<RasterPiece> rasterise(const Solid& solid, double voxel_size, double band) {
  const Scene scene = make_scene(solid, voxel_size, band);
  std::vector<int> all(scene.segments.size());
  for (std::size_t i = 0; i < all.size(); ++i) all[i] = static_cast<int>(i);

  std::vector<Pending> level;
  for (const Block& block : root_blocks(scene)) level.push_back({block, all});
  RasterPiece large_blocks;
  while (level.front().block.size > kTaskSide) {
    std::vector<Verdict> verdicts(level.size());
    tbb::parallel_for(std::size_t{0}, level.size(), [&](std::size_t i) {
      std::vector<int> kept;
      verdicts[i] = Culler(scene).cull(level[i].block, level[i].candidates, kept);
      level[i].candidates = std::move(kept);
    });
    std::vector<Pending> next;
    for (std::size_t i = 0; i < level.size(); ++i) {
      const Block& block = level[i].block;
      if (verdicts[i] == Verdict::inside) large_blocks.inside.push_back({block.origin, block.size});
      if (verdicts[i] != Verdict::band) continue;
      for (int octant = 0; octant < 8; ++octant)
        next.push_back({child(block, octant), level[i].candidates});
    }
    level = std::move(next);
    if (level.empty()) break;
  }

  std::vector<RasterPiece> pieces(level.size() + 1);
  pieces.back() = std::move(large_blocks);
  tbb::parallel_for(std::size_t{0}, level.size(), [&](std::size_t i) {
    pieces[i] = BlockRasteriser(scene)(level[i].block, level[i].candidates);
  });
  return pieces;
}

double estimated_bytes(const Solid& solid, double voxel_size, double half_width) {
  // Half a leaf's mean width (1.5 sides for random directions) on each side of the band.
  const double reach = (half_width + 0.75 * kLeafSide) * voxel_size;
  double volume = 0;
  for (std::size_t i = 0; i < solid.segments.size(); ++i) {
    const Segment& segment = solid.segments[i];
    const double length = (segment.b - segment.a).norm();
    const double radius = 0.5 * (segment.radius_a + segment.radius_b);
    const double outer = radius + reach;
    const double inner = std::max(0.0, radius - reach);
    volume += std::numbers::pi * (outer * outer - inner * inner) * length;
    const bool continues = i > 0 && solid.segments[i - 1].b == segment.a;
    if (!continues)
      volume += 4.0 / 3.0 * std::numbers::pi * (outer * outer * outer - inner * inner * inner);
  }
  return bytes_of_leaves(leaves_in_shell(volume, voxel_size));
}

double estimated_bytes(double area, double voxel_size, double outside_width, double inside_width) {
  const double thickness = (outside_width + inside_width + 1.5 * kLeafSide) * voxel_size;
  return bytes_of_leaves(leaves_in_shell(area * thickness, voxel_size));
}

}  // namespace vstent::sdf
