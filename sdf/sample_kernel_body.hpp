// Body of the sampling kernel: included by one .cpp per instruction set. Everything here has
// internal linkage.
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

/// Nodes of two rows that differ in k. Where a leaf ends, the first kBefore are its last and the
/// others begin the leaf that follows.
template <int kBefore>
inline Wide load_rows(const float* const* leaf_a, int a, const float* const* leaf_b, int b) {
  if constexpr (kBefore == 4) {
    return join(load(leaf_a[0] + a), load(leaf_b[0] + b));
  } else {
    constexpr int s = 4 - kBefore;
    constexpr auto pick = [](int n) { return n < 4 ? n : n + 4; };
    constexpr WidePick kPick{pick(s),     pick(s + 1),     pick(s + 2),     pick(s + 3),
                             pick(s) + 4, pick(s + 1) + 4, pick(s + 2) + 4, pick(s + 3) + 4};
    return __builtin_shuffle(join(load(leaf_a[0] + a + 4), load(leaf_b[0] + b + 4)),
                             join(load(leaf_a[1] + a), load(leaf_b[1] + b)), kPick);
  }
}

/// Of the 4^3 nodes around a point, value and nodal gradient need all but those on the cube's
/// edges.
template <int kBefore>
inline void sample_one(const LeafPlace& place, float inside, float outside, LeafSample& sample) {
  const int first_k = kBefore == 4 ? place.first[2] : 0;
  const float* const* leaves[4];
  int at[4];
  for (int j = 0; j < 4; ++j) {
    const int node = place.first[1] + j;
    leaves[j] = place.leaves + LeafPlace::kStep[1] * (node >> 3);
    at[j] = (node & 7) << 3 | first_k;
  }
  const auto rows = [&](int i, int j, int other_j) {
    const int node = place.first[0] + i, plane = (node & 7) << 6;
    const std::ptrdiff_t leaf = LeafPlace::kStep[0] * (node >> 3);
    return load_rows<kBefore>(leaves[j] + leaf, plane + at[j], leaves[other_j] + leaf,
                              plane + at[other_j]);
  };
  const Wide inner[4]{rows(0, 1, 2), rows(1, 1, 2), rows(2, 1, 2), rows(3, 1, 2)};
  const Wide outer[2]{rows(1, 0, 3), rows(2, 0, 3)};

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
  const unsigned is_within = below(wide(inside), least) & below(most, wide(outside));
  const unsigned outer_is_within =
      below(wide(inside), outer_least) & below(outer_most, wide(outside));
  constexpr unsigned kMiddle = 0x66;  // of the outer rows the first and the last node do not count
  if (is_within == 0xFF && (outer_is_within & kMiddle) == kMiddle) {
    __builtin_memcpy(&sample, &found, sizeof found);
  } else {
    sample = {inner[1][1] < 0 ? inside : outside, {}};
  }
}

/// Points whose nodes end one leaf and begin the next come in turn, so that no branch on it is
/// guessed wrongly.
void sample(std::span<const LeafPlace> places, float inside, float outside, LeafSample* samples) {
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
      sample_one<kBefore>(places[point], inside, outside, samples[point]);
    }
  };
  all(std::integral_constant<int, 4>{});
  all(std::integral_constant<int, 3>{});
  all(std::integral_constant<int, 2>{});
  all(std::integral_constant<int, 1>{});
}

}  // namespace
}  // namespace vstent::sdf
