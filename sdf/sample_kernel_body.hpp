// Body of the sampling kernel: included by one .cpp per instruction set. Everything here has
// internal linkage.
#include <cmath>

#include "sdf/leaf_kernels.hpp"
#include "sdf/wide.hpp"

namespace vstent::sdf {
namespace {

typedef int RowPick __attribute__((vector_size(16)));
typedef int WidePick __attribute__((vector_size(32)));

inline Wide mix(Wide f, Wide a, Wide b) { return a + f * (b - a); }
inline Row mix(Row f, Row a, Row b) { return a + f * (b - a); }

inline Row load(const float* nodes) {
  Row loaded;
  __builtin_memcpy(&loaded, nodes, sizeof loaded);
  return loaded;
}

/// Two rows. Where a leaf ends, the first kBefore nodes are its last and the others begin the leaf
/// that follows.
template <int kBefore>
inline Wide load_rows(const LeafPlace& place, int a, int b) {
  const Wide rows = join(load(place.rows[a]), load(place.rows[b]));
  if constexpr (kBefore == 4) {
    return rows;
  } else {
    const auto next = [&](int row) {
      const int i = place.first[0] + LeafPlace::kRowOf[row][0];
      const int j = place.first[1] + LeafPlace::kRowOf[row][1];
      const float* leaf =
          place.leaves[LeafPlace::kStep[0] * (i >> 3) + LeafPlace::kStep[1] * (j >> 3) + 1];
      return load(leaf + ((i & 7) << 6 | (j & 7) << 3));
    };
    constexpr int s = 4 - kBefore;
    constexpr auto pick = [](int n) { return n < 4 ? n : n + 4; };
    constexpr WidePick kPick{pick(s),     pick(s + 1),     pick(s + 2),     pick(s + 3),
                             pick(s) + 4, pick(s + 1) + 4, pick(s + 2) + 4, pick(s + 3) + 4};
    return __builtin_shuffle(rows, join(next(a), next(b)), kPick);
  }
}

/// Of the 4^3 nodes around a point, value and nodal gradient need all but those on the cube's
/// edges.
template <int kBefore>
inline void sample_one(const LeafPlace& place, const LeafRange& range, double (&sample)[4]) {
  const Wide inner[4]{load_rows<kBefore>(place, 0, 1), load_rows<kBefore>(place, 3, 4),
                      load_rows<kBefore>(place, 7, 8), load_rows<kBefore>(place, 10, 11)};
  const Wide outer[2]{load_rows<kBefore>(place, 2, 5), load_rows<kBefore>(place, 6, 9)};

  const Wide x = wide(place.fraction[0]);
  const Wide middle = mix(x, inner[1], inner[2]), beside = mix(x, outer[0], outer[1]);
  const Wide along_x = mix(x, inner[2] - inner[0], inner[3] - inner[1]);
  const Row y = row(place.fraction[1]), z = row(place.fraction[2]);
  const Row value = mix(y, low(middle), high(middle));
  const Row dx = mix(y, low(along_x), high(along_x));
  const Row dy = mix(y, high(middle) - low(beside), high(beside) - low(middle));
  const Row dz = __builtin_shuffle(value, RowPick{2, 3, 2, 3}) - value;
  const Row front = __builtin_shuffle(value, dx, RowPick{1, 2, 5, 6});
  const Row back = __builtin_shuffle(dy, dz, RowPick{1, 2, 4, 5});
  const Row found = mix(z, __builtin_shuffle(front, back, RowPick{0, 2, 4, 6}),
                        __builtin_shuffle(front, back, RowPick{1, 3, 5, 7}));

  const Wide least = smaller(inner[1], inner[2]), most = larger(inner[1], inner[2]);
  const Wide outer_least = smaller(smaller(inner[0], inner[3]), smaller(outer[0], outer[1]));
  const Wide outer_most = larger(larger(inner[0], inner[3]), larger(outer[0], outer[1]));
  const unsigned is_within = below(wide(range.inside), least) & below(most, wide(range.outside));
  const unsigned outer_is_within =
      below(wide(range.inside), outer_least) & below(outer_most, wide(range.outside));
  constexpr unsigned kMiddle = 0x66;  // of the outer rows the first and the last node do not count
  const auto distance = static_cast<double>(found[0]);
  if (is_within != 0xFF || (outer_is_within & kMiddle) != kMiddle || distance >= range.outermost ||
      distance <= range.innermost) {
    const bool is_inside = is_within == 0xFF ? distance < 0 : inner[1][1] < 0;
    sample[0] = static_cast<double>(is_inside ? range.inside : range.outside);
    sample[1] = sample[2] = sample[3] = 0;
    return;
  }
  const auto slope_x = static_cast<double>(found[1]), slope_y = static_cast<double>(found[2]),
             slope_z = static_cast<double>(found[3]);
  const double norm = std::sqrt(slope_x * slope_x + slope_y * slope_y + slope_z * slope_z);
  const double scale = norm > 0 ? 1 / norm : 0;
  sample[0] = distance;
  sample[1] = scale * slope_x;
  sample[2] = scale * slope_y;
  sample[3] = scale * slope_z;
}

/// Points whose nodes end one leaf and begin the next come in turn, so that no branch on it is
/// guessed wrongly.
void sample(std::span<const LeafPlace> places, const LeafRange& range, double (*samples)[4]) {
  std::array<std::array<unsigned, kPlaces>, 4> of_kind;
  std::array<std::size_t, 4> count{};
  for (unsigned n = 0; n < places.size(); ++n) {
    const int beyond = places[n].first[2] - 4;
    const auto kind = static_cast<std::size_t>(beyond > 0 ? beyond : 0);
    of_kind[kind][count[kind]++] = n;
  }
  const auto all = [&]<int kBefore>(std::integral_constant<int, kBefore>) {
    for (std::size_t n = 0; n < count[4 - kBefore]; ++n) {
      const std::size_t point = of_kind[4 - kBefore][n];
      sample_one<kBefore>(places[point], range, samples[point]);
    }
  };
  all(std::integral_constant<int, 4>{});
  all(std::integral_constant<int, 3>{});
  all(std::integral_constant<int, 2>{});
  all(std::integral_constant<int, 1>{});
}

}  // namespace
}  // namespace vstent::sdf
