// Eight floats at once, or sixteen, for the files that are compiled once per instruction set; all
// give the same bits. Everything here has internal linkage, so that code for wide registers cannot
// leak into other files.
#pragma once

#include <immintrin.h>

#include <bit>

namespace vstent::sdf {
namespace {

typedef float Row __attribute__((vector_size(16), may_alias));
typedef float Wide __attribute__((vector_size(32), may_alias));
typedef int Mask __attribute__((vector_size(32)));  // -1 where true
typedef double Four __attribute__((vector_size(32), may_alias));
typedef decltype(Four{} < Four{}) FourMask;  // -1 where true

inline Row row(float a) { return Row{a, a, a, a}; }
inline Wide wide(float a) { return Wide{a, a, a, a, a, a, a, a}; }

#ifdef __AVX2__
inline Row low(Wide a) { return (Row)_mm256_castps256_ps128((__m256)a); }
inline Row high(Wide a) { return (Row)_mm256_extractf128_ps((__m256)a, 1); }
inline Wide join(Row a, Row b) { return (Wide)_mm256_set_m128((__m128)b, (__m128)a); }
inline Wide root(Wide a) { return (Wide)_mm256_sqrt_ps((__m256)a); }
inline Wide smaller(Wide a, Wide b) { return (Wide)_mm256_min_ps((__m256)a, (__m256)b); }
inline Wide larger(Wide a, Wide b) { return (Wide)_mm256_max_ps((__m256)a, (__m256)b); }
inline unsigned below(Wide a, Wide b) {
  return static_cast<unsigned>(_mm256_movemask_ps(_mm256_cmp_ps((__m256)a, (__m256)b, _CMP_LT_OQ)));
}
inline Four doubles(Row a) { return (Four)_mm256_cvtps_pd((__m128)a); }
inline bool all_of(Mask a) { return _mm256_movemask_ps((__m256)a) == 0xFF; }
inline Four floor(Four a) { return (Four)_mm256_floor_pd((__m256d)a); }
inline unsigned bits(FourMask a) { return static_cast<unsigned>(_mm256_movemask_pd((__m256d)a)); }
#else
struct Halves {
  __m128 low, high;
};
inline Halves halves(Wide a) { return std::bit_cast<Halves>(a); }
inline Row low(Wide a) { return (Row)halves(a).low; }
inline Row high(Wide a) { return (Row)halves(a).high; }
inline Wide join(Row a, Row b) { return std::bit_cast<Wide>(Halves{(__m128)a, (__m128)b}); }
inline Wide root(Wide a) {
  return std::bit_cast<Wide>(Halves{_mm_sqrt_ps(halves(a).low), _mm_sqrt_ps(halves(a).high)});
}
inline Wide smaller(Wide a, Wide b) {
  return std::bit_cast<Wide>(
      Halves{_mm_min_ps(halves(a).low, halves(b).low), _mm_min_ps(halves(a).high, halves(b).high)});
}
inline Wide larger(Wide a, Wide b) {
  return std::bit_cast<Wide>(
      Halves{_mm_max_ps(halves(a).low, halves(b).low), _mm_max_ps(halves(a).high, halves(b).high)});
}
inline unsigned below(Wide a, Wide b) {
  const int low = _mm_movemask_ps(_mm_cmplt_ps(halves(a).low, halves(b).low));
  const int high = _mm_movemask_ps(_mm_cmplt_ps(halves(a).high, halves(b).high));
  return static_cast<unsigned>(low | high << 4);
}
inline Four doubles(Row a) { return __builtin_convertvector(a, Four); }
inline bool all_of(Mask a) {
  return (_mm_movemask_ps(std::bit_cast<Halves>(a).low) &
          _mm_movemask_ps(std::bit_cast<Halves>(a).high)) == 0xF;
}
inline unsigned bits(FourMask a) {
  struct Doubles {
    __m128d low, high;
  };
  const auto [low, high] = std::bit_cast<Doubles>(a);
  return static_cast<unsigned>(_mm_movemask_pd(low) | _mm_movemask_pd(high) << 2);
}
inline Four floor(Four a) {  // of numbers that an int can hold
  typedef int Ints __attribute__((vector_size(16)));
  const Four truncated = __builtin_convertvector(__builtin_convertvector(a, Ints), Four);
  return truncated > a ? truncated - 1 : truncated;
}
#endif

inline Wide absolute(Wide a) { return larger(a, -a); }

/// kRowsAtOnce rows of a leaf, (i, j), (i + 1, j), ..., i being a multiple of kRowsAtOnce.
#ifdef __AVX512F__
constexpr int kRowsAtOnce = 2;
typedef float Nodes __attribute__((vector_size(64), may_alias));
typedef __mmask16 Chosen;  // of the rows
constexpr Chosen kAllRows = 0xFFFF;

inline Nodes nodes(float a) { return (Nodes)_mm512_set1_ps(a); }
inline Nodes repeat(Wide row) { return (Nodes)_mm512_broadcast_f32x8((__m256)row); }
/// Of[i] throughout row (i, j), and so on.
inline Nodes per_row(const Wide& of, int i) {
  const __m512i rows = _mm512_set_epi32(1, 1, 1, 1, 1, 1, 1, 1, 0, 0, 0, 0, 0, 0, 0, 0);
  return (Nodes)_mm512_permutexvar_ps(_mm512_add_epi32(_mm512_set1_epi32(i), rows),
                                      _mm512_castps256_ps512((__m256)of));
}
inline Nodes load_rows(const float* first) {
  const __m256 low = _mm256_loadu_ps(first), high = _mm256_loadu_ps(first + 64);
  return (Nodes)_mm512_insertf32x8(_mm512_castps256_ps512(low), high, 1);
}
inline void store_rows(Nodes a, float* first) {
  _mm256_storeu_ps(first, _mm512_castps512_ps256((__m512)a));
  _mm256_storeu_ps(first + 64, _mm512_extractf32x8_ps((__m512)a, 1));
}
inline Nodes root(Nodes a) { return (Nodes)_mm512_sqrt_ps((__m512)a); }
inline Nodes smaller(Nodes a, Nodes b) { return (Nodes)_mm512_min_ps((__m512)a, (__m512)b); }
inline Nodes larger(Nodes a, Nodes b) { return (Nodes)_mm512_max_ps((__m512)a, (__m512)b); }
inline Nodes absolute(Nodes a) { return larger(a, -a); }
inline unsigned below(Nodes a, Nodes b) {
  return _mm512_cmp_ps_mask((__m512)a, (__m512)b, _CMP_LT_OQ);
}
/// Those from first_i to end_i.
inline Chosen choose(int i, int first_i, int end_i) {
  return static_cast<Chosen>((i >= first_i ? 0xFF : 0) | (i + 1 < end_i ? 0xFF00 : 0));
}
inline Nodes lowered(Nodes a, Nodes to, Chosen rows) {
  return (Nodes)_mm512_mask_min_ps((__m512)a, rows, (__m512)a, (__m512)to);
}
#else
constexpr int kRowsAtOnce = 1;
typedef Wide Nodes;
struct Chosen {};
constexpr Chosen kAllRows{};

inline Nodes nodes(float a) { return wide(a); }
inline Nodes repeat(Wide row) { return row; }
inline Nodes per_row(const Wide& of, int i) { return wide(of[i]); }
inline Nodes load_rows(const float* first) {
  Nodes loaded;
  __builtin_memcpy(&loaded, first, sizeof loaded);
  return loaded;
}
inline void store_rows(Nodes a, float* first) { __builtin_memcpy(first, &a, sizeof a); }
inline Chosen choose(int, int, int) { return {}; }
inline Nodes lowered(Nodes a, Nodes to, Chosen) { return smaller(a, to); }
#endif

}  // namespace
}  // namespace vstent::sdf
