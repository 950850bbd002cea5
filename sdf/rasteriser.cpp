#include "sdf/rasteriser.hpp"

#include <tbb/blocked_range.h>
#include <tbb/enumerable_thread_specific.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <utility>

#include "sdf/block_rasteriser.hpp"

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

Rasteriser::Rasteriser(const Solid& solid, PreparedSolid pieces, double voxel_size, double band)
    : pieces_(std::move(pieces)), voxel_size_(voxel_size), band_(band) {
  prepare_shapes(solid);
  bin_to_blocks();
}

Rasteriser::Shape Rasteriser::shape_of(int piece) const {
  const CubeReach leaf(kLeafSide, voxel_size_);
  const auto slopes = [h = voxel_size_](const Vec3& direction) {
    const Eigen::Vector3f s = (h * direction).cast<float>();
    return Affine{.x = s.x(), .y = s.y(), .z = s.z()};
  };
  const auto [a, b] = pieces_.ends(piece);
  const Vec3& axis = pieces_.axis(piece);
  const Vec3 sideways = sideways_of(pieces_, piece, axis);
  const Vec3 along = axis.isZero() ? Vec3(sideways.unitOrthogonal()) : axis;
  const Vec3 aside = along.cross(sideways);
  const double margin = pieces_.outer_radius(piece) + band_ * (1 + 1e-9) + leaf.half;
  const auto first_row = [&](double p, double q) {  // rounded outwards
    return (std::min(p, q) - margin) / voxel_size_ + 7;
  };
  const auto end_row = [&](double p, double q) {
    return (std::max(p, q) + margin) / voxel_size_ + 1;
  };
  const bool is_plain =
      pieces_.is_convex(piece) && !pieces_.is_strut(piece) && pieces_.segment(piece).sine == 0;
  return {.a = a,
          .b = b,
          .axis = axis,
          .along = along,
          .sideways = sideways,
          .aside = aside,
          .length = (b - a).norm(),
          .outer_radius = pieces_.outer_radius(piece),
          .reach = leaf.half * axis.cwiseAbs().sum(),
          .first_row = {first_row(a.x(), b.x()), first_row(a.y(), b.y())},
          .end_row = {end_row(a.x(), b.x()), end_row(a.y(), b.y())},
          .thin = {.across = slopes(sideways),
                   .aside = slopes(aside),
                   .past_b = slopes(along),
                   .reached = {}},
          .is_plain = is_plain,
          .is_thin = is_plain && !(is_thick(pieces_.outer_radius(piece)) && !axis.isZero())};
}

void Rasteriser::prepare_shapes(const Solid& solid) {
  const auto& segments = solid.segments;
  shapes_.resize(static_cast<std::size_t>(pieces_.size()));
  const tbb::blocked_range<std::size_t> all(0, shapes_.size(), 256);
  tbb::parallel_for(all, [&](const auto& range) {
    for (std::size_t i = range.begin(); i != range.end(); ++i) {
      shapes_[i] = shape_of(static_cast<int>(i));
      if (solid.joints == Joints::flat || i >= segments.size()) continue;
      shapes_[i].continues =
          i + 1 < segments.size() && carries_on(segments[i], segments[i + 1], true);
      shapes_[i].continued = i > 0 && carries_on(segments[i], segments[i - 1], false);
    }
  });
}

void Rasteriser::bin_to_blocks() {
  const double side = kBlockSide * voxel_size_;
  const CubeReach reach(kBlockSide, voxel_size_);
  constexpr int kAny = std::numeric_limits<int>::max();
  struct Visit {
    Index3 block;
    int piece;
  };
  const auto visit_blocks = [&](int piece, std::vector<Visit>& visits) {
    const Shape& shape = shapes_[static_cast<std::size_t>(piece)];
    visit_cells(shape.a, shape.b, shape.outer_radius + band_, side, {-kAny, -kAny, -kAny},
                {kAny, kAny, kAny}, [&](const Index3& block) {
                  const Vec3 middle =
                      side * Vec3(block[0], block[1], block[2]) + Vec3::Constant(reach.half);
                  const Sample sample = pieces_.uncut_distance(piece, middle);
                  if (reach.least(sample) <= band_ * (1 + 1e-9)) visits.push_back({block, piece});
                });
  };
  constexpr int kAtOnce = 256;
  std::vector<std::vector<Visit>> parts(
      static_cast<std::size_t>((pieces_.size() + kAtOnce - 1) / kAtOnce));
  tbb::parallel_for(std::size_t{0}, parts.size(), [&](std::size_t part) {
    const int begin = kAtOnce * static_cast<int>(part);
    for (int piece = begin; piece < std::min(begin + kAtOnce, pieces_.size()); ++piece)
      visit_blocks(piece, parts[part]);
  });

  std::vector<std::pair<int, int>> visits;  // number of the block, piece
  for (const auto& part : parts) {
    for (const Visit& visit : part)
      visits.emplace_back(blocks_.find_or_add(visit.block), visit.piece);
  }
  first_candidate_.assign(blocks_.size() + 1, 0);
  for (const auto& [block, piece] : visits) ++first_candidate_[static_cast<std::size_t>(block) + 1];
  std::partial_sum(first_candidate_.begin(), first_candidate_.end(), first_candidate_.begin());
  std::vector<int> end(first_candidate_.begin(), first_candidate_.end() - 1);
  candidates_.resize(visits.size());
  for (const auto& [block, piece] : visits)
    candidates_[static_cast<std::size_t>(end[static_cast<std::size_t>(block)]++)] = piece;
}

std::size_t Rasteriser::run(LeafDirectory& leaves, LeafStore& store) const {
  tbb::enumerable_thread_specific<BlockRasteriser> of_thread(
      [&] { return BlockRasteriser(*this, leaves, store); });
  tbb::parallel_for(tbb::blocked_range<std::size_t>(0, leaves.size()), [&](const auto& range) {
    BlockRasteriser& rasterise = of_thread.local();
    for (std::size_t block = range.begin(); block != range.end(); ++block) rasterise(block);
  });
  leaves.complete();
  std::size_t active = 0;
  for (const BlockRasteriser& rasteriser : of_thread) active += rasteriser.active_voxels();
  return active;
}

}  // namespace vstent::sdf
