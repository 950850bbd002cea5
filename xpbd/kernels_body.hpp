// Body of the kernels: included by one .cpp per instruction set, with VSTENT_KERNELS naming the
// table it defines. Everything here has internal linkage, so that code for wide registers cannot
// leak into other files.
#include <immintrin.h>

#include "xpbd/kernels.hpp"
#include "xpbd/membrane_law.hpp"

namespace vstent::xpbd {
namespace {

typedef double Wide __attribute__((vector_size(32), may_alias));
typedef long long Mask __attribute__((vector_size(32)));

struct Wide3 {
  Wide x, y, z;
};

inline Wide wide(double value) { return Wide{value, value, value, value}; }
inline Wide load(const Lanes& lanes) { return *reinterpret_cast<const Wide*>(lanes.data()); }
inline void store(Lanes& lanes, Wide value) { *reinterpret_cast<Wide*>(lanes.data()) = value; }
inline Wide select(Mask mask, Wide yes, Wide no) { return mask ? yes : no; }
inline Wide absolute(Wide a) { return (Wide)((Mask)a & 0x7fffffffffffffffLL); }
inline Wide larger(Wide a, Wide b) { return a > b ? a : b; }
inline Wide smaller(Wide a, Wide b) { return a < b ? a : b; }
inline double sum(Wide a) { return (a[0] + a[1]) + (a[2] + a[3]); }

inline Wide root(Wide a) {
#ifdef __AVX2__
  return (Wide)_mm256_sqrt_pd((__m256d)a);
#else
  const __m128d low = _mm_sqrt_pd(_mm_set_pd(a[1], a[0]));
  const __m128d high = _mm_sqrt_pd(_mm_set_pd(a[3], a[2]));
  return Wide{low[0], low[1], high[0], high[1]};
#endif
}

inline Wide3 operator+(const Wide3& a, const Wide3& b) { return {a.x + b.x, a.y + b.y, a.z + b.z}; }
inline Wide3 operator-(const Wide3& a, const Wide3& b) { return {a.x - b.x, a.y - b.y, a.z - b.z}; }
inline Wide3 operator*(Wide s, const Wide3& a) { return {s * a.x, s * a.y, s * a.z}; }
inline Wide dot(const Wide3& a, const Wide3& b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
inline Wide3 cross(const Wide3& a, const Wide3& b) {
  return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}

/// Four particles, transposed.
struct Gathered {
  Wide3 at;
  Wide mobility;
};

inline void transpose(Wide& a, Wide& b, Wide& c, Wide& d) {
  const Wide ab_low = __builtin_shuffle(a, b, Mask{0, 4, 2, 6});
  const Wide ab_high = __builtin_shuffle(a, b, Mask{1, 5, 3, 7});
  const Wide cd_low = __builtin_shuffle(c, d, Mask{0, 4, 2, 6});
  const Wide cd_high = __builtin_shuffle(c, d, Mask{1, 5, 3, 7});
  a = __builtin_shuffle(ab_low, cd_low, Mask{0, 1, 4, 5});
  b = __builtin_shuffle(ab_high, cd_high, Mask{0, 1, 4, 5});
  c = __builtin_shuffle(ab_low, cd_low, Mask{2, 3, 6, 7});
  d = __builtin_shuffle(ab_high, cd_high, Mask{2, 3, 6, 7});
}

inline Gathered gather(const Slot* slots, const Indices& index) {
  const auto row = [&](int lane) {
    return *reinterpret_cast<const Wide*>(slots + index[static_cast<std::size_t>(lane)]);
  };
  Wide a = row(0), b = row(1), c = row(2), d = row(3);
  transpose(a, b, c, d);
  return {{a, b, c}, d};
}

inline void scatter(Slot* slots, const Indices& index, Wide3 at, Wide mobility) {
  transpose(at.x, at.y, at.z, mobility);
  const Wide rows[4] = {at.x, at.y, at.z, mobility};
  for (std::size_t lane = 0; lane < 4; ++lane)
    *reinterpret_cast<Wide*>(slots + index[lane]) = rows[lane];
}

/// 1 for a constraint, 0 for the copies that fill a short batch.
inline Wide presence(const Indices& index) {
  Wide present = wide(1);
  for (std::size_t lane = 1; lane < 4; ++lane)
    if (index[lane] == index[0]) present[static_cast<int>(lane)] = 0;
  return present;
}

/// The angle of (cosine, sine), any common scale, in [-pi, pi]; within 4e-16.
inline Wide angle_of(Wide sine, Wide cosine) {
  const Wide s = absolute(sine), c = absolute(cosine);
  const Wide low = smaller(s, c), high = larger(s, c);
  // tan(x - pi/4) = (tan x - 1) / (tan x + 1) brings the argument below tan(pi/8).
  const Mask steep = low > wide(0.41421356237309503) * high;
  const Wide numerator = select(steep, low - high, low);
  const Wide denominator = select(steep, low + high, high);
  const Wide t = select(denominator > wide(0), numerator / denominator, wide(0));
  // Interpolates atan(sqrt z) / sqrt z at Chebyshev nodes of [0, tan^2(pi/8)] to 3e-17.
  constexpr double kSeries[] = {1.0,
                                -0.3333333333332844,
                                0.1999999999885511,
                                -0.14285714180976467,
                                0.11111106180455946,
                                -0.09090773074808414,
                                0.07689953496306857,
                                -0.06640233930429408,
                                0.0568834922680901,
                                -0.043480522157164615,
                                0.021135373157693232};
  const Wide z = t * t, z2 = z * z, z4 = z2 * z2;
  const auto pair = [&](int k) { return wide(kSeries[k]) + wide(kSeries[k + 1]) * z; };
  const Wide head =
      (pair(2) + pair(4) * z2) + (pair(6) + (pair(8) + wide(kSeries[10]) * z2) * z2) * z4;
  Wide angle = t + t * (z * wide(kSeries[1]) + z2 * head);
  angle = select(steep, angle + wide(0.78539816339744831), angle);
  angle = select(s > c, wide(1.5707963267948966) - angle, angle);
  angle = select(cosine < wide(0), wide(3.1415926535897931) - angle, angle);
  return select(sine < wide(0), -angle, angle);
}

inline Wide wrapped(Wide angle) {
  constexpr double kPi = 3.1415926535897931;
  angle = select(angle > wide(kPi), angle - wide(2 * kPi), angle);
  return select(angle < wide(-kPi), angle + wide(2 * kPi), angle);
}

struct Hinge {
  Wide fold;  // angle minus rest angle
  Wide3 gradient[4];
  Wide squares[4];  // |gradient|^2
};

inline Hinge hinge(const BendingBatch& batch, const Wide3& edge_a, const Wide3& edge_b,
                   const Wide3& wing_a, const Wide3& wing_b) {
  const Wide3 edge = edge_b - edge_a, a = wing_a - edge_a, b = wing_b - edge_a;
  const Wide3 normal_a = cross(edge, a), normal_b = cross(b, edge);
  const Wide squared_a = dot(normal_a, normal_a), squared_b = dot(normal_b, normal_b);
  const Wide squared = dot(edge, edge);
  const Wide length = root(squared);
  // A triangle 1e-12 of its edge high has no angle; the bounds also keep the product below from
  // underflowing.
  const Wide least = wide(1e-24) * squared * squared;
  const Mask sound = (squared_a > least) & (squared_b > least) & (squared > wide(1e-24));
  // One division for the three reciprocals.
  const Wide inverse = select(sound, wide(1) / (squared_a * squared_b * squared), wide(0));
  const Wide inverse_a = inverse * squared_b * squared;
  const Wide inverse_b = inverse * squared_a * squared;
  const Wide inverse_edge = inverse * squared_a * squared_b;
  const Wide along_a = dot(a, edge) * inverse_edge, along_b = dot(b, edge) * inverse_edge;

  Hinge h;
  h.gradient[2] = (-length * inverse_a) * normal_a;
  h.gradient[3] = (-length * inverse_b) * normal_b;
  h.gradient[1] = (-along_a) * h.gradient[2] - along_b * h.gradient[3];
  h.gradient[0] = (along_a - wide(1)) * h.gradient[2] + (along_b - wide(1)) * h.gradient[3];
  for (int k = 0; k < 4; ++k) h.squares[k] = dot(h.gradient[k], h.gradient[k]);
  const Wide angle = angle_of(-length * dot(normal_a, b), dot(normal_a, normal_b));
  h.fold = select(sound, wrapped(angle - load(batch.rest)), wide(0));
  return h;
}

/// For the membrane's law.
struct FourTriangles {
  using Number = Wide;
  static Wide larger(Wide a, Wide b) { return a > b ? a : b; }
  static Wide smaller(Wide a, Wide b) { return a < b ? a : b; }
  static double largest_magnitude(Wide a) {
    const Wide size = absolute(a);
    const double low = size[0] > size[1] ? size[0] : size[1];
    const double high = size[2] > size[3] ? size[2] : size[3];
    return low > high ? low : high;
  }
};

struct Stretch {
  Wide energy;  // N mm
  Wide3 gradient[3];
  Wide squares[3];  // |gradient|^2
};

inline Stretch stretch(const TriangleBatch& batch, const Wide3& corner, const Wide3& first,
                       const Wide3& second) {
  const Wide along = load(batch.along), skew = load(batch.skew), across = load(batch.across);
  const Wide weight = load(batch.weight), one = wide(1);
  const Wide3 edge = first - corner;
  const Wide3 f = along * edge, g = across * (second - corner) - skew * edge;
  const Wide ff = dot(f, f), gg = dot(g, g), fg = dot(f, g);
  const SheetStretch<FourTriangles> law = stretch_of_sheet<FourTriangles>(
      (ff - one) + (gg - one), (ff - one) * (gg - one) - fg * fg, load(batch.bulk));
  Stretch s;
  s.energy = weight * law.energy;
  const Wide scale = weight * law.inverse_square;
  const Wide3 on_f = (scale * (one - law.pressure * gg)) * f + (scale * law.pressure * fg) * g;
  const Wide3 on_g = (scale * (one - law.pressure * ff)) * g + (scale * law.pressure * fg) * f;
  s.gradient[1] = along * on_f - skew * on_g;
  s.gradient[2] = across * on_g;
  s.gradient[0] = wide(-1) * (s.gradient[1] + s.gradient[2]);
  for (int k = 0; k < 3; ++k) s.squares[k] = dot(s.gradient[k], s.gradient[k]);
  return s;
}

/// 1 / C for C = sqrt(2 energy), which makes the energy's gradient that of the constraint; 0 at
/// rest.
inline Wide over_constraint(Wide energy, Wide weight) {
  const Wide doubled = wide(2) * energy;
  const Mask strained = doubled > wide(1e-26) * weight;
  return select(strained, wide(1) / root(select(strained, doubled, wide(1))), wide(0));
}

inline void project(DistanceBatch& batch, Slot* particles) {
  const Gathered a = gather(particles, batch.i), b = gather(particles, batch.j);
  const Wide3 edge = b.at - a.at;
  const Wide length = root(dot(edge, edge));
  const Wide compliance = load(batch.compliance), force = load(batch.force);
  const Wide stretch = length - load(batch.rest);
  const Wide denominator = compliance + a.mobility + b.mobility;
  const Mask sound = length > wide(0);
  const Wide safe = select(sound, length, wide(1));
  // change = -(C + compliance force) / denominator, and change / length, by one division.
  const Wide inverse = wide(1) / (denominator * safe);
  const Wide over_length = select(sound, -(stretch + compliance * force) * inverse, wide(0));
  store(batch.force, force + over_length * safe);
  const Wide3 push = over_length * edge;
  scatter(particles, batch.i, a.at - a.mobility * push, a.mobility);
  scatter(particles, batch.j, b.at + b.mobility * push, b.mobility);
}

inline void project(BendingBatch& batch, Slot* particles) {
  Gathered p[4];
  for (std::size_t k = 0; k < 4; ++k) p[k] = gather(particles, batch.vertex[k]);
  const Hinge h = hinge(batch, p[0].at, p[1].at, p[2].at, p[3].at);
  const Wide compliance = load(batch.compliance), force = load(batch.force);
  const Wide pull = (p[0].mobility * h.squares[0] + p[1].mobility * h.squares[1]) +
                    (p[2].mobility * h.squares[2] + p[3].mobility * h.squares[3]);
  const Wide change =
      select(pull > wide(0), -(h.fold + compliance * force) / (compliance + pull), wide(0));
  store(batch.force, force + change);
  for (std::size_t k = 0; k < 4; ++k)
    scatter(particles, batch.vertex[k], p[k].at + (p[k].mobility * change) * h.gradient[k],
            p[k].mobility);
}

inline void project(TriangleBatch& batch, Slot* particles) {
  Gathered p[3];
  for (std::size_t k = 0; k < 3; ++k) p[k] = gather(particles, batch.vertex[k]);
  const Stretch s = stretch(batch, p[0].at, p[1].at, p[2].at);
  const Wide inverse = over_constraint(s.energy, load(batch.weight)), force = load(batch.force);
  const Wide pull =
      inverse * inverse *
      (p[0].mobility * s.squares[0] + p[1].mobility * s.squares[1] + p[2].mobility * s.squares[2]);
  const Wide change = -(wide(2) * s.energy * inverse + force) / (wide(1) + pull);
  store(batch.force, force + change);
  for (std::size_t k = 0; k < 3; ++k)
    scatter(particles, batch.vertex[k],
            p[k].at + (p[k].mobility * change * inverse) * s.gradient[k], p[k].mobility);
}

template <class Batch>
void project_all(std::span<Batch> batches, Slot* particles, bool backward) {
  if (backward)
    for (std::size_t k = batches.size(); k-- > 0;) project(batches[k], particles);
  else
    for (Batch& batch : batches) project(batch, particles);
}

inline void push(Slot* forces, const Indices& index, const Wide3& force) {
  const Gathered old = gather(forces, index);
  scatter(forces, index, old.at + force, old.mobility);
}

struct WideTally {
  Wide energy = wide(0), squares = wide(0), count = wide(0);

  void add(Wide force, Wide change, Wide scale, Wide present) {
    energy += present * (wide(-0.5) * force * change);
    squares += present * (force * force * scale);
    count += present;
  }
  Tally total() const { return {sum(energy), sum(squares), sum(count)}; }
};

template <bool kElastic>
Tally distance_forces(std::span<const DistanceBatch> batches, const Slot* particles, Slot* forces) {
  WideTally tally;
  for (const DistanceBatch& batch : batches) {
    const Wide3 edge = gather(particles, batch.j).at - gather(particles, batch.i).at;
    const Wide length = root(dot(edge, edge));
    const Wide stretch = length - load(batch.rest);
    const Wide force = kElastic ? -stretch / load(batch.compliance) : load(batch.force);
    if (kElastic) tally.add(force, stretch, wide(1), presence(batch.i));
    const Mask sound = length > wide(0);
    const Wide3 along = select(sound, force / select(sound, length, wide(1)), wide(0)) * edge;
    push(forces, batch.i, wide(-1) * along);
    push(forces, batch.j, along);
  }
  return tally.total();
}

template <bool kElastic>
Tally bending_forces(std::span<const BendingBatch> batches, const Slot* particles, Slot* forces) {
  WideTally tally;
  for (const BendingBatch& batch : batches) {
    Gathered p[4];
    for (std::size_t k = 0; k < 4; ++k) p[k] = gather(particles, batch.vertex[k]);
    const Hinge h = hinge(batch, p[0].at, p[1].at, p[2].at, p[3].at);
    const Wide force = kElastic ? -h.fold / load(batch.compliance) : load(batch.force);
    if (kElastic) tally.add(force, h.fold, h.squares[2], presence(batch.vertex[0]));
    for (std::size_t k = 0; k < 4; ++k) push(forces, batch.vertex[k], force * h.gradient[k]);
  }
  return tally.total();
}

template <bool kElastic>
Tally triangle_forces(std::span<const TriangleBatch> batches, const Slot* particles, Slot* forces) {
  WideTally tally;
  for (const TriangleBatch& batch : batches) {
    Gathered p[3];
    for (std::size_t k = 0; k < 3; ++k) p[k] = gather(particles, batch.vertex[k]);
    const Stretch s = stretch(batch, p[0].at, p[1].at, p[2].at);
    const Wide force =
        kElastic ? wide(-1) : load(batch.force) * over_constraint(s.energy, load(batch.weight));
    if (kElastic) tally.add(wide(-1), wide(2) * s.energy, s.squares[2], presence(batch.vertex[0]));
    for (std::size_t k = 0; k < 3; ++k) push(forces, batch.vertex[k], force * s.gradient[k]);
  }
  return tally.total();
}

constexpr Kernels kTable{project_all<DistanceBatch>,
                         project_all<BendingBatch>,
                         project_all<TriangleBatch>,
                         [](std::span<const DistanceBatch> batches, const Slot* particles,
                            Slot* forces) { distance_forces<false>(batches, particles, forces); },
                         [](std::span<const BendingBatch> batches, const Slot* particles,
                            Slot* forces) { bending_forces<false>(batches, particles, forces); },
                         [](std::span<const TriangleBatch> batches, const Slot* particles,
                            Slot* forces) { triangle_forces<false>(batches, particles, forces); },
                         distance_forces<true>,
                         bending_forces<true>,
                         triangle_forces<true>};

}  // namespace
}  // namespace vstent::xpbd
