// A batch's numbers at once, for the files that are compiled once per instruction set; all give the
// same bits. Everything here has internal linkage, so that code for wide registers cannot leak into
// other files.
#pragma once

#include <immintrin.h>

#include "xpbd/batches.hpp"

namespace vstent::xpbd {
namespace {

#if defined(__AVX512F__)
constexpr std::size_t kBytes = 64;
#elif defined(__AVX2__)
constexpr std::size_t kBytes = 32;
#else
constexpr std::size_t kBytes = 16;
#endif
/// Registers that hold a batch's numbers.
template <class Real>
constexpr int kParts = static_cast<int>(kLanes * sizeof(Real) / kBytes);

template <class Real>
struct Register;

/// `Type` holds kBytes / sizeof(Real) numbers.
template <>
struct Register<double> {
  typedef double Type __attribute__((vector_size(kBytes), may_alias));
  typedef long long Bits __attribute__((vector_size(kBytes)));
  static constexpr long long kMagnitude = 0x7fffffffffffffffLL;
};

template <>
struct Register<float> {
  typedef float Type __attribute__((vector_size(kBytes), may_alias));
  typedef int Bits __attribute__((vector_size(kBytes)));
  static constexpr int kMagnitude = 0x7fffffff;
};

typedef Register<double>::Type Doubles;
typedef Register<float>::Type Floats;

#ifdef __AVX512F__
typedef __mmask8 DoubleMask;
typedef __mmask16 FloatMask;
inline DoubleMask less(Doubles a, Doubles b) {
  return _mm512_cmp_pd_mask((__m512d)a, (__m512d)b, _CMP_LT_OQ);
}
inline FloatMask less(Floats a, Floats b) {
  return _mm512_cmp_ps_mask((__m512)a, (__m512)b, _CMP_LT_OQ);
}
inline Doubles choose(DoubleMask mask, Doubles yes, Doubles no) {
  return (Doubles)_mm512_mask_blend_pd(mask, (__m512d)no, (__m512d)yes);
}
inline Floats choose(FloatMask mask, Floats yes, Floats no) {
  return (Floats)_mm512_mask_blend_ps(mask, (__m512)no, (__m512)yes);
}
inline bool is_full(DoubleMask mask) { return mask == 0xFF; }
inline bool is_full(FloatMask mask) { return mask == 0xFFFF; }
inline Doubles root(Doubles a) { return (Doubles)_mm512_sqrt_pd((__m512d)a); }
inline Floats root(Floats a) { return (Floats)_mm512_sqrt_ps((__m512)a); }
#else
typedef Register<double>::Bits DoubleMask;
typedef Register<float>::Bits FloatMask;
inline DoubleMask less(Doubles a, Doubles b) { return a < b; }
inline FloatMask less(Floats a, Floats b) { return a < b; }
inline Doubles choose(DoubleMask mask, Doubles yes, Doubles no) { return mask ? yes : no; }
inline Floats choose(FloatMask mask, Floats yes, Floats no) { return mask ? yes : no; }
#ifdef __AVX2__
inline bool is_full(DoubleMask mask) { return _mm256_movemask_pd((__m256d)mask) == 0xF; }
inline bool is_full(FloatMask mask) { return _mm256_movemask_ps((__m256)mask) == 0xFF; }
inline Doubles root(Doubles a) { return (Doubles)_mm256_sqrt_pd((__m256d)a); }
inline Floats root(Floats a) { return (Floats)_mm256_sqrt_ps((__m256)a); }
#else
inline bool is_full(DoubleMask mask) { return _mm_movemask_pd((__m128d)mask) == 0x3; }
inline bool is_full(FloatMask mask) { return _mm_movemask_ps((__m128)mask) == 0xF; }
inline Doubles root(Doubles a) { return (Doubles)_mm_sqrt_pd((__m128d)a); }
inline Floats root(Floats a) { return (Floats)_mm_sqrt_ps((__m128)a); }
#endif
#endif

#if defined(__AVX512F__)
inline Doubles in_double(const float* numbers) {
  return (Doubles)_mm512_cvtps_pd(_mm256_load_ps(numbers));
}
/// What it has become.
inline Doubles put_in_single(Doubles a, float* numbers) {
  const __m256 rounded = _mm512_cvtpd_ps((__m512d)a);
  _mm256_store_ps(numbers, rounded);
  return (Doubles)_mm512_cvtps_pd(rounded);
}
inline Floats in_single(Doubles low, Doubles high) {
  return (Floats)_mm512_insertf32x8(_mm512_castps256_ps512(_mm512_cvtpd_ps((__m512d)low)),
                                    _mm512_cvtpd_ps((__m512d)high), 1);
}
#elif defined(__AVX2__)
inline Doubles in_double(const float* numbers) {
  return (Doubles)_mm256_cvtps_pd(_mm_load_ps(numbers));
}
inline Doubles put_in_single(Doubles a, float* numbers) {
  const __m128 rounded = _mm256_cvtpd_ps((__m256d)a);
  _mm_store_ps(numbers, rounded);
  return (Doubles)_mm256_cvtps_pd(rounded);
}
inline Floats in_single(Doubles low, Doubles high) {
  return (Floats)_mm256_set_m128(_mm256_cvtpd_ps((__m256d)high), _mm256_cvtpd_ps((__m256d)low));
}
#else
inline Doubles in_double(const float* numbers) {
  return (Doubles)_mm_cvtps_pd(
      _mm_castsi128_ps(_mm_loadl_epi64(reinterpret_cast<const __m128i*>(numbers))));
}
inline Doubles put_in_single(Doubles a, float* numbers) {
  const __m128 rounded = _mm_cvtpd_ps((__m128d)a);
  _mm_storel_epi64(reinterpret_cast<__m128i*>(numbers), _mm_castps_si128(rounded));
  return (Doubles)_mm_cvtps_pd(rounded);
}
inline Floats in_single(Doubles low, Doubles high) {
  return (Floats)_mm_movelh_ps(_mm_cvtpd_ps((__m128d)low), _mm_cvtpd_ps((__m128d)high));
}
#endif

/// {make(0), make(1), ...}.
template <class Whole, class Make>
inline Whole part_by_part(const Make& make) {
  if constexpr (Whole::kCount == 8) {
    return {{make(0), make(1), make(2), make(3), make(4), make(5), make(6), make(7)}};
  } else if constexpr (Whole::kCount == 4) {
    return {{make(0), make(1), make(2), make(3)}};
  } else if constexpr (Whole::kCount == 2) {
    return {{make(0), make(1)}};
  } else {
    return {{make(0)}};
  }
}

template <class Real>
struct Mask {
  static constexpr int kCount = kParts<Real>;
  decltype(less(typename Register<Real>::Type{}, typename Register<Real>::Type{})) part[kCount];

