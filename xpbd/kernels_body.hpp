// Body of the kernels: included by one .cpp per instruction set. Everything here has internal
// linkage, so that code for wide registers cannot leak into other files.
#include "xpbd/deformation.hpp"
#include "xpbd/kernels.hpp"

namespace vstent::xpbd {
namespace {

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

/// Both at once: a hinge's gradients are normal to its triangles, and so to the edge, that to first
/// order neither changes what the other asks for.
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
