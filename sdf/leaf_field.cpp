#include "sdf/leaf_field.hpp"

#include <xmmintrin.h>

#include <algorithm>
#include <cmath>

namespace vstent::sdf {

static_assert(sizeof(Sample) == 4 * sizeof(double));  // as the kernel writes it

namespace {

/// Finds the rows and fetches them: a row of nodes is half a cache line.
template <bool kEnds>
void find_rows(LeafPlace& place) {
  const auto [first_i, first_j, first_k] = place.first;
  const float* const* leaves[4];
  int at[4];
  for (int j = 0; j < 4; ++j) {
    leaves[j] = place.leaves + LeafPlace::kStep[1] * ((first_j + j) >> 3);
    at[j] = ((first_j + j) & 7) << 3;
  }
  const int last_k = kEnds ? 4 : first_k;
#pragma GCC unroll 12
  for (int n = 0; n < LeafPlace::kRows; ++n) {
    const auto [row_i, j] = LeafPlace::kRowOf[n];
    const int i = first_i + row_i;
    const float* const* leaf = leaves[j] + LeafPlace::kStep[0] * (i >> 3);
    const int row = (i & 7) << 6 | at[j];
    place.rows[n] = leaf[0] + row + last_k;
    _mm_prefetch(place.rows[n], _MM_HINT_T0);
    if constexpr (kEnds) _mm_prefetch(leaf[1] + row, _MM_HINT_T0);
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

LeafCursor::LeafCursor(const LeafField& field)
    : field_(field),
      per_node_(1 / field.voxel_size),
      range_{.inside = field.inside,
             .outside = field.outside,
             .innermost = static_cast<double>(field.inside) + field.voxel_size,
             .outermost = static_cast<double>(field.outside) - field.voxel_size} {}

void LeafCursor::locate(const Vec3& x, LeafPlace& place, Loose& loose) {
  constexpr double kLargestIndex = 1 << 30;
  IndexTable::Index first;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const auto a = static_cast<Eigen::Index>(axis);
    const double index = (x[a] - field_.origin[a]) * per_node_;
    if (!(std::abs(index) < kLargestIndex)) {
      loose.fill(field_.leaves.outside());
      place = {loose.data(), {}, {}, {}};
      return;
    }
    const int truncated = static_cast<int>(index);
    const int node = truncated - (static_cast<double>(truncated) > index);
    first[axis] = node - 1;
    place.first[axis] = first[axis] & 7;
    place.fraction[axis] = static_cast<float>(index - node);
  }
  const auto [i, j, k] = first;
  const IndexTable::Index block{i >> 5, j >> 5, k >> 5};
  if (!page_ || ((block[0] ^ block_[0]) | (block[1] ^ block_[1]) | (block[2] ^ block_[2])) != 0) {
    block_ = block;
    page_ = field_.leaves.find_page(block);
  }
  if (page_) {
    place.leaves = page_->leaves.data() + LeafPage::place(i >> 3 & 3, j >> 3 & 3, k >> 3 & 3);
    return;
  }
  for (int n = 0; n < 8; ++n) {
    const int di = n >> 2, dj = n >> 1 & 1, dk = n & 1;
    loose[LeafPage::place(di, dj, dk)] =
        field_.leaves.find((i >> 3) + di, (j >> 3) + dj, (k >> 3) + dk);
  }
  place.leaves = loose.data();
}

Sample LeafCursor::sample(const Vec3& x) {
  Sample result;
  sample({&x, 1}, {&result, 1});
  return result;
}

void LeafCursor::sample(std::span<const Vec3> points, std::span<Sample> samples) {
  std::array<LeafPlace, kPlaces> places;
  std::array<Loose, kPlaces> loose;
  for (std::size_t begin = 0; begin < points.size(); begin += kPlaces) {
    const std::size_t count = std::min(kPlaces, points.size() - begin);
    for (std::size_t n = 0; n < count; ++n) {
      locate(points[begin + n], places[n], loose[n]);
      places[n].first[2] > 4 ? find_rows<true>(places[n]) : find_rows<false>(places[n]);
    }
    kernels_.sample(std::span(places).first(count), range_,
                    reinterpret_cast<double(*)[4]>(samples.data() + begin));
  }
}

Sample LeafCursor::sample_closely(const Vec3& x) {
  Sample result = sample(x);
  if (result.gradient.isZero()) return result;
  Loose loose;
  LeafPlace place;
  locate(x, place, loose);
  result.distance -= bend(place);
  return result;
}

}  // namespace vstent::sdf
