#include "sdf/leaf_field.hpp"

#include <xmmintrin.h>

#include <algorithm>
#include <cmath>

namespace vstent::sdf {
namespace {

struct Cell {
  int node;         // the last one not beyond the point
  double fraction;  // from there, in [0, 1)
};

Cell cell_of(double index) {
  const int truncated = static_cast<int>(index);
  const int node = truncated - (static_cast<double>(truncated) > index);
  return {node, index - node};
}

/// A row of nodes is half a cache line, and four of them lie in three lines at most.
void prefetch(const LeafPlace& place) {
  const auto [first_i, first_j, first_k] = place.first;
  for (int i = first_i; i < first_i + 4; ++i) {
    for (const int j : {first_j, first_j + 2, first_j + 3}) {
      const float* const* leaf =
          place.leaves + LeafPlace::kStep[0] * (i >> 3) + LeafPlace::kStep[1] * (j >> 3);
      const int row = (i & 7) << 6 | (j & 7) << 3;
      _mm_prefetch(leaf[0] + row, _MM_HINT_T0);
      if (first_k > 4) _mm_prefetch(leaf[1] + row, _MM_HINT_T0);
    }
  }
}

float node(const LeafPlace& place, int i, int j, int k) {
  i += place.first[0], j += place.first[1], k += place.first[2];
  const float* leaf =
      place.leaves[LeafPlace::kStep[0] * (i >> 3) + LeafPlace::kStep[1] * (j >> 3) + (k >> 3)];
  return leaf[(i & 7) << 6 | (j & 7) << 3 | (k & 7)];
}

/// How much linear interpolation overestimates: f (1 - f) / 2 second differences, per axis.
double bend(const LeafPlace& place) {
  double total = 0;
  for (int corner = 0; corner < 8; ++corner) {
    const std::array<int, 3> step{corner >> 2, corner >> 1 & 1, corner & 1};
    double weight = 1, bends = 0;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const auto f = static_cast<double>(place.fraction[axis]);
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

/// No leaves where x is beyond what can be indexed.
LeafPlace LeafCursor::place_of(const Vec3& x, Loose& loose) {
  const Vec3 index = (x - field_.origin) * per_node_;
  constexpr double kLargestIndex = 1 << 30;
  if (!((index.array().abs() < kLargestIndex).all())) return {};
  const Cell cells[3]{cell_of(index.x()), cell_of(index.y()), cell_of(index.z())};
  LeafPlace place;
  IndexTable::Index block, leaf;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const int first = cells[axis].node - 1;
    place.first[axis] = first & 7;
    place.fraction[axis] = static_cast<float>(cells[axis].fraction);
    leaf[axis] = first >> 3;
    block[axis] = first >> 5;
  }
  const bool is_same = block[0] == block_[0] && block[1] == block_[1] && block[2] == block_[2];
  if (!is_same || !page_) {
    block_ = block;
    page_ = field_.leaves.find_page(block);
  }
  if (page_) {
    place.leaves = page_->leaves.data() + LeafPage::place(leaf[0] & 3, leaf[1] & 3, leaf[2] & 3);
    return place;
  }
  for (int n = 0; n < 8; ++n) {
    const int i = n >> 2, j = n >> 1 & 1, k = n & 1;
    loose[LeafPage::place(i, j, k)] = field_.leaves.find(leaf[0] + i, leaf[1] + j, leaf[2] + k);
  }
  place.leaves = loose.data();
  return place;
}

Sample LeafCursor::finish(const LeafSample& sample) const {
  const auto value = static_cast<double>(sample.value);
  const auto outside = static_cast<double>(field_.outside);
  const auto inside = static_cast<double>(field_.inside);
  if (value >= outside - field_.voxel_size) return {outside, Vec3::Zero()};
  if (value <= inside + field_.voxel_size) return {inside, Vec3::Zero()};
  const Vec3 slope = Eigen::Map<const Eigen::Vector3f>(sample.slope).cast<double>();
  const double norm = slope.norm();
  return {value, norm > 0 ? Vec3(slope * (1 / norm)) : Vec3(Vec3::Zero())};
}

Sample LeafCursor::sample(const Vec3& x) {
  Sample result;
  sample({&x, 1}, {&result, 1});
  return result;
}

void LeafCursor::sample(std::span<const Vec3> points, std::span<Sample> samples) {
  std::array<LeafPlace, kPlaces> places;
  std::array<LeafSample, kPlaces> found;
  std::array<Loose, kPlaces> loose;
  for (std::size_t begin = 0; begin < points.size(); begin += kPlaces) {
    const std::size_t count = std::min(kPlaces, points.size() - begin);
    for (std::size_t n = 0; n < count; ++n) {
      places[n] = place_of(points[begin + n], loose[n]);
      if (!places[n].leaves) {  // a place outside
        places[n].leaves = loose[n].data();
        loose[n].fill(field_.leaves.outside());
      }
      prefetch(places[n]);
    }
    kernels_.sample(std::span(places).first(count), field_.inside, field_.outside, found.data());
    for (std::size_t n = 0; n < count; ++n) samples[begin + n] = finish(found[n]);
  }
}

Sample LeafCursor::sample_closely(const Vec3& x) {
  Sample result = sample(x);
  if (result.gradient.isZero()) return result;
  Loose loose;
  result.distance -= bend(place_of(x, loose));
  return result;
}

}  // namespace vstent::sdf