  friend Mask operator&(const Mask& a, const Mask& b) {
    Mask both = a;
    for (int n = 0; n < kCount; ++n) both.part[n] &= b.part[n];
    return both;
  }
};

template <class Real>
inline bool all(const Mask<Real>& mask) {
  bool full = true;
  for (const auto& part : mask.part) full &= is_full(part);
  return full;
}

template <class Real>
struct Wide {
  static constexpr int kCount = kParts<Real>;
  typename Register<Real>::Type part[kCount];

  friend Wide operator+(const Wide& a, const Wide& b) {
    return part_by_part<Wide>([&](int n) { return a.part[n] + b.part[n]; });
  }
  friend Wide operator-(const Wide& a, const Wide& b) {
    return part_by_part<Wide>([&](int n) { return a.part[n] - b.part[n]; });
  }
  friend Wide operator*(const Wide& a, const Wide& b) {
    return part_by_part<Wide>([&](int n) { return a.part[n] * b.part[n]; });
  }
  friend Wide operator/(const Wide& a, const Wide& b) {
    return part_by_part<Wide>([&](int n) { return a.part[n] / b.part[n]; });
  }
  friend Wide operator+(double a, const Wide& b) { return all(a) + b; }
  friend Wide operator+(const Wide& a, double b) { return a + all(b); }
  friend Wide operator-(const Wide& a, double b) { return a - all(b); }
  friend Wide operator*(double a, const Wide& b) { return all(a) * b; }
  friend Wide operator*(const Wide& a, double b) { return a * all(b); }
  /// The same number throughout.
  static Wide all(double value) {
    return part_by_part<Wide>(
        [&](int) { return typename Register<Real>::Type{} + static_cast<Real>(value); });
  }
  Wide operator-() const {
    return part_by_part<Wide>([&](int n) { return -part[n]; });
  }
  Wide& operator+=(const Wide& a) { return *this = *this + a; }
  friend Mask<Real> operator<(const Wide& a, const Wide& b) {
    return part_by_part<Mask<Real>>([&](int n) { return less(a.part[n], b.part[n]); });
  }
  friend Mask<Real> operator>(const Wide& a, const Wide& b) { return b < a; }
};

template <class Real>
inline Wide<Real> wide(double value) {
  return Wide<Real>::all(value);
}

template <class Real>
inline Wide<Real> select(const Mask<Real>& mask, const Wide<Real>& yes, const Wide<Real>& no) {
  return part_by_part<Wide<Real>>(
      [&](int n) { return choose(mask.part[n], yes.part[n], no.part[n]); });
}
template <class Real>
inline Wide<Real> larger(const Wide<Real>& a, const Wide<Real>& b) {
  return select(a > b, a, b);
}
template <class Real>
inline Wide<Real> smaller(const Wide<Real>& a, const Wide<Real>& b) {
  return select(a < b, a, b);
}
template <class Real>
inline Wide<Real> absolute(const Wide<Real>& a) {
  typedef Register<Real> Parts;
  return part_by_part<Wide<Real>>([&](int n) {
    return (typename Parts::Type)((typename Parts::Bits)a.part[n] & Parts::kMagnitude);
  });
}
template <class Real>
inline Wide<Real> root(const Wide<Real>& a) {
  return part_by_part<Wide<Real>>([&](int n) { return root(a.part[n]); });
}

/// A batch's numbers.
inline void take(const double* numbers, Wide<double>& wide) {
  for (int n = 0; n < kParts<double>; ++n)
    wide.part[n] = reinterpret_cast<const Doubles*>(numbers)[n];
}
inline void take(const float* numbers, Wide<double>& wide) {
  for (int n = 0; n < kParts<double>; ++n)
    wide.part[n] = in_double(numbers + n * (kBytes / sizeof(double)));
}
inline void take(const float* numbers, Wide<float>& wide) {
  for (int n = 0; n < kParts<float>; ++n)
    wide.part[n] = reinterpret_cast<const Floats*>(numbers)[n];
}
inline void take(const double* numbers, Wide<float>& wide) {
  const auto* parts = reinterpret_cast<const Doubles*>(numbers);
  for (int n = 0; n < kParts<float>; ++n) wide.part[n] = in_single(parts[2 * n], parts[2 * n + 1]);
}
inline void put(const Wide<double>& wide, double* numbers) {
  for (int n = 0; n < kParts<double>; ++n) reinterpret_cast<Doubles*>(numbers)[n] = wide.part[n];
}
/// What they have become.
inline Wide<double> put_in_single(const Wide<double>& wide, float* numbers) {
  return part_by_part<Wide<double>>([&](int n) {
    return put_in_single(wide.part[n], numbers + n * static_cast<int>(kBytes / sizeof(double)));
  });
}
inline Wide<float> put_in_single(const Wide<float>& wide, float* numbers) {
  for (int n = 0; n < kParts<float>; ++n) reinterpret_cast<Floats*>(numbers)[n] = wide.part[n];
  return wide;
}

template <class Real, class Number>
inline Wide<Real> load(const Lanes<Number>& lanes) {
  Wide<Real> wide;
  take(lanes.data(), wide);
  return wide;
}
inline double sum(const Wide<double>& a) {
  alignas(64) Lanes<double> lanes;
  put(a, lanes.data());
  double total = 0;
  for (double lane : lanes) total += lane;
  return total;
}

template <class Real>
struct Wide3 {
  Wide<Real> x, y, z;

  friend Wide3 operator+(const Wide3& a, const Wide3& b) {
    return {a.x + b.x, a.y + b.y, a.z + b.z};
  }
  friend Wide3 operator-(const Wide3& a, const Wide3& b) {
    return {a.x - b.x, a.y - b.y, a.z - b.z};
  }
  friend Wide3 operator*(const Wide<Real>& s, const Wide3& a) {
    return {s * a.x, s * a.y, s * a.z};
  }
  Wide3 operator-() const { return {-x, -y, -z}; }
};

template <class Real>
inline Wide<Real> dot(const Wide3<Real>& a, const Wide3<Real>& b) {
  return a.x * b.x + a.y * b.y + a.z * b.z;
}
template <class Real>
inline Wide3<Real> cross(const Wide3<Real>& a, const Wide3<Real>& b) {
  return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}

}  // namespace
}  // namespace vstent::xpbd
