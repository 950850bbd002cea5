// Eight floats at once, for the files that are compiled once per instruction set; both give the
// same bits. Everything here has internal linkage, so that code for wide registers cannot leak into
// other files.
#pragma once

#include <immintrin.h>

#include <bit>

namespace vstent::sdf {
namespace {

typedef float Row __attribute__((vector_size(16), may_alias));
typedef float Wide __attribute__((vector_size(32), may_alias));
typedef int Mask __attribute__((vector_size(32)));  // -1 where true
typedef double Four __attribute__((vector_size(32), may_alias));

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
inline Four floor(Four a) {  // of numbers that an int can hold
  typedef int Ints __attribute__((vector_size(16)));
  const Four truncated = __builtin_convertvector(__builtin_convertvector(a, Ints), Four);
  return truncated > a ? truncated - 1 : truncated;
}
#endif

inline Wide absolute(Wide a) { return larger(a, -a); }

}  // namespace
}  // namespace vstent::sdf
