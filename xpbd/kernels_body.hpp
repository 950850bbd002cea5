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

template <class Real, std::size_t kCount>
[[gnu::always_inline]] inline void gather(const SlotOf<Real>* slots,
                                          const std::array<Lanes<int>, kCount>& vertex,
                                          Gathered<Real> (&particles)[kCount]) {
#pragma GCC unroll 4
  for (std::size_t k = 0; k < kCount; ++k) gather(slots, vertex[k], particles[k]);
}

template <class Real, std::size_t kCount>
[[gnu::always_inline]] inline void scatter(SlotOf<Real>* slots,
                                           const Gathered<Real> (&particles)[kCount]) {
#pragma GCC unroll 4
  for (std::size_t k = 0; k < kCount; ++k) scatter(slots, particles[k]);
}

/// Adds `change` to the kept forces; what they have then changed by.
template <class Real>
[[gnu::always_inline]] inline Wide<Real> change_kept(Lanes<float>& forces, const Wide<Real>& force,
                                                     const Wide<Real>& change) {
  return put_in_single(force + change, forces.data()) - force;
}

/// The change of the force between the ends, on the second.
template <class Real>
[[gnu::always_inline]] inline Wide3<Real> project_length(Springs& springs, const Edge<Real>& edge,
                                                         const Wide<Real>& mobility) {
  const Wide<Real> compliance = load<Real>(springs.compliance);
  const Wide<Real> force = load<Real>(springs.force);
  const Wide<Real> stretch = edge.length - load<Real>(springs.rest);
  const Wide<Real> denominator = compliance + mobility;
  const Mask<Real> sound = edge.length > wide<Real>(0);
  const Wide<Real> safe = select(sound, edge.length, wide<Real>(1));
  const Wide<Real> inverse = wide<Real>(1) / (denominator * safe);  // one division for both
  const Wide<Real> change =
      change_kept(springs.force, force,
                  select(sound, -(stretch + compliance * force) * (inverse * safe), wide<Real>(0)));
  return (change * (inverse * denominator)) * edge.vector;
}

/// The change of the moment.
template <class Real>
[[gnu::always_inline]] inline Wide<Real> project_fold(Springs& springs, const Hinge<Real>& h,
                                                      const Gathered<Real> (&p)[4]) {
  const Wide<Real> compliance = load<Real>(springs.compliance);
  const Wide<Real> force = load<Real>(springs.force);
  const Wide<Real> pull = (p[0].mobility * h.squares[0] + p[1].mobility * h.squares[1]) +
                          (p[2].mobility * h.squares[2] + p[3].mobility * h.squares[3]);
  return change_kept(springs.force, force,
                     select(pull > wide<Real>(0),
                            -(h.fold + compliance * force) / (compliance + pull), wide<Real>(0)));
}

template <class Real>
[[gnu::always_inline]] inline void move(Gathered<Real>& particle, const Wide3<Real>& force) {
  particle.at = particle.at + particle.mobility * force;
}

template <class Real>
[[gnu::always_inline]] inline void project(DistanceBatch& batch, SlotOf<Real>* slots) {
  Gathered<Real> p[2];
  gather(slots, batch.vertex, p);
  const Wide3<Real> push =
      project_length(batch.length, edge_between(p[0], p[1]), p[0].mobility + p[1].mobility);
  move(p[0], -push);
  move(p[1], push);
  scatter(slots, p);
}

template <class Real>
[[gnu::always_inline]] inline void project(BendingBatch& batch, SlotOf<Real>* slots) {
  Gathered<Real> p[4];
  gather(slots, batch.vertex, p);
  const Hinge<Real> h = hinge(batch.fold, edge_between(p[0], p[1]), p);
  const Wide<Real> moment = project_fold(batch.fold, h, p);
  for (std::size_t k = 0; k < 4; ++k) move(p[k], moment * h.gradient[k]);
  scatter(slots, p);
}

/// Both at once: a hinge's gradients are normal to its triangles, and so to the edge, that neither
/// changes what the other asks for.
template <class Real>
[[gnu::always_inline]] inline void project(HingedEdgeBatch& batch, SlotOf<Real>* slots) {
  Gathered<Real> p[4];
  gather(slots, batch.vertex, p);
  const Edge<Real> edge = edge_between(p[0], p[1]);
  const Wide3<Real> push = project_length(batch.length, edge, p[0].mobility + p[1].mobility);
  const Hinge<Real> h = hinge(batch.fold, edge, p);
  const Wide<Real> moment = project_fold(batch.fold, h, p);
  move(p[0], moment * h.gradient[0] - push);
  move(p[1], moment * h.gradient[1] + push);
  move(p[2], moment * h.gradient[2]);
  move(p[3], moment * h.gradient[3]);
  scatter(slots, p);
}

