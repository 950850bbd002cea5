#include "sdf/rasteriser.hpp"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "sdf/block_rasteriser.hpp"
#include "sdf/index_table.hpp"

namespace vstent::sdf {
namespace {

Vec3 sideways_of(const PreparedSolid& pieces, int piece, const Vec3& axis) {
  if (pieces.is_strut(piece)) {
    const Vec3& normal = pieces.strut(piece).normal;
    return axis.isZero() ? normal.unitOrthogonal() : Vec3(axis.cross(normal));
  }
  return axis.isZero() ? Vec3(Vec3::UnitX()) : axis.unitOrthogonal();
}

/// Are these capsules of one radius, where `to` meets `from` in a point and is cut by no cap that
/// does not cut `from`?
bool carries_on(const Segment& from, const Segment& to, bool at_b) {
  const auto carries = [&](int cap) {
    return cap < 0 || cap == from.start_cap || cap == from.end_cap;
  };
  return from.radius_a == from.radius_b && to.radius_a == from.radius_a &&
         to.radius_b == from.radius_a && (at_b ? to.a == from.b : to.b == from.a) &&
         carries(to.start_cap) && carries(to.end_cap);
}

}  // namespace

Rasteriser::Rasteriser(const Solid& solid, double voxel_size, double band)
    : pieces_(solid), voxel_size_(voxel_size), band_(band) {
  const double side = kBlockSide * voxel_size;
  const CubeReach reach(kBlockSide, voxel_size);
  constexpr int kAny = std::numeric_limits<int>::max();
  IndexTable table;
  std::vector<std::pair<int, int>> visits;  // block, piece
  shapes_.reserve(static_cast<std::size_t>(pieces_.size()));
  for (int piece = 0; piece < pieces_.size(); ++piece) {
    const auto [a, b] = pieces_.ends(piece);
    const Vec3 axis = pieces_.axis(piece);
    const bool is_plain =
        pieces_.is_convex(piece) && !pieces_.is_strut(piece) && pieces_.segment(piece).sine == 0;
    shapes_.push_back({.a = a,
                       .b = b,
                       .axis = axis,
                       .sideways = sideways_of(pieces_, piece, axis),
                       .length = (b - a).norm(),
                       .outer_radius = pieces_.outer_radius(piece),
                       .is_plain = is_plain});
    visit_cells(a, b, pieces_.outer_radius(piece) + band, side, {-kAny, -kAny, -kAny},
                {kAny, kAny, kAny}, [&](const Index3& cell) {
                  const Vec3 middle =
                      side * Vec3(cell[0], cell[1], cell[2]) + Vec3::Constant(reach.half);
                  const Sample sample = pieces_.uncut_distance(piece, middle);
                  if (reach.least(sample) > band * (1 + 1e-9)) return;
                  const int block = table.find_or_add(cell);
                  visits.emplace_back(block, piece);
                });
  }
  const auto& segments = solid.segments;
  for (std::size_t i = 1; solid.joints == Joints::round && i < segments.size(); ++i) {
    shapes_[i - 1].continues = carries_on(segments[i - 1], segments[i], true);
    shapes_[i].continued = carries_on(segments[i], segments[i - 1], false);
  }
  blocks_.resize(table.size());
  first_node_.fill(kAny);
  for (std::size_t i = 0; i < blocks_.size(); ++i) {
    for (std::size_t axis = 0; axis < 3; ++axis) {
      blocks_[i].origin[axis] = kBlockSide * table.index(i)[axis];
      first_node_[axis] = std::min(first_node_[axis], blocks_[i].origin[axis]);
    }
  }
  for (const auto& [block, piece] : visits) ++blocks_[static_cast<std::size_t>(block)].end;
  int begin = 0;
  for (Block& block : blocks_) {
    const int count = block.end;
    block.begin = block.end = begin;
    begin += count;
  }
  candidates_.resize(visits.size());
  for (const auto& [block, piece] : visits)
    candidates_[static_cast<std::size_t>(blocks_[static_cast<std::size_t>(block)].end++)] = piece;
}

void Rasteriser::run(const std::function<LeafSink(std::size_t)>& sink_of) const {
  tbb::parallel_for(tbb::blocked_range<std::size_t>(0, blocks_.size()), [&](const auto& range) {
    BlockRasteriser rasterise(*this);
    for (std::size_t i = range.begin(); i != range.end(); ++i) rasterise(blocks_[i], sink_of(i));
  });
}

}  // namespace vstent::sdf
