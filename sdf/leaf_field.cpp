#include "sdf/leaf_field.hpp"

#include <algorithm>
#include <cmath>

namespace vstent::sdf {

static_assert(sizeof(Sample) == 4 * sizeof(double));  // as the kernel writes it
static_assert(sizeof(Vec3) == 3 * sizeof(double));    // and reads it

namespace {

float node(const LeafPlaces& place, int i, int j, int k) {
  i += place.node[0][0], j += place.node[1][0], k += place.node[2][0];
  const float* leaf =
      place.leaves[0][LeafPlaces::kStep[0] * (i >> 3) + LeafPlaces::kStep[1] * (j >> 3) + (k >> 3)];
  return leaf[(i & 7) << 6 | (j & 7) << 3 | (k & 7)];
}

/// How much linear interpolation overestimates: f (1 - f) / 2 second differences, per axis.
double bend(const LeafPlaces& place) {
  double total = 0;
  for (int corner = 0; corner < 8; ++corner) {
    const std::array<int, 3> step{corner >> 2, corner >> 1 & 1, corner & 1};
    double weight = 1, bends = 0;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const auto f = static_cast<double>(place.fraction[axis][0]);
      weight *= step[axis] ? f : 1 - f;
      const auto along = [&](int by) {
        std::array<int, 3> at{1 + step[0], 1 + step[1], 1 + step[2]};
        at[axis] += by;
        return static_cast<double>(node(place, at[0], at[1], at[2]));
      };
      bends += f * (1 - f) / 2 * (along(-1) - 2 * along(0) + along(1));
    }
    total += weight * bends;
  }
  return total;
}

}  // namespace

LeafCursor::LeafCursor(const LeafField& field)
    : field_(field),
      lattice_{{field.origin.x(), field.origin.y(), field.origin.z()}, 1 / field.voxel_size},
      range_{
          .inside = field.inside,
          .outside = field.outside,
          .innermost = static_cast<float>(static_cast<double>(field.inside) + field.voxel_size),
          .outermost = static_cast<float>(static_cast<double>(field.outside) - field.voxel_size)} {}

void LeafCursor::locate(std::span<const Vec3> points, LeafPlaces& places, std::span<Loose> loose) {
  kernels_.locate({points.front().data(), 3 * points.size()}, lattice_, places);
  for (std::size_t n = 0; n < points.size(); ++n) {
    const IndexTable::Index block{places.block[0][n], places.block[1][n], places.block[2][n]};
    if (!page_ || ((block[0] ^ block_[0]) | (block[1] ^ block_[1]) | (block[2] ^ block_[2])) != 0) {
      block_ = block;
      page_ = field_.leaves.find_page(block_);
      if (!page_) {
        loose[n] = find_loose(places.leaf[n]);
        places.leaves[n] = loose[n].data();
        continue;
      }
    }
    places.leaves[n] = page_->leaves.data() + places.leaf[n];
  }
}

LeafCursor::Loose LeafCursor::find_loose(int leaf) const {
  Loose loose{};
  const auto [i, j, k] = LeafPage::indices(leaf);
  for (int next = 0; next < 8; ++next) {
    const int di = next >> 2, dj = next >> 1 & 1, dk = next & 1;
    loose[LeafPage::place(di, dj, dk)] = field_.leaves.find(LeafPage::kSide * block_[0] + i + di,
                                                            LeafPage::kSide * block_[1] + j + dj,
                                                            LeafPage::kSide * block_[2] + k + dk);
  }
  return loose;
}

Sample LeafCursor::sample(const Vec3& x) {
  Sample result;
  sample({&x, 1}, {&result, 1});
  return result;
}

void LeafCursor::sample(std::span<const Vec3> points, std::span<Sample> samples) {
  LeafPlaces places;
  std::array<Loose, kPlaces> loose;
  for (std::size_t begin = 0; begin < points.size(); begin += kPlaces) {
    const std::size_t count = std::min(kPlaces, points.size() - begin);
    locate(points.subspan(begin, count), places, loose);
    kernels_.sample(places, range_,
                    {reinterpret_cast<std::array<double, 4>*>(samples.data() + begin), count});
  }
}

Sample LeafCursor::sample_closely(const Vec3& x) {
  Sample result = sample(x);
  if (result.gradient.isZero()) return result;
  Loose loose;
  LeafPlaces place;
  locate({&x, 1}, place, {&loose, 1});
  result.distance -= bend(place);
  return result;
}

}  // namespace vstent::sdf
