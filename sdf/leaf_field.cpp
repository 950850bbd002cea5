#include "sdf/leaf_field.hpp"

#include <xmmintrin.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>

namespace vstent::sdf {
namespace {

/// Four nodes that differ in k.
typedef float Row __attribute__((vector_size(16)));
typedef int RowPick __attribute__((vector_size(16)));

Row row(float a) { return Row{a, a, a, a}; }

Row load(const float* nodes) {
  Row loaded;
  std::memcpy(&loaded, nodes, sizeof loaded);
  return loaded;
}

Row mix(Row f, Row a, Row b) { return a + f * (b - a); }

/// A row whose first kBefore nodes end one leaf's and whose others begin the next one's.
template <int kBefore>
Row load(const float* low, const float* high) {
  return __builtin_shuffle(load(low + 4), load(high),
                           RowPick{4 - kBefore, 5 - kBefore, 6 - kBefore, 7 - kBefore});
}

Row smaller(Row a, Row b) { return (Row)_mm_min_ps((__m128)a, (__m128)b); }
Row larger(Row a, Row b) { return (Row)_mm_max_ps((__m128)a, (__m128)b); }
int above(Row a, Row b) { return _mm_movemask_ps(_mm_cmpgt_ps((__m128)a, (__m128)b)); }

struct Cell {
  int node;         // the last one not beyond the point
  double fraction;  // from there, in [0, 1)
};

Cell cell_of(double index) {
  const int truncated = static_cast<int>(index);
  const int node = truncated - (static_cast<double>(truncated) > index);
  return {node, index - node};
}

}  // namespace

LeafDirectory::LeafDirectory(float outside, float inside)
    : outside_(std::make_unique<Constant>()), inside_(std::make_unique<Constant>()) {
  outside_->fill(outside);
  inside_->fill(inside);
}

const float*& LeafDirectory::slot(int i, int j, int k) {
  const auto page = static_cast<std::size_t>(table_.find_or_add({i >> 4, j >> 4, k >> 4}));
  if (page == pages_.size()) {
    pages_.push_back(owned_pages_.emplace_back(std::make_unique_for_overwrite<Page>()).get());
    pages_.back()->fill(outside_->data());
  }
  return (*pages_[page])[place(i, j, k)];
}

void LeafDirectory::put_inside_page(int i, int j, int k) {
  if (!inside_page_) {
    inside_page_ = owned_pages_.emplace_back(std::make_unique_for_overwrite<Page>()).get();
    inside_page_->fill(inside_->data());
  }
  table_.find_or_add({i, j, k});
  pages_.push_back(inside_page_);
}

std::size_t LeafDirectory::bytes() const {
  return owned_pages_.size() * sizeof(Page) + pages_.size() * sizeof(Page*) + 2 * sizeof(Constant) +
         table_.bytes();
}

/// The nodes around a point: 4^3 of them, of which value and nodal gradient need all but those on
/// the cube's edges.
struct LeafCursor::Stencil {
  Row rows[4][4];

  template <int kBefore>
  void gather(const Place& place) {
    const auto [first_i, first_j, first_k] = place.first;
    std::array<std::ptrdiff_t, 4> leaf_of{},
        row_of{};  // points differ in these too irregularly to branch
    for (int j = 0; j < 4; ++j) {
      leaf_of[static_cast<std::size_t>(j)] = (first_j + j) >> 3 << 1;
      row_of[static_cast<std::size_t>(j)] = ((first_j + j) & 7) << 3;
    }
    for (int i = 0; i < 4; ++i) {
      const float* const* leaves = place.leaves.data() + ((first_i + i) >> 3 << 2);
      const std::ptrdiff_t plane = ((first_i + i) & 7) << 6;
      for (std::size_t j = 0; j < 4; ++j) {
        if ((i == 0 || i == 3) && (j == 0 || j == 3)) continue;
        const std::ptrdiff_t at = plane + row_of[j];
        const float* const* row = leaves + leaf_of[j];
        if constexpr (kBefore == 4) {
          rows[i][j] = load(row[0] + at + first_k);
        } else {
          rows[i][j] = load<kBefore>(row[0] + at, row[1] + at);
        }
      }
    }
  }

