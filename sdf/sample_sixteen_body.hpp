// Samples sixteen points at once, one per lane, where registers are wide enough and nodes can be
// gathered. Everything here has internal linkage.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "sdf/leaf_kernels.hpp"
#include "sdf/wide.hpp"

namespace vstent::sdf {
namespace {

/// Of the 4^3 nodes around a point, value and nodal gradient need all but those on the cube's
/// edges.
constexpr bool is_needed(int i, int j, int k) {
  const auto is_end = [](int n) { return n == 0 || n == 3; };
  return is_end(i) + is_end(j) + is_end(k) < 2;
}

/// Those nodes around sixteen points.
struct Stencils {
  Nodes at[4][4][4];
};

inline const void* bytes(std::int64_t count) { return reinterpret_cast<const void*>(count); }

/// Around eight points, to the lower or upper half of each vector.
inline void read_eight(const LeafPlaces& places, std::size_t first, std::size_t half,
                       Stencils& stencils) {
  constexpr int kNode = sizeof(float), kRow = kLeafSide * kNode, kPlane = kLeafSide * kRow;
  const auto [step_i, step_j, step_k] = LeafPlaces::kStep;
  const auto node = [&](std::size_t axis) {
    const void* from = &places.node[axis][first];
    return _mm512_cvtepi32_epi64(_mm256_load_si256(static_cast<const __m256i*>(from)));
  };
  const __m512i i = node(0), j = node(1), k = node(2);
  const auto sum = [](__m512i a, __m512i b) { return _mm512_add_epi64(a, b); };
  const __m512i own =
      sum(sum(_mm512_slli_epi64(i, 8), _mm512_slli_epi64(j, 5)), _mm512_slli_epi64(k, 2));
  const __m512i pages = _mm512_load_si512(&places.leaves[first]);

  // Where the first node lies in the first leaf; or, counted on, before a leaf that follows.
  __m512i begin[2][2][2];
#pragma GCC unroll 8
  for (int leaf = 0; leaf < 8; ++leaf) {
    const int a = leaf >> 2, b = leaf >> 1 & 1, c = leaf & 1;
    const __m512i values = _mm512_i64gather_epi64(
        pages, bytes(sizeof(float*) * (a * step_i + b * step_j + c * step_k)), 1);
    const __m512i before = _mm512_set1_epi64(-kLeafSide * (a * kPlane + b * kRow + c * kNode));
    begin[a][b][c] = sum(values, sum(own, before));
  }
  const auto is_next = [](__m512i first_node, int ahead) {
    return _mm512_cmpgt_epi64_mask(first_node, _mm512_set1_epi64(kLeafSide - 1 - ahead));
  };
  const auto choose = [](__mmask8 second, __m512i a, __m512i b) {
    return _mm512_mask_blend_epi64(second, a, b);
  };
#pragma GCC unroll 4
  for (int di = 0; di < 4; ++di) {
    const __mmask8 next_i = is_next(i, di);
    __m512i plane[2][2];
    for (int n = 0; n < 4; ++n)
      plane[n >> 1][n & 1] = choose(next_i, begin[0][n >> 1][n & 1], begin[1][n >> 1][n & 1]);
#pragma GCC unroll 4
    for (int dj = 0; dj < 4; ++dj) {
      const __mmask8 next_j = is_next(j, dj);
      const __m512i row = choose(next_j, plane[0][0], plane[1][0]);
      const __m512i next_row = choose(next_j, plane[0][1], plane[1][1]);
#pragma GCC unroll 4
      for (int dk = 0; dk < 4; ++dk) {
        if (!is_needed(di, dj, dk)) continue;
        const __m256 values = _mm512_i64gather_ps(choose(is_next(k, dk), row, next_row),
                                                  bytes(di * kPlane + dj * kRow + dk * kNode), 1);
        float* to = reinterpret_cast<float*>(&stencils.at[di][dj][dk]) + 8 * half;
        _mm256_store_ps(to, values);
      }
    }
  }
}

inline Nodes mix(Nodes f, Nodes a, Nodes b) { return a + f * (b - a); }
inline Nodes select(__mmask16 mask, Nodes yes, Nodes no) {
  return (Nodes)_mm512_mask_blend_ps(mask, (__m512)no, (__m512)yes);
}
inline __mmask16 is_below(Nodes a, Nodes b) { return static_cast<__mmask16>(below(a, b)); }

/// Are all the nodes within the band?
struct Extent {
  Nodes least, most;

