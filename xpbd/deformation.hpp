// How far edges, hinges and triangles are from rest, and by which gradients, a batch at a time.
// Everything here has internal linkage.
#pragma once

#include "xpbd/gathered.hpp"
#include "xpbd/membrane_law.hpp"

namespace vstent::xpbd {
namespace {

/// atan(t) / t - 1 for z = t^2 up to tan^2(pi/8), interpolated at Chebyshev nodes to 3e-17.
inline Wide<double> arcus_series(const Wide<double>& z) {
  constexpr double kSeries[] = {-0.3333333333332844,  0.1999999999885511,   -0.14285714180976467,
                                0.11111106180455946,  -0.09090773074808414, 0.07689953496306857,
                                -0.06640233930429408, 0.0568834922680901,   -0.043480522157164615,
                                0.021135373157693232};
  const Wide<double> z2 = z * z, z4 = z2 * z2;
  const auto at = [&](int k) { return wide<double>(kSeries[k]); };
  const auto pair = [&](int k) { return at(k) + at(k + 1) * z; };
  const Wide<double> head = (pair(1) + pair(3) * z2) + (pair(5) + (pair(7) + at(9) * z2) * z2) * z4;
  return z * at(0) + z2 * head;
}

/// The same to 3e-9.
inline Wide<float> arcus_series(const Wide<float>& z) {
  constexpr double kSeries[] = {-0.3333333176116853, 0.19999540483650002, -0.14263955598007544,
                                0.10743731490981157, -0.06451928208657524};
  const Wide<float> z2 = z * z;
  const auto at = [&](int k) { return wide<float>(kSeries[k]); };
  return z * ((at(0) + at(1) * z) + (at(2) + at(3) * z + at(4) * z2) * z2);
}

/// The angle of (cosine, sine), any common scale, in [-pi, pi]; within 4e-16, in single precision
/// 3e-7.
template <class Real>
inline Wide<Real> angle_of(const Wide<Real>& sine, const Wide<Real>& cosine) {
  const Wide<Real> zero = wide<Real>(0), tangent = wide<Real>(0.41421356237309503);
  const auto up_to_pi_over_8 = [](const Wide<Real>& numerator, const Wide<Real>& denominator) {
    const Wide<Real> t = numerator / denominator;
    return t + t * arcus_series(t * t);
  };
  const Wide<Real> s = absolute(sine), c = absolute(cosine);
  if (all(s < tangent * cosine)) return up_to_pi_over_8(sine, cosine);  // as most walls bend
  const Wide<Real> low = smaller(s, c), high = larger(s, c);
  // tan(x - pi/4) = (tan x - 1) / (tan x + 1) brings the argument below tan(pi/8).
  const Mask<Real> steep = low > tangent * high;
  const Wide<Real> denominator = select(steep, low + high, high);
  const Mask<Real> sound = denominator > zero;
  Wide<Real> angle = up_to_pi_over_8(select(sound, select(steep, low - high, low), zero),
                                     select(sound, denominator, wide<Real>(1)));
  angle = select(steep, angle + wide<Real>(0.78539816339744831), angle);
  angle = select(s > c, wide<Real>(1.5707963267948966) - angle, angle);
  angle = select(cosine < zero, wide<Real>(3.1415926535897931) - angle, angle);
  return select(sine < zero, -angle, angle);
}

template <class Real>
inline Wide<Real> wrapped(Wide<Real> angle) {
  constexpr double kPi = 3.1415926535897931;
  if (all(absolute(angle) < wide<Real>(kPi))) return angle;
  angle = select(angle > wide<Real>(kPi), angle - wide<Real>(2 * kPi), angle);
  return select(angle < wide<Real>(-kPi), angle + wide<Real>(2 * kPi), angle);
}

/// A triangle so much lower than its edge, squared, has no angle.
template <class Real>
constexpr double kFlat = 1e-24;
template <>
constexpr double kFlat<float> = 1e-12;
/// Below which a product has lost digits.
template <class Real>
constexpr double kLeastProduct = 1e-300;
template <>
constexpr double kLeastProduct<float> = 1e-36;

template <class Real>
struct Edge {
  Wide3<Real> vector;
  Wide<Real> squared, length;
};

template <class Real>
[[gnu::always_inline]] inline Edge<Real> edge_between(const Gathered<Real>& a,
                                                      const Gathered<Real>& b) {
  const Wide3<Real> vector = b.at - a.at;
  const Wide<Real> squared = dot(vector, vector);
  return {vector, squared, root(squared)};
}

template <class Real>
struct Hinge {
  Wide<Real> fold;  // angle minus rest angle
  Wide3<Real> gradient[4];
  Wide<Real> squares[4];  // |gradient|^2
};

template <class Real>
[[gnu::always_inline]] inline Hinge<Real> hinge(const Springs& springs, const Edge<Real>& along,
                                                const Gathered<Real> (&particles)[4]) {
  const Wide<Real> zero = wide<Real>(0), one = wide<Real>(1);
  const auto& [edge, squared, length] = along;
  const Wide3<Real>& origin = particles[0].at;
  const Wide3<Real> a = particles[2].at - origin, b = particles[3].at - origin;
  const Wide3<Real> normal_a = cross(edge, a), normal_b = cross(b, edge);
  const Wide<Real> squared_a = dot(normal_a, normal_a), squared_b = dot(normal_b, normal_b);
  const Wide<Real> least = wide<Real>(kFlat<Real>) * squared * squared;
  const Wide<Real> product = squared_a * squared_b * squared;
  const Mask<Real> sound =
      (squared_a > least) & (squared_b > least) & (product > wide<Real>(kLeastProduct<Real>));
  // One division for the three reciprocals.
  const Wide<Real> inverse = select(sound, one / product, zero);
  const Wide<Real> inverse_a = inverse * squared_b * squared;
  const Wide<Real> inverse_b = inverse * squared_a * squared;
  const Wide<Real> inverse_edge = inverse * squared_a * squared_b;
  const Wide<Real> along_a = dot(a, edge) * inverse_edge, along_b = dot(b, edge) * inverse_edge;

  Hinge<Real> h;
  h.gradient[2] = (-length * inverse_a) * normal_a;
  h.gradient[3] = (-length * inverse_b) * normal_b;
  h.gradient[1] = (-along_a) * h.gradient[2] - along_b * h.gradient[3];
  h.gradient[0] = (along_a - one) * h.gradient[2] + (along_b - one) * h.gradient[3];
  for (int k = 0; k < 4; ++k) h.squares[k] = dot(h.gradient[k], h.gradient[k]);
  const Wide<Real> angle = angle_of(-length * dot(normal_a, b), dot(normal_a, normal_b));
  h.fold = select(sound, wrapped(angle - load<Real>(springs.rest)), zero);
  return h;
}

/// For the membrane's law.
struct SeveralTriangles {
  using Number = Wide<double>;
  static Number larger(const Number& a, const Number& b) { return select(a > b, a, b); }
  static Number smaller(const Number& a, const Number& b) { return select(a < b, a, b); }
  static bool are_within(const Number& a, double bound) {
    return all(absolute(a) < wide<double>(bound));
  }
};

struct Stretch {
  Wide<double> energy;  // N mm
  Wide3<double> gradient[3];
  Wide<double> squares[3];  // |gradient|^2
};

[[gnu::always_inline]] inline Stretch stretch(const TriangleBatch& batch,
                                              const Gathered<double> (&particles)[3]) {
  typedef Wide<double> Number;
  typedef Wide3<double> Vector;
  const auto number = [&](const Lanes<double>& lanes) { return load<double>(lanes); };
  const Number along = number(batch.along), skew = number(batch.skew);
  const Number across = number(batch.across), weight = number(batch.weight);
  const Number one = wide<double>(1);
  const Vector& corner = particles[0].at;
  const Vector edge = particles[1].at - corner;
  const Vector f = along * edge, g = across * (particles[2].at - corner) - skew * edge;
  const Number ff = dot(f, f), gg = dot(g, g), fg = dot(f, g);
  const SheetStretch<SeveralTriangles> law = stretch_of_sheet<SeveralTriangles>(
      (ff - one) + (gg - one), (ff - one) * (gg - one) - fg * fg, number(batch.bulk));
  Stretch s;
  s.energy = weight * law.energy;
  const Number scale = weight * law.inverse_square;
  const Vector on_f = (scale * (one - law.pressure * gg)) * f + (scale * law.pressure * fg) * g;
  const Vector on_g = (scale * (one - law.pressure * ff)) * g + (scale * law.pressure * fg) * f;
  s.gradient[1] = along * on_f - skew * on_g;
  s.gradient[2] = across * on_g;
  s.gradient[0] = wide<double>(-1) * (s.gradient[1] + s.gradient[2]);
  for (int k = 0; k < 3; ++k) s.squares[k] = dot(s.gradient[k], s.gradient[k]);
  return s;
}

/// 1 / C for C = sqrt(2 energy), which makes the energy's gradient that of the constraint; 0 at
/// rest.
inline Wide<double> over_constraint(const Wide<double>& energy, const Wide<double>& weight) {
  const Wide<double> one = wide<double>(1), doubled = 2.0 * energy;
  const Mask<double> strained = doubled > 1e-26 * weight;
  return select(strained, one / root(select(strained, doubled, one)), wide<double>(0));
}

}  // namespace
}  // namespace vstent::xpbd
