// Body of the leaf kernels: included by one .cpp per instruction set. Everything here has internal
// linkage.
#include <cmath>
#include <limits>

#include "sdf/leaf_kernels.hpp"
#include "sdf/wide.hpp"

namespace vstent::sdf {
namespace {

constexpr Wide kRamp{-3.5f, -2.5f, -1.5f, -0.5f, 0.5f, 1.5f, 2.5f, 3.5f};
constexpr int kParts = kLeafSide * kLeafSide / kRowsAtOnce;

/// Some of a leaf's nodes: the n-th Nodes, n = 8 (i / kRowsAtOnce) + j.
struct Part {
  int n;
  Chosen rows;
};

inline int first_node(int n) {
  return kLeafSide * (kLeafSide * kRowsAtOnce * (n / kLeafSide) + n % kLeafSide);
}
inline Nodes load(const LeafValues& values, int n) {
  return load_rows(values.at.data() + first_node(n));
}
inline void lower(LeafValues& values, Part part, Nodes to) {
  float* first = values.at.data() + first_node(part.n);
  store_rows(lowered(load_rows(first), to, part.rows), first);
}

/// An affine function row by row: the nodes of a row differ in k.
class Sweep {
 public:
  Sweep(const Affine& affine, float middle)
      : along_x_(wide(middle) + wide(affine.x) * kRamp),
        along_y_(wide(affine.y) * kRamp),
        along_z_(repeat(wide(affine.z) * kRamp)) {}
  explicit Sweep(const Affine& affine) : Sweep(affine, affine.middle) {}
  void enter(int i) { plane_ = along_z_ + per_row(along_x_, i); }
  Nodes row(int j) const { return plane_ + nodes(along_y_[j]); }

 private:
  Wide along_x_, along_y_;
  Nodes along_z_, plane_{};
};

/// How far beyond either end.
class Overshoot {
 public:
  Overshoot(const Affine& past_b, float before_a)
      : past_b_(past_b), minus_before_a_(past_b, -before_a) {}
  void enter(int i) { past_b_.enter(i), minus_before_a_.enter(i); }
  Nodes row(int j) const {
    return larger(larger(past_b_.row(j), Nodes{} - minus_before_a_.row(j)), Nodes{});
  }

