// Body of the kernels: included by one .cpp per instruction set. Everything here has internal
// linkage, so that code for wide registers cannot leak into other files.
#include "xpbd/gathered.hpp"
#include "xpbd/kernels.hpp"
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
struct Hinge {
  Wide<Real> fold;  // angle minus rest angle
  Wide3<Real> gradient[4];
  Wide<Real> squares[4];  // |gradient|^2
};

template <class Real>
[[gnu::always_inline]] inline Hinge<Real> hinge(const BendingBatchOf<Real>& batch,
                                                const Gathered<Real> (&particles)[4]) {
  const Wide<Real> zero = wide<Real>(0), one = wide<Real>(1);
  const Wide3<Real>& origin = particles[0].at;
  const Wide3<Real> edge = particles[1].at - origin, a = particles[2].at - origin,
                    b = particles[3].at - origin;
  const Wide3<Real> normal_a = cross(edge, a), normal_b = cross(b, edge);
  const Wide<Real> squared_a = dot(normal_a, normal_a), squared_b = dot(normal_b, normal_b);
  const Wide<Real> squared = dot(edge, edge);
  const Wide<Real> length = root(squared);
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
  h.fold = select(sound, wrapped(angle - load(batch.rest)), zero);
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
  const Number along = load(batch.along), skew = load(batch.skew), across = load(batch.across);
  const Number weight = load(batch.weight), one = wide<double>(1);
  const Vector& corner = particles[0].at;
  const Vector edge = particles[1].at - corner;
  const Vector f = along * edge, g = across * (particles[2].at - corner) - skew * edge;
  const Number ff = dot(f, f), gg = dot(g, g), fg = dot(f, g);
  const SheetStretch<SeveralTriangles> law = stretch_of_sheet<SeveralTriangles>(
      (ff - one) + (gg - one), (ff - one) * (gg - one) - fg * fg, load(batch.bulk));
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

template <class Real, class Batch, std::size_t kCount>
[[gnu::always_inline]] inline void gather(const SlotOf<Real>* slots, const Batch& batch,
                                          Gathered<Real> (&particles)[kCount]) {
#pragma GCC unroll 4
  for (std::size_t k = 0; k < kCount; ++k) gather(slots, batch.vertex[k], particles[k]);
}

template <class Real>
[[gnu::always_inline]] inline void project(DistanceBatchOf<Real>& batch, SlotOf<Real>* particles) {
  Gathered<Real> a, b;
  gather(particles, batch.vertex[0], a);
  gather(particles, batch.vertex[1], b);
  const Wide3<Real> edge = b.at - a.at;
  const Wide<Real> length = root(dot(edge, edge));
  const Wide<Real> compliance = load(batch.compliance), force = load(batch.force);
  const Wide<Real> stretch = length - load(batch.rest);
  const Wide<Real> denominator = compliance + a.mobility + b.mobility;
  const Mask<Real> sound = length > wide<Real>(0);
  const Wide<Real> safe = select(sound, length, wide<Real>(1));
  // change = -(C + compliance force) / denominator, and change / length, by one division.
  const Wide<Real> inverse = wide<Real>(1) / (denominator * safe);
  const Wide<Real> over_length =
      select(sound, -(stretch + compliance * force) * inverse, wide<Real>(0));
  store(batch.force, force + over_length * safe);
  const Wide3<Real> push = over_length * edge;
  scatter(particles, a, a.at - a.mobility * push);
  scatter(particles, b, b.at + b.mobility * push);
}

template <class Real>
[[gnu::always_inline]] inline void project(BendingBatchOf<Real>& batch, SlotOf<Real>* slots) {
  Gathered<Real> p[4];
  gather(slots, batch, p);
  const Hinge<Real> h = hinge(batch, p);
  const Wide<Real> compliance = load(batch.compliance), force = load(batch.force);
  const Wide<Real> pull = (p[0].mobility * h.squares[0] + p[1].mobility * h.squares[1]) +
                          (p[2].mobility * h.squares[2] + p[3].mobility * h.squares[3]);
  const Wide<Real> change = select(
      pull > wide<Real>(0), -(h.fold + compliance * force) / (compliance + pull), wide<Real>(0));
  store(batch.force, force + change);
#pragma GCC unroll 4
  for (std::size_t k = 0; k < 4; ++k)
    scatter(slots, p[k], p[k].at + (p[k].mobility * change) * h.gradient[k]);
}

inline void project(TriangleBatch& batch, Slot* slots) {
  Gathered<double> p[3];
  gather(slots, batch, p);
  const Stretch s = stretch(batch, p);
  const Wide<double> inverse = over_constraint(s.energy, load(batch.weight));
  const Wide<double> force = load(batch.force);
  const Wide<double> pull =
      inverse * inverse *
      (p[0].mobility * s.squares[0] + p[1].mobility * s.squares[1] + p[2].mobility * s.squares[2]);
  const Wide<double> change = -(2.0 * s.energy * inverse + force) / (1.0 + pull);
  store(batch.force, force + change);
  for (std::size_t k = 0; k < 3; ++k)
    scatter(slots, p[k], p[k].at + (p[k].mobility * change * inverse) * s.gradient[k]);
}

template <class Batch, class Real>
void project_all(std::span<Batch> batches, SlotOf<Real>* particles, bool backward) {
  if (backward)
    for (std::size_t k = batches.size(); k-- > 0;) project(batches[k], particles);
  else
    for (Batch& batch : batches) project(batch, particles);
}

template <class Real, std::size_t kCount>
[[gnu::always_inline]] inline void push(SlotOf<Real>* forces, const std::array<int, kCount>& index,
                                        const Wide3<Real>& force) {
  Gathered<Real> old;
  gather(forces, index, old);
  scatter(forces, old, old.at + force);
}

/// 1 for a constraint, 0 for the copies that fill a short batch.
inline Wide<double> presence(const Indices& index) {
  if (index[kLanes - 1] != index[0]) return wide<double>(1);
  alignas(64) Lanes present;
  for (std::size_t lane = 0; lane < kLanes; ++lane)
    present[lane] = lane > 0 && index[lane] == index[0] ? 0 : 1;
  return load(present);
}

struct WideTally {
  Wide<double> energy = wide<double>(0), squares = wide<double>(0), count = wide<double>(0);

  void add(const Wide<double>& force, const Wide<double>& change, const Wide<double>& scale,
           const Indices& index) {
    const Wide<double> present = presence(index);
    energy += present * (wide<double>(-0.5) * force * change);
    squares += present * (force * force * scale);
    count += present;
  }
  Tally total() const { return {sum(energy), sum(squares), sum(count)}; }
};

template <class Real>
inline Wide3<Real> edge_of(const DistanceBatchOf<Real>& batch, const SlotOf<Real>* particles) {
  Gathered<Real> a, b;
  gather(particles, batch.vertex[0], a);
  gather(particles, batch.vertex[1], b);
  return b.at - a.at;
}

/// force / length along the edge, none where it has no length.
template <class Real>
inline void push_apart(const DistanceBatchOf<Real>& batch, const Wide3<Real>& edge,
                       const Wide<Real>& length, const Wide<Real>& force, SlotOf<Real>* forces) {
  const Wide<Real> zero = wide<Real>(0);
  const Mask<Real> sound = length > zero;
  const Wide3<Real> along =
      select(sound, force / select(sound, length, wide<Real>(1)), zero) * edge;
  push(forces, batch.vertex[0], wide<Real>(-1) * along);
  push(forces, batch.vertex[1], along);
}

template <class Real>
void kept_distance_forces(std::span<const DistanceBatchOf<Real>> batches,
                          const SlotOf<Real>* particles, SlotOf<Real>* forces) {
  for (const DistanceBatchOf<Real>& batch : batches) {
    const Wide3<Real> edge = edge_of(batch, particles);
    push_apart(batch, edge, root(dot(edge, edge)), load(batch.force), forces);
  }
}

template <class Real>
void kept_bending_forces(std::span<const BendingBatchOf<Real>> batches,
                         const SlotOf<Real>* particles, SlotOf<Real>* forces) {
  for (const BendingBatchOf<Real>& batch : batches) {
    Gathered<Real> p[4];
    gather(particles, batch, p);
    const Hinge<Real> h = hinge(batch, p);
    for (std::size_t k = 0; k < 4; ++k)
      push(forces, batch.vertex[k], load(batch.force) * h.gradient[k]);
  }
}

Tally elastic_distance_forces(std::span<const DistanceBatch> batches, const Slot* particles,
                              Slot* forces) {
  WideTally tally;
  for (const DistanceBatch& batch : batches) {
    const Wide3<double> edge = edge_of(batch, particles);
    const Wide<double> length = root(dot(edge, edge));
    const Wide<double> stretch = length - load(batch.rest);
    const Wide<double> force = -stretch / load(batch.compliance);
    tally.add(force, stretch, wide<double>(1), batch.vertex[0]);
    push_apart(batch, edge, length, force, forces);
  }
  return tally.total();
}

Tally elastic_bending_forces(std::span<const BendingBatch> batches, const Slot* particles,
                             Slot* forces) {
  WideTally tally;
  for (const BendingBatch& batch : batches) {
    Gathered<double> p[4];
    gather(particles, batch, p);
    const Hinge<double> h = hinge(batch, p);
    const Wide<double> force = -h.fold / load(batch.compliance);
    tally.add(force, h.fold, h.squares[2], batch.vertex[0]);
    for (std::size_t k = 0; k < 4; ++k) push(forces, batch.vertex[k], force * h.gradient[k]);
  }
  return tally.total();
}

template <bool kElastic>
Tally triangle_forces(std::span<const TriangleBatch> batches, const Slot* particles, Slot* forces) {
  WideTally tally;
  for (const TriangleBatch& batch : batches) {
    Gathered<double> p[3];
    gather(particles, batch, p);
    const Stretch s = stretch(batch, p);
    const Wide<double> minus = wide<double>(-1);
    const Wide<double> force =
        kElastic ? minus : load(batch.force) * over_constraint(s.energy, load(batch.weight));
    if (kElastic) tally.add(minus, 2.0 * s.energy, s.squares[2], batch.vertex[0]);
    for (std::size_t k = 0; k < 3; ++k) push(forces, batch.vertex[k], force * s.gradient[k]);
  }
  return tally.total();
}

void kept_triangle_forces(std::span<const TriangleBatch> batches, const Slot* particles,
                          Slot* forces) {
  triangle_forces<false>(batches, particles, forces);
}

template <class Real>
constexpr StepKernels<Real> kStepKernels{project_all<DistanceBatchOf<Real>, Real>,
                                         project_all<BendingBatchOf<Real>, Real>,
                                         kept_distance_forces<Real>, kept_bending_forces<Real>};

constexpr Kernels kTable{
    kStepKernels<double>, kStepKernels<float>,     project_all<TriangleBatch, double>,
    kept_triangle_forces, elastic_distance_forces, elastic_bending_forces,
    triangle_forces<true>};

}  // namespace
}  // namespace vstent::xpbd