inline void project(TriangleBatch& batch, Slot* slots) {
  Gathered<double> p[3];
  gather(slots, batch.vertex, p);
  const Stretch s = stretch(batch, p);
  const Wide<double> inverse = over_constraint(s.energy, load<double>(batch.weight));
  const Wide<double> force = load<double>(batch.force);
  const Wide<double> pull =
      inverse * inverse *
      (p[0].mobility * s.squares[0] + p[1].mobility * s.squares[1] + p[2].mobility * s.squares[2]);
  const Wide<double> change = -(2.0 * s.energy * inverse + force) / (1.0 + pull);
  put(force + change, batch.force.data());
  for (std::size_t k = 0; k < 3; ++k)
    p[k].at = p[k].at + (p[k].mobility * change * inverse) * s.gradient[k];
  scatter(slots, p);
}

template <class Batch, class Real>
void project_all(std::span<Batch> batches, SlotOf<Real>* slots, bool backward) {
  if (backward)
    for (std::size_t n = batches.size(); n-- > 0;) project(batches[n], slots);
  else
    for (Batch& batch : batches) project(batch, slots);
}

template <class Real>
void project_batches(const Batches& batches, SlotOf<Real>* slots, bool backward) {
  const auto project_triangles = [&] {
    if constexpr (std::is_same_v<Real, double>) project_all(batches.triangles, slots, backward);
  };
  if (!backward) {
    project_all(batches.distances, slots, backward);
    project_all(batches.hinged_edges, slots, backward);
    project_triangles();
    project_all(batches.bendings, slots, backward);
  } else {
    project_all(batches.bendings, slots, backward);
    project_triangles();
    project_all(batches.hinged_edges, slots, backward);
    project_all(batches.distances, slots, backward);
  }
}

template <class Real>
[[gnu::always_inline]] inline void push(SlotOf<Real>* forces, const Lanes<int>& vertex,
                                        const Wide3<Real>& force) {
  Gathered<Real> sums;
  gather(forces, vertex, sums);
  sums.at = sums.at + force;
  scatter(forces, sums);
}

/// 1 for a constraint, 0 for the copies that fill a short batch.
template <class Batch>
inline Wide<double> presence(const Batch& batch) {
  if (!is_copy(batch, kLanes - 1)) return wide<double>(1);
  alignas(64) Lanes<double> present;
  for (std::size_t lane = 0; lane < kLanes; ++lane) present[lane] = is_copy(batch, lane) ? 0 : 1;
  return load<double>(present);
}

struct WideTally {
  Wide<double> energy = wide<double>(0), squares = wide<double>(0), count = wide<double>(0);

  void add(const Wide<double>& force, const Wide<double>& change, const Wide<double>& scale,
           const Wide<double>& present) {
    energy += present * (wide<double>(-0.5) * force * change);
    squares += present * (force * force * scale);
    count += present;
  }
  Tally total() const { return {sum(energy), sum(squares), sum(count)}; }
};

/// Forces along the present gradients: those that were kept, or elastic ones, which are counted.
template <class Real>
struct KeptForces {
  template <class Batch>
  Wide<Real> of(const Batch&, const Springs& springs, const Wide<Real>&, const Wide<Real>&) {
    return load<Real>(springs.force);
  }
};

struct ElasticForces {
  WideTally tally;

  template <class Batch>
  Wide<double> of(const Batch& batch, const Springs& springs, const Wide<double>& change,
                  const Wide<double>& scale) {
    const Wide<double> force = -change / load<double>(springs.compliance);
    tally.add(force, change, scale, presence(batch));
    return force;
  }
};

/// The force on the edge's second end; none where it has no length.
template <class Real, class Batch, class Forces>
[[gnu::always_inline]] inline Wide3<Real> length_force(const Batch& batch, const Edge<Real>& edge,
                                                       Forces& forces) {
  const Wide<Real> stretch = edge.length - load<Real>(batch.length.rest);
  const Wide<Real> force = forces.of(batch, batch.length, stretch, wide<Real>(1));
  const Mask<Real> sound = edge.length > wide<Real>(0);
  return select(sound, force / select(sound, edge.length, wide<Real>(1)), wide<Real>(0)) *
         edge.vector;
}