  bool is_within(float inside, float outside) const {
    Row inner_low = rows[1][1], inner_high = rows[1][1];
    const auto include = [](Row& low, Row& high, Row values) {
      low = smaller(low, values), high = larger(high, values);
    };
    for (const Row values : {rows[1][2], rows[2][1], rows[2][2]})
      include(inner_low, inner_high, values);
    Row outer_low = rows[0][1], outer_high = rows[0][1];  // whose first and last node do not count
    for (const Row values :
         {rows[0][2], rows[3][1], rows[3][2], rows[1][0], rows[2][0], rows[1][3], rows[2][3]}) {
      include(outer_low, outer_high, values);
    }
    const int inner = above(inner_low, row(inside)) & above(row(outside), inner_high);
    const int outer = above(outer_low, row(inside)) & above(row(outside), outer_high);
    return inner == 0xF && (outer & 6) == 6;
  }

  /// How much linear interpolation overestimates: f (1 - f) / 2 second differences, per axis.
  double bend(const std::array<double, 3>& fraction) const {
    const Row x = row(static_cast<float>(fraction[0])), y = row(static_cast<float>(fraction[1]));
    const auto along_x = [&](int j) { return rows[0][j] - rows[1][j] - rows[2][j] + rows[3][j]; };
    const auto along_y = [&](int i) { return rows[i][0] - rows[i][1] - rows[i][2] + rows[i][3]; };
    const Row plane = mix(x, mix(y, rows[1][1], rows[1][2]), mix(y, rows[2][1], rows[2][2]));
    const Row bend_x = mix(y, along_x(1), along_x(2)), bend_y = mix(x, along_y(1), along_y(2));
    const auto weight = [&](std::size_t axis) { return fraction[axis] * (1 - fraction[axis]) / 4; };
    const auto at = [&](Row values) {
      const auto z = static_cast<float>(fraction[2]);
      return static_cast<double>(values[1] + z * (values[2] - values[1]));
    };
    return weight(0) * at(bend_x) + weight(1) * at(bend_y) +
           weight(2) * static_cast<double>(plane[0] - plane[1] - plane[2] + plane[3]);
  }