 private:
  Sweep past_b_, minus_before_a_;
};

template <int kCount, class Visit, class... Sweeps>
inline void for_each_row_of(const LeafRows& rows, Visit&& visit, Sweeps&... sweeps) {
  const int first = rows.first_j < kLeafSide - kCount ? rows.first_j : kLeafSide - kCount;
  for (int i = rows.first_i / kRowsAtOnce * kRowsAtOnce; i < rows.end_i; i += kRowsAtOnce) {
    (sweeps.enter(i), ...);
    const Chosen chosen = choose(i, rows.first_i, rows.end_i);
#pragma GCC unroll 1  // the steps along j stay in memory, whence they are broadcast for free
    for (int j = first; j < first + kCount; ++j)
      visit(Part{kLeafSide * (i / kRowsAtOnce) + j, chosen}, sweeps.row(j)...);
  }
}

/// Visits these rows of a piece whose coordinates are swept along, and perhaps some beside them: a
/// loop of unknown length costs more than it leaves out.
template <class Visit, class... Sweeps>
inline void for_each_row(const LeafRows& rows, Visit&& visit, Sweeps&... sweeps) {
  const int count = rows.end_j - rows.first_j;
  if (count <= 2) return for_each_row_of<2>(rows, visit, sweeps...);
  if (count <= 4) return for_each_row_of<4>(rows, visit, sweeps...);
  if (count <= 6) return for_each_row_of<6>(rows, visit, sweeps...);
  for_each_row_of<kLeafSide>(rows, visit, sweeps...);
}

/// The least measure over the capsules.
template <class Measure>
inline void find_least(std::span<const LeafCapsule> capsules, const Measure& measure,
                       Nodes (&least)[kParts]) {
  for (Nodes& n : least) n = nodes(std::numeric_limits<float>::infinity());
  for (const LeafCapsule& capsule : capsules) {
    Sweep across(capsule.across), aside(capsule.aside);
    Overshoot over(capsule.past_b, capsule.before_a);
    for_each_row(
        capsule.reached,
        [&](Part part, Nodes a, Nodes b, Nodes c) {
          least[part.n] = lowered(least[part.n], measure(a, b, c), part.rows);
        },
        across, aside, over);
  }
}

/// Lowers values to result_of(the least measure over the capsules), which grows with it.
template <class Measure, class ResultOf>
inline void lower_to_capsules(std::span<const LeafCapsule> capsules, const Measure& measure,
                              const ResultOf& result_of, LeafValues& values) {
  Nodes least[kParts];
  find_least(capsules, measure, least);
  for (int n = 0; n < kParts; ++n) lower(values, {n, kAllRows}, result_of(least[n]));
}

/// Not a function: a loop would call that through its address, row by row.
constexpr auto squared_norm = [](Nodes a, Nodes b, Nodes c) { return a * a + b * b + c * c; };

void lower_to_thin(std::span<const LeafCapsule> capsules, float radius, LeafValues& values) {
  lower_to_capsules(
      capsules, squared_norm, [&](Nodes least) { return root(least) - nodes(radius); }, values);
}

/// By the square of the distance from an axis less that of the radius, without the cancellation;
/// `across` counts from the radius.
class Thick {
 public:
  explicit Thick(float radius)
      : radius_(nodes(radius)), diameter_(nodes(2 * radius)), square_(nodes(radius * radius)) {}
  Nodes excess(Nodes across, Nodes aside, Nodes over) const {
    return across * (across + diameter_) + aside * aside + over * over;
  }
  Nodes from_axis(Nodes excess) const { return root(larger(excess + square_, Nodes{})); }
  Nodes distance(Nodes excess, Nodes from_axis) const { return excess / (from_axis + radius_); }