  void include(Nodes node) { least = smaller(least, node), most = larger(most, node); }
  __mmask16 is_within(const LeafRange& range) const {
    return is_below(nodes(range.inside), least) & is_below(most, nodes(range.outside));
  }
};

/// In double precision, four points at a time.
inline void store_normalised(const Nodes (&found)[4], std::array<double, 4>* samples) {
  alignas(64) float apart[4][16];
  __builtin_memcpy(apart, found, sizeof apart);
  for (std::size_t n = 0; n < 16; n += 4) {
    Four part[4];
    for (int m = 0; m < 4; ++m) part[m] = doubles(*reinterpret_cast<const Row*>(apart[m] + n));
    const Four squared = part[1] * part[1] + part[2] * part[2] + part[3] * part[3];
    const Four norm = (Four)_mm256_sqrt_pd((__m256d)squared);
    const Four scale = norm > Four{} ? 1 / norm : Four{};
    for (int m = 1; m < 4; ++m) part[m] *= scale;
    typedef std::int64_t Pick __attribute__((vector_size(32)));
    const Four low01 = __builtin_shuffle(part[0], part[1], Pick{0, 4, 2, 6}),
               high01 = __builtin_shuffle(part[0], part[1], Pick{1, 5, 3, 7}),
               low23 = __builtin_shuffle(part[2], part[3], Pick{0, 4, 2, 6}),
               high23 = __builtin_shuffle(part[2], part[3], Pick{1, 5, 3, 7});
    const Four points[4]{__builtin_shuffle(low01, low23, Pick{0, 1, 4, 5}),
                         __builtin_shuffle(high01, high23, Pick{0, 1, 4, 5}),
                         __builtin_shuffle(low01, low23, Pick{2, 3, 6, 7}),
                         __builtin_shuffle(high01, high23, Pick{2, 3, 6, 7})};
    __builtin_memcpy(samples + n, points, sizeof points);
  }
}

/// The same operations in the same order as point by point.
inline void sample_sixteen(const LeafPlaces& places, std::size_t first, const LeafRange& range,
                           std::array<double, 4>* samples) {
  Stencils stencils;
  read_eight(places, first, 0, stencils);
  read_eight(places, first + 8, 1, stencils);
  const auto& at = stencils.at;
  const auto fraction = [&](std::size_t axis) {
    return (Nodes)_mm512_load_ps(&places.fraction[axis][first]);
  };
  const Nodes x = fraction(0), y = fraction(1), z = fraction(2);
  Nodes value[4], dx[4], dy[4];
#pragma GCC unroll 4
  for (int k = 0; k < 4; ++k) {
    const auto along = [&](int j) { return mix(x, at[1][j][k], at[2][j][k]); };
    const Nodes before = along(1), after = along(2);
    value[k] = mix(y, before, after);
    if (k == 0 || k == 3) continue;
    const auto slope = [&](int j) {
      return mix(x, at[2][j][k] - at[0][j][k], at[3][j][k] - at[1][j][k]);
    };
    dx[k] = mix(y, slope(1), slope(2));
    dy[k] = mix(y, after - along(0), along(3) - before);
  }
  Nodes found[4]{mix(z, value[1], value[2]), mix(z, dx[1], dx[2]), mix(z, dy[1], dy[2]),
                 mix(z, value[2] - value[0], value[3] - value[1])};

  Extent inner{at[1][1][1], at[1][1][1]}, outer{at[0][1][1], at[0][1][1]};
#pragma GCC unroll 64
  for (int n = 0; n < 64; ++n) {
    const int i = n >> 4, j = n >> 2 & 3, k = n & 3;
    if (is_needed(i, j, k)) (is_needed(i, j, 0) ? inner : outer).include(at[i][j][k]);
  }
  const __mmask16 is_inner_within = inner.is_within(range);
  const __mmask16 is_within = is_inner_within & outer.is_within(range) &
                              is_below(found[0], nodes(range.outermost)) &
                              is_below(nodes(range.innermost), found[0]);
  const Nodes side = select(is_inner_within, found[0], at[1][1][1]);
  const Nodes beyond = select(is_below(side, Nodes{}), nodes(range.inside), nodes(range.outside));
  found[0] = select(is_within, found[0], beyond);
  for (int n = 1; n < 4; ++n) found[n] = select(is_within, found[n], Nodes{});
  store_normalised(found, samples);
}

}  // namespace
}  // namespace vstent::sdf
