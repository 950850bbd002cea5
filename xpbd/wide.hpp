// Eight doubles or sixteen floats at once, for the files that are compiled once per instruction
// set; all give the same bits. Everything here has internal linkage, so that code for wide
// registers cannot leak into other files.
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
constexpr int kParts = 64 / kBytes;

template <class Real>
struct Register;

/// `Type` holds kLanesOf<Real> / kParts numbers.
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

/// {make(0), make(1), ...}.
template <class Whole, class Make>
inline Whole part_by_part(const Make& make) {
  if constexpr (kParts == 4) {
    return {{make(0), make(1), make(2), make(3)}};
  } else if constexpr (kParts == 2) {
    return {{make(0), make(1)}};
  } else {
    return {{make(0)}};
  }
}

template <class Real>
struct Mask {
  decltype(less(typename Register<Real>::Type{}, typename Register<Real>::Type{})) part[kParts];

  friend Mask operator&(const Mask& a, const Mask& b) {
    Mask both = a;
    for (int n = 0; n < kParts; ++n) both.part[n] &= b.part[n];
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
  typename Register<Real>::Type part[kParts];

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

template <class Real, std::size_t kCount>
inline Wide<Real> load(const std::array<Real, kCount>& lanes) {
  static_assert(kCount == kLanesOf<Real>);
  const auto* parts = reinterpret_cast<const typename Register<Real>::Type*>(lanes.data());
  return part_by_part<Wide<Real>>([&](int n) { return parts[n]; });
}
template <class Real, std::size_t kCount>
inline void store(std::array<Real, kCount>& lanes, const Wide<Real>& value) {
  auto* parts = reinterpret_cast<typename Register<Real>::Type*>(lanes.data());
  for (int n = 0; n < kParts; ++n) parts[n] = value.part[n];
}
inline double sum(const Wide<double>& a) {
  alignas(64) Lanes lanes;
  store(lanes, a);
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