 private:
  Nodes radius_, diameter_, square_;
};

void lower_to_thick(std::span<const LeafCapsule> capsules, float radius, LeafValues& values) {
  const Thick thick(radius);
  lower_to_capsules(
      capsules,
      [&](Nodes across, Nodes aside, Nodes over) { return thick.excess(across, aside, over); },
      [&](Nodes least) { return thick.distance(least, thick.from_axis(least)); }, values);
}

/// As for one point: behind the cap's plane; beyond it and beside the capsule, whose foot then lies
/// behind the plane; beyond it before the disc.
void lower_to_cut_capsules(std::span<const LeafCutCapsule> capsules, LeafValues& values) {
  for (const LeafCutCapsule& cut : capsules) {
    const Thick side(cut.radius), disc(cut.cap_radius);
    const Nodes length = nodes(cut.length), slope = nodes(cut.slope),
                from_a = nodes(cut.cap_from_a);
    Sweep across(cut.capsule.across), aside(cut.capsule.aside), past_b(cut.capsule.past_b);
    Overshoot over(cut.capsule.past_b, cut.capsule.before_a);
    Sweep beyond(cut.beyond), disc_across(cut.across), disc_aside(cut.aside);
    for_each_row(
        LeafRows{},
        [&](Part part, Nodes a, Nodes b, Nodes past, Nodes c, Nodes z, Nodes rim, Nodes rim_aside) {
          const Nodes excess = side.excess(a, b, c), from_axis = side.from_axis(excess);
          const Nodes uncut = side.distance(excess, from_axis);
          const Nodes s = length + smaller(larger(past, -length), Nodes{});
          const Nodes foot = z * from_axis - uncut * (z + from_a - s * slope);
          const Nodes rim_excess = disc.excess(rim, rim_aside, Nodes{});
          const Nodes out = larger(disc.distance(rim_excess, disc.from_axis(rim_excess)), Nodes{});
          const Nodes to_disc = root(out * out + z * z);
          const Nodes before_disc = foot <= Nodes{} ? (uncut > Nodes{} ? uncut : to_disc) : to_disc;
          const Nodes distance = z <= Nodes{} ? larger(uncut, z) : before_disc;
          lower(values, part, distance);
        },
        across, aside, past_b, over, beyond, disc_across, disc_aside);
  }
}

void lower_to_struts(std::span<const LeafStrut> struts, LeafValues& values) {
  for (const LeafStrut& strut : struts) {
    Sweep sideways(strut.sideways), height(strut.height);
    Overshoot over(strut.past_b, strut.before_a);
    for_each_row(
        strut.reached,
        [&](Part part, Nodes lateral, Nodes high, Nodes beyond) {
          const Nodes side = root(lateral * lateral + beyond * beyond) - nodes(strut.half_width);
          const Nodes face = absolute(high) - nodes(strut.half_thickness);
          const Nodes side_out = larger(side, Nodes{}), face_out = larger(face, Nodes{});
          const Nodes outside = root(side_out * side_out + face_out * face_out);
          const Nodes inside = smaller(larger(side, face), Nodes{});
          lower(values, part, outside + inside - nodes(strut.edge_radius));
        },
        sideways, height, over);
  }
}

inline double dot(const LeafVector& a, const LeafVector& b) {
  return a.x * b.x + a.y * b.y + a.z * b.z;
}

/// sqrt(a^2 + b^2) of numbers far from the limits of their range.
inline double norm(double a, double b) { return std::sqrt(a * a + b * b); }

/// One node's distance to a round cone, and what its caps ask for: the foot's direction.
struct ConeSample {
  double distance, from_foot, s;
};

inline ConeSample sample_cone(const LeafCone& cone, double px, double py, double pz) {
  const LeafVector& u = cone.axis;
  const double t = px * u.x + py * u.y + pz * u.z;
  const double ox = px - t * u.x, oy = py - t * u.y, oz = pz - t * u.z;
  const double squared_rho = ox * ox + oy * oy + oz * oz;
  double s = t - std::sqrt(squared_rho) * cone.tangent;
  s = s < 0 ? 0 : s;
  s = s > cone.length ? cone.length : s;
  const double e = t - s;
  const double from_foot = std::sqrt(squared_rho + e * e);
  return {from_foot - cone.radius + s * cone.sine, from_foot, s};
}

/// The same cases as for one point, without branches: behind the cap's plane, beyond it beside the
/// cone, beyond it before the disc.
inline double cut_by(const LeafCone::Cap& cap, const ConeSample& uncut, double axial, double p_out,
                     double cx, double cy, double cz) {
  const LeafVector& n = cap.outward;
  const double z = cx * n.x + cy * n.y + cz * n.z;
  const double behind = uncut.distance > z ? uncut.distance : z;
  // The foot lies behind the plane: z - distance * (gradient . outward) <= 0.
  const double scaled = z * uncut.from_foot - uncut.distance * (p_out - uncut.s * axial);
  const bool beside = (uncut.distance > 0) & (scaled <= 0);
  const double ox = cx - z * n.x, oy = cy - z * n.y, oz = cz - z * n.z;
  const double excess = std::sqrt(ox * ox + oy * oy + oz * oz) - cap.radius;
  const double to_disc = norm(excess > 0 ? excess : 0, z);
  const double beyond = beside ? uncut.distance : to_disc;
  return z <= 0 ? behind : beyond;
}

inline double cylinder(const LeafCone& cone, double px, double py, double pz) {
  const LeafVector& u = cone.axis;
  const double t = px * u.x + py * u.y + pz * u.z;
  const double ox = px - t * u.x, oy = py - t * u.y, oz = pz - t * u.z;
  const double dr = std::sqrt(ox * ox + oy * oy + oz * oz) - cone.radius;
  const double dz = std::abs(t - 0.5 * cone.length) - 0.5 * cone.length;
  const double inside = dr > dz ? dr : dz;
  const double outside = norm(dr > 0 ? dr : 0, dz > 0 ? dz : 0);
  return inside <= 0 ? inside : outside;
}

template <class Distance>
inline void lower_each(LeafValues& values, double h, Distance&& distance) {
  for (int i = 0; i < kLeafSide; ++i) {
    for (int j = 0; j < kLeafSide; ++j) {
      float* row = values.at.data() + 64 * i + 8 * j;
      for (int k = 0; k < kLeafSide; ++k) {
        const auto d = static_cast<float>(distance(h * i, h * j, h * k));
        row[k] = d < row[k] ? d : row[k];
      }
    }
  }
}

void lower_to_cone(const LeafCone& cone, double h, LeafValues& values) {
  const double px = cone.from_a.x, py = cone.from_a.y, pz = cone.from_a.z;
  if (cone.flat) {
    lower_each(values, h, [&](double x, double y, double z) {
      return cylinder(cone, px + x, py + y, pz + z);
    });
    return;
  }
  if (cone.caps == 0) {
    lower_each(values, h, [&](double x, double y, double z) {
      return sample_cone(cone, px + x, py + y, pz + z).distance;
    });
    return;
  }
  const auto cut = [&](const LeafCone::Cap& cap, double x, double y, double z) {
    const LeafVector& n = cap.outward;
    const ConeSample uncut = sample_cone(cone, px + x, py + y, pz + z);
    const double p_out = (px + x) * n.x + (py + y) * n.y + (pz + z) * n.z;
    return cut_by(cap, uncut, dot(cone.axis, n), p_out, cap.from_centre.x + x,
                  cap.from_centre.y + y, cap.from_centre.z + z);
  };
  if (cone.caps == 1) {
    lower_each(values, h, [&](double x, double y, double z) { return cut(cone.cap[0], x, y, z); });
    return;
  }
  lower_each(values, h, [&](double x, double y, double z) {
    const double start = cut(cone.cap[0], x, y, z), end = cut(cone.cap[1], x, y, z);
    return start > end ? start : end;
  });
}

void lower_to_larger(const LeafValues& uncut, const Affine& beyond, LeafValues& values) {
  Sweep plane(beyond);
  for_each_row(
      LeafRows{}, [&](Part part, Nodes z) { lower(values, part, larger(load(uncut, part.n), z)); },
      plane);
}

/// How many are within?
inline int store(Nodes distance, Nodes limit, float* leaf, int n) {
  store_rows(smaller(larger(distance, -limit), limit), leaf + first_node(n));
  return std::popcount(below(absolute(distance), limit));
}

int store(const LeafValues& values, float background, float* leaf) {
  const Nodes limit = nodes(background);
  int active = 0;
  for (int n = 0; n < kParts; ++n) active += store(load(values, n), limit, leaf, n);
  return active;
}

int store_thin(std::span<const LeafCapsule> capsules, float radius, float background, float* leaf) {
  Nodes least[kParts];
  find_least(capsules, squared_norm, least);
  // Most are beyond the band, and need no root: the others are listed, which no branch could guess.
  constexpr float kRoundedUp = 1 + 8 * std::numeric_limits<float>::epsilon();
  const Nodes limit = nodes(background);
  const Nodes beyond = nodes(kRoundedUp * (radius + background) * (radius + background));
  int others[kParts], count = 0, active = 0;
  for (int n = 0; n < kParts; ++n) {
    store_rows(limit, leaf + first_node(n));
    others[count] = n;
    count += below(least[n], beyond) != 0;
  }
  for (int m = 0; m < count; ++m)
    active += store(root(least[others[m]]) - nodes(radius), limit, leaf, others[m]);
  return active;
}

}  // namespace
}  // namespace vstent::sdf