template <class Real, class Forces>
[[gnu::always_inline]] inline void add_forces(const DistanceBatch& batch, const SlotOf<Real>* slots,
                                              SlotOf<Real>* to, Forces& forces) {
  Gathered<Real> p[2];
  gather(slots, batch.vertex, p);
  const Wide3<Real> push_apart = length_force(batch, edge_between(p[0], p[1]), forces);
  push(to, batch.vertex[0], -push_apart);
  push(to, batch.vertex[1], push_apart);
}

template <class Real, class Forces>
[[gnu::always_inline]] inline void add_forces(const BendingBatch& batch, const SlotOf<Real>* slots,
                                              SlotOf<Real>* to, Forces& forces) {
  Gathered<Real> p[4];
  gather(slots, batch.vertex, p);
  const Hinge<Real> h = hinge(batch.fold, edge_between(p[0], p[1]), p);
  const Wide<Real> moment = forces.of(batch, batch.fold, h.fold, h.squares[2]);
  for (std::size_t k = 0; k < 4; ++k) push(to, batch.vertex[k], moment * h.gradient[k]);
}

template <class Real, class Forces>
[[gnu::always_inline]] inline void add_forces(const HingedEdgeBatch& batch,
                                              const SlotOf<Real>* slots, SlotOf<Real>* to,
                                              Forces& forces) {
  Gathered<Real> p[4];
  gather(slots, batch.vertex, p);
  const Edge<Real> edge = edge_between(p[0], p[1]);
  const Wide3<Real> push_apart = length_force(batch, edge, forces);
  const Hinge<Real> h = hinge(batch.fold, edge, p);
  const Wide<Real> moment = forces.of(batch, batch.fold, h.fold, h.squares[2]);
  push(to, batch.vertex[0], moment * h.gradient[0] - push_apart);
  push(to, batch.vertex[1], moment * h.gradient[1] + push_apart);
  push(to, batch.vertex[2], moment * h.gradient[2]);
  push(to, batch.vertex[3], moment * h.gradient[3]);
}

inline Wide<double> force_of(const TriangleBatch& batch, const Stretch& s, KeptForces<double>&) {
  return load<double>(batch.force) * over_constraint(s.energy, load<double>(batch.weight));
}

inline Wide<double> force_of(const TriangleBatch& batch, const Stretch& s, ElasticForces& forces) {
  const Wide<double> minus = wide<double>(-1);
  forces.tally.add(minus, 2.0 * s.energy, s.squares[2], presence(batch));
  return minus;
}

template <class Forces>
inline void add_forces(const TriangleBatch& batch, const Slot* slots, Slot* to, Forces& forces) {
  Gathered<double> p[3];
  gather(slots, batch.vertex, p);
  const Stretch s = stretch(batch, p);
  const Wide<double> force = force_of(batch, s, forces);
  for (std::size_t k = 0; k < 3; ++k) push(to, batch.vertex[k], force * s.gradient[k]);
}

template <class Real, class Forces>
void add_all_forces(const ConstBatches& batches, const SlotOf<Real>* slots, SlotOf<Real>* to,
                    Forces& forces) {
  const auto add = [&](const auto& of_a_kind) {
    for (const auto& batch : of_a_kind) add_forces(batch, slots, to, forces);
  };
  add(batches.distances);
  add(batches.hinged_edges);
  if constexpr (std::is_same_v<Real, double>) add(batches.triangles);
  add(batches.bendings);
}

template <class Real>
void add_kept_forces(const ConstBatches& batches, const SlotOf<Real>* slots, SlotOf<Real>* to) {
  KeptForces<Real> forces;
  add_all_forces(batches, slots, to, forces);
}

Tally add_elastic_forces(const ConstBatches& batches, const Slot* slots, Slot* to) {
  ElasticForces forces;
  add_all_forces(batches, slots, to, forces);
  return forces.tally.total();
}

template <class Real>
constexpr StepKernels<Real> kStepKernels{project_batches<Real>, add_kept_forces<Real>};

constexpr Kernels kTable{kStepKernels<double>, kStepKernels<float>, add_elastic_forces};

}  // namespace
}  // namespace vstent::xpbd