  Sample interpolate(const std::array<double, 3>& fraction) const {
    const Row x = row(static_cast<float>(fraction[0])), y = row(static_cast<float>(fraction[1]));
    const auto z = static_cast<float>(fraction[2]);
    Row planes[4];
    for (int i = 0; i < 4; ++i) planes[i] = mix(y, rows[i][1], rows[i][2]);
    const auto across_y = [&](int i) {
      return mix(y, rows[i][2] - rows[i][0], rows[i][3] - rows[i][1]);
    };
    const Row values = mix(x, planes[1], planes[2]);
    const Row dx = mix(x, planes[2] - planes[0], planes[3] - planes[1]);
    const Row dy = mix(x, across_y(1), across_y(2));
    const auto between = [z](float a, float b) { return static_cast<double>(a + z * (b - a)); };
    const Vec3 slope(between(dx[1], dx[2]), between(dy[1], dy[2]),
                     between(values[2] - values[0], values[3] - values[1]));
    const double norm = slope.norm();
    return {between(values[1], values[2]), norm > 0 ? Vec3(slope / norm) : Vec3(Vec3::Zero())};
  }
};

const float* LeafCursor::find(int i, int j, int k) {
  const LeafDirectory& leaves = field_.leaves;
  const IndexTable::Index index{i >> 4, j >> 4, k >> 4};
  if (!page_ || index != page_index_) {
    const int page = leaves.table_.find(index);
    if (page < 0) return leaves.outside_->data();
    page_ = leaves.pages_[static_cast<std::size_t>(page)];
    page_index_ = index;
  }
  return (*page_)[LeafDirectory::place(i, j, k)];
}

void LeafCursor::move_to(int i, int j, int k, unsigned wanted) {
  if (found_ == 0 || i != i_ || j != j_ || k != k_) {
    i_ = i, j_ = j, k_ = k;
    found_ = 0;
    leaves_.fill(field_.leaves.outside_->data());
  }
  for (unsigned missing = wanted & ~found_; missing != 0; missing &= missing - 1) {
    const int n = std::countr_zero(missing);
    leaves_[static_cast<std::size_t>(n)] = find(i + (n >> 2), j + (n >> 1 & 1), k + (n & 1));
  }
  found_ |= wanted;
}

LeafCursor::Place LeafCursor::place_of(const Vec3& x) {
  const Vec3 index = (x - field_.origin) / field_.voxel_size;
  constexpr double kLargestIndex = 1 << 30;
  if (!((index.array().abs() < kLargestIndex).all()))
    return {.leaves = {}, .first = {}, .fraction = {}, .is_far = true};
  Place place;
  place.is_far = false;
  const Cell cx = cell_of(index.x()), cy = cell_of(index.y()), cz = cell_of(index.z());
  const int i = cx.node - 1, j = cy.node - 1, k = cz.node - 1;
  place.first = {i & 7, j & 7, k & 7};
  place.fraction = {cx.fraction, cy.fraction, cz.fraction};
  const auto reaches_on = [&](std::size_t axis) { return place.first[axis] > 4 ? 1u : 0u; };
  unsigned wanted = 1;
  wanted |= wanted << reaches_on(2);
  wanted |= wanted << 2 * reaches_on(1);
  wanted |= wanted << 4 * reaches_on(0);
  move_to(i >> 3, j >> 3, k >> 3, wanted);
  place.leaves = leaves_;
  return place;
}

/// A row of nodes is half a cache line, and four of them lie in three lines at most.
void LeafCursor::Place::prefetch() const {
  for (int i = first[0]; i < first[0] + 4; ++i) {
    for (const int j : {first[1], first[1] + 2, first[1] + 3}) {
      const auto leaf = static_cast<std::size_t>((i >> 3) << 2 | (j >> 3) << 1);
      const int row = (i & 7) << 6 | (j & 7) << 3;
      _mm_prefetch(leaves[leaf] + row, _MM_HINT_T0);
      if (first[2] > 4) _mm_prefetch(leaves[leaf + 1] + row, _MM_HINT_T0);
    }
  }
}

template <class Interpolate>
Sample LeafCursor::sample(const Place& place, Interpolate&& interpolate) const {
  const auto beyond = [](float background) {
    return Sample{static_cast<double>(background), Vec3::Zero()};
  };
  if (place.is_far) return beyond(field_.outside);
  Stencil stencil;
  switch (place.first[2]) {
    case 5:
      stencil.gather<3>(place);
      break;
    case 6:
      stencil.gather<2>(place);
      break;
    case 7:
      stencil.gather<1>(place);
      break;
    default:
      stencil.gather<4>(place);
  }
  if (!stencil.is_within(field_.inside, field_.outside))
    return beyond(stencil.rows[1][1][1] < 0 ? field_.inside : field_.outside);
  const Sample sample = interpolate(stencil, place.fraction);
  if (sample.distance >= static_cast<double>(field_.outside) - field_.voxel_size)
    return beyond(field_.outside);
  if (sample.distance <= static_cast<double>(field_.inside) + field_.voxel_size)
    return beyond(field_.inside);
  return sample;
}

Sample LeafCursor::sample(const Vec3& x) {
  return sample(place_of(x), [](const Stencil& stencil, const std::array<double, 3>& fraction) {
    return stencil.interpolate(fraction);
  });
}

void LeafCursor::sample(std::span<const Vec3> points, std::span<Sample> samples) {
  constexpr std::size_t kAtOnce = 16;
  std::array<Place, kAtOnce> places;
  const float* last = nullptr;
  for (std::size_t begin = 0; begin < points.size(); begin += kAtOnce) {
    const std::size_t count = std::min(kAtOnce, points.size() - begin);
    for (std::size_t n = 0; n < count; ++n) {
      places[n] = place_of(points[begin + n]);
      if (places[n].is_far || places[n].leaves[0] == last) continue;
      last = places[n].leaves[0];
      places[n].prefetch();
    }
    for (std::size_t n = 0; n < count; ++n) {
      samples[begin + n] =
          sample(places[n], [](const Stencil& stencil, const std::array<double, 3>& fraction) {
            return stencil.interpolate(fraction);
          });
    }
  }
}

Sample LeafCursor::sample_closely(const Vec3& x) {
  return sample(place_of(x), [](const Stencil& stencil, const std::array<double, 3>& fraction) {
    Sample sample = stencil.interpolate(fraction);
    sample.distance -= stencil.bend(fraction);
    return sample;
  });
}

}  // namespace vstent::sdf
