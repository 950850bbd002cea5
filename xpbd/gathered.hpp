// Particles gathered into wide registers and put back. Everything here has internal linkage.
#pragma once

#include "xpbd/wide.hpp"

namespace vstent::xpbd {
namespace {

/// Particles, transposed.
template <class Real>
struct Gathered {
  Wide3<Real> at;
  Wide<Real> mobility;
  const int* number;  ///< of their slots
};

/// Of the particles of one register: x, y, z, mobility.
template <class Real>
struct Columns {
  typename Register<Real>::Type of[4];
};

/// Of two registers, in every 16 bytes: the first two numbers of either in turn, and the last two.
#ifdef __AVX512F__
constexpr Register<float>::Bits kFirst{0, 16, 1, 17, 4, 20, 5, 21, 8, 24, 9, 25, 12, 28, 13, 29},
    kLast{2, 18, 3, 19, 6, 22, 7, 23, 10, 26, 11, 27, 14, 30, 15, 31};
#elif defined(__AVX2__)
constexpr Register<float>::Bits kFirst{0, 8, 1, 9, 4, 12, 5, 13}, kLast{2, 10, 3, 11, 6, 14, 7, 15};
#else
constexpr Register<float>::Bits kFirst{0, 4, 1, 5}, kLast{2, 6, 3, 7};
#endif

/// A square of four rows and columns in every 16 bytes.
inline void transpose(Floats (&rows)[4]) {
  const Floats a = __builtin_shuffle(rows[0], rows[2], kFirst),
               b = __builtin_shuffle(rows[1], rows[3], kFirst),
               c = __builtin_shuffle(rows[0], rows[2], kLast),
               d = __builtin_shuffle(rows[1], rows[3], kLast);
  rows[0] = __builtin_shuffle(a, b, kFirst), rows[1] = __builtin_shuffle(a, b, kLast);
  rows[2] = __builtin_shuffle(c, d, kFirst), rows[3] = __builtin_shuffle(c, d, kLast);
}

#ifdef __AVX512F__
template <int kChunks>
inline Doubles chunks(Doubles a, Doubles b) {
  return (Doubles)_mm512_shuffle_f64x2((__m512d)a, (__m512d)b, kChunks);
}
inline Doubles interleave_low(Doubles a, Doubles b) {
  return (Doubles)_mm512_unpacklo_pd((__m512d)a, (__m512d)b);
}
inline Doubles interleave_high(Doubles a, Doubles b) {
  return (Doubles)_mm512_unpackhi_pd((__m512d)a, (__m512d)b);
}

[[gnu::always_inline]] inline void gather_part(const Slot* slots, const int* number,
                                               Columns<double>& columns) {
  const auto rows = [&](int lane) {  // of this one and the next but one
    const auto row = [&](int at) {
      return _mm256_load_pd(reinterpret_cast<const double*>(slots + number[at]));
    };
    return (Doubles)_mm512_insertf64x4(_mm512_castpd256_pd512(row(lane)), row(lane + 2), 1);
  };
  const Doubles a = rows(0), b = rows(1), c = rows(4), d = rows(5);
  const Doubles xz = interleave_low(a, b), xz_after = interleave_low(c, d);
  const Doubles ym = interleave_high(a, b), ym_after = interleave_high(c, d);
  columns = {{chunks<0x88>(xz, xz_after), chunks<0x88>(ym, ym_after), chunks<0xDD>(xz, xz_after),
              chunks<0xDD>(ym, ym_after)}};
}

[[gnu::always_inline]] inline void scatter_part(Slot* slots, const int* number,
                                                const Columns<double>& columns) {
  const auto [x, y, z, m] = columns.of;
  // Even and odd lanes' halves: lanes 0, 2, 4, 6, and 1, 3, 5, 7.
  const Doubles xy_even = interleave_low(x, y), xy_odd = interleave_high(x, y);
  const Doubles zm_even = interleave_low(z, m), zm_odd = interleave_high(z, m);
  const auto put = [&](int lane, Doubles xy, Doubles zm) {
    const __m512i first = _mm512_setr_epi64(0, 1, 8, 9, 2, 3, 10, 11);
    const __m512i last = _mm512_setr_epi64(4, 5, 12, 13, 6, 7, 14, 15);
    const __m512d near = _mm512_permutex2var_pd((__m512d)xy, first, (__m512d)zm);
    const __m512d far = _mm512_permutex2var_pd((__m512d)xy, last, (__m512d)zm);
    const auto at = [&](int n) { return reinterpret_cast<double*>(slots + number[n]); };
    _mm256_store_pd(at(lane), _mm512_castpd512_pd256(near));
    _mm256_store_pd(at(lane + 2), _mm512_extractf64x4_pd(near, 1));
    _mm256_store_pd(at(lane + 4), _mm512_castpd512_pd256(far));
    _mm256_store_pd(at(lane + 6), _mm512_extractf64x4_pd(far, 1));
  };
  put(0, xy_even, zm_even);
  put(1, xy_odd, zm_odd);
}

[[gnu::always_inline]] inline void gather_part(const SlotOf<float>* slots, const int* number,
                                               Columns<float>& columns) {
  const auto row = [&](int lane) {
    return _mm_load_ps(reinterpret_cast<const float*>(slots + number[lane]));
  };
  const auto rows = [&](int lane) {
    __m512 all = _mm512_castps128_ps512(row(lane));
    all = _mm512_insertf32x4(all, row(lane + 4), 1);
    all = _mm512_insertf32x4(all, row(lane + 8), 2);
    return (Floats)_mm512_insertf32x4(all, row(lane + 12), 3);
  };
  columns = {{rows(0), rows(1), rows(2), rows(3)}};
  transpose(columns.of);
}

[[gnu::always_inline]] inline void scatter_part(SlotOf<float>* slots, const int* number,
                                                Columns<float> columns) {
  transpose(columns.of);
  const auto put = [&](int lane, __m128 row) {
    _mm_store_ps(reinterpret_cast<float*>(slots + number[lane]), row);
  };
  for (int n = 0; n < 4; ++n) {
    const __m512 rows = (__m512)columns.of[n];
    put(n, _mm512_castps512_ps128(rows));
    put(n + 4, _mm512_extractf32x4_ps(rows, 1));
    put(n + 8, _mm512_extractf32x4_ps(rows, 2));
    put(n + 12, _mm512_extractf32x4_ps(rows, 3));
  }
}
#elif defined(__AVX2__)
typedef double TwoDoubles __attribute__((vector_size(16), may_alias));
typedef float FourFloats __attribute__((vector_size(16), may_alias));
inline Doubles join(TwoDoubles a, TwoDoubles b) {
  return (Doubles)_mm256_set_m128d((__m128d)b, (__m128d)a);
}
inline Floats join(FourFloats a, FourFloats b) {
  return (Floats)_mm256_set_m128((__m128)b, (__m128)a);
}
inline TwoDoubles low(Doubles a) { return (TwoDoubles)_mm256_castpd256_pd128((__m256d)a); }
inline TwoDoubles high(Doubles a) { return (TwoDoubles)_mm256_extractf128_pd((__m256d)a, 1); }
inline FourFloats low(Floats a) { return (FourFloats)_mm256_castps256_ps128((__m256)a); }
inline FourFloats high(Floats a) { return (FourFloats)_mm256_extractf128_ps((__m256)a, 1); }

[[gnu::always_inline]] inline void gather_part(const Slot* slots, const int* number,
                                               Columns<double>& columns) {
  typedef Register<double>::Bits Pick;
  const auto half = [&](int lane, int which) {
    return reinterpret_cast<const TwoDoubles*>(slots + number[lane])[which];
  };
  const Doubles xy02 = join(half(0, 0), half(2, 0)), xy13 = join(half(1, 0), half(3, 0));
  const Doubles zm02 = join(half(0, 1), half(2, 1)), zm13 = join(half(1, 1), half(3, 1));
  constexpr Pick kEven{0, 4, 2, 6}, kOdd{1, 5, 3, 7};
  columns = {{__builtin_shuffle(xy02, xy13, kEven), __builtin_shuffle(xy02, xy13, kOdd),
              __builtin_shuffle(zm02, zm13, kEven), __builtin_shuffle(zm02, zm13, kOdd)}};
}

[[gnu::always_inline]] inline void scatter_part(Slot* slots, const int* number,
                                                const Columns<double>& columns) {
  typedef Register<double>::Bits Pick;
  constexpr Pick kEven{0, 4, 2, 6}, kOdd{1, 5, 3, 7};
  for (int which = 0; which < 2; ++which) {
    const Doubles a = columns.of[2 * which], b = columns.of[2 * which + 1];
    const Doubles of02 = __builtin_shuffle(a, b, kEven), of13 = __builtin_shuffle(a, b, kOdd);
    const auto put = [&](int lane, TwoDoubles half) {
      reinterpret_cast<TwoDoubles*>(slots + number[lane])[which] = half;
    };
    put(0, low(of02)), put(1, low(of13)), put(2, high(of02)), put(3, high(of13));
  }
}

[[gnu::always_inline]] inline void gather_part(const SlotOf<float>* slots, const int* number,
                                               Columns<float>& columns) {
  const auto row = [&](int lane) {
    return *reinterpret_cast<const FourFloats*>(slots + number[lane]);
  };
  columns = {
      {join(row(0), row(4)), join(row(1), row(5)), join(row(2), row(6)), join(row(3), row(7))}};
  transpose(columns.of);
}

[[gnu::always_inline]] inline void scatter_part(SlotOf<float>* slots, const int* number,
                                                Columns<float> columns) {
  transpose(columns.of);
  const auto put = [&](int lane, FourFloats row) {
    *reinterpret_cast<FourFloats*>(slots + number[lane]) = row;
  };
  for (int n = 0; n < 4; ++n) put(n, low(columns.of[n])), put(4 + n, high(columns.of[n]));
}
#else
[[gnu::always_inline]] inline void gather_part(const Slot* slots, const int* number,
                                               Columns<double>& columns) {
  typedef Register<double>::Bits Pick;
  const auto half = [&](int lane, int which) {
    return reinterpret_cast<const Doubles*>(slots + number[lane])[which];
  };
  for (int which = 0; which < 2; ++which) {
    const Doubles first = half(0, which), second = half(1, which);
    columns.of[2 * which] = __builtin_shuffle(first, second, Pick{0, 2});
    columns.of[2 * which + 1] = __builtin_shuffle(first, second, Pick{1, 3});
  }
}

[[gnu::always_inline]] inline void scatter_part(Slot* slots, const int* number,
                                                const Columns<double>& columns) {
  typedef Register<double>::Bits Pick;
  for (int which = 0; which < 2; ++which) {
    const Doubles a = columns.of[2 * which], b = columns.of[2 * which + 1];
    reinterpret_cast<Doubles*>(slots + number[0])[which] = __builtin_shuffle(a, b, Pick{0, 2});
    reinterpret_cast<Doubles*>(slots + number[1])[which] = __builtin_shuffle(a, b, Pick{1, 3});
  }
}

[[gnu::always_inline]] inline void gather_part(const SlotOf<float>* slots, const int* number,
                                               Columns<float>& columns) {
  for (int n = 0; n < 4; ++n) columns.of[n] = *reinterpret_cast<const Floats*>(slots + number[n]);
  transpose(columns.of);
}

[[gnu::always_inline]] inline void scatter_part(SlotOf<float>* slots, const int* number,
                                                Columns<float> columns) {
  transpose(columns.of);
  for (int n = 0; n < 4; ++n) *reinterpret_cast<Floats*>(slots + number[n]) = columns.of[n];
}
#endif

template <class Real>
[[gnu::always_inline]] inline void gather(const SlotOf<Real>* slots, const Lanes<int>& numbers,
                                          Gathered<Real>& gathered) {
  const int* number = gathered.number = numbers.data();
#pragma GCC unroll 8
  for (int n = 0; n < kParts<Real>; ++n) {
    Columns<Real> columns;
    gather_part(slots, number + n * static_cast<int>(kBytes / sizeof(Real)), columns);
    gathered.at.x.part[n] = columns.of[0];
    gathered.at.y.part[n] = columns.of[1];
    gathered.at.z.part[n] = columns.of[2];
    gathered.mobility.part[n] = columns.of[3];
  }
}

/// Moves the particles to where they are `at`.
template <class Real>
[[gnu::always_inline]] inline void scatter(SlotOf<Real>* slots, const Gathered<Real>& gathered) {
  const auto& [at, mobility, number] = gathered;
#pragma GCC unroll 8
  for (int n = 0; n < kParts<Real>; ++n)
    scatter_part(slots, number + n * static_cast<int>(kBytes / sizeof(Real)),
                 Columns<Real>{{at.x.part[n], at.y.part[n], at.z.part[n], mobility.part[n]}});
}

}  // namespace
}  // namespace vstent::xpbd
