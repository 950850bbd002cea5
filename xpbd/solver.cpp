#include "xpbd/solver.hpp"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <optional>
#include <stdexcept>
#include <type_traits>
#include <utility>

#include "xpbd/elastic_sheet.hpp"
#include "xpbd/parallel.hpp"
#include "xpbd/unbalanced.hpp"

namespace vstent::xpbd {
namespace {

// Iterations of relax between looks at how stiff each particle's surroundings have become.
constexpr int kWeighEvery = 50;
// And where struts fold it sharply.
constexpr int kWeighFoldedEvery = 10;
// Of the room between walls: used up by so much, they look again for what is near.
constexpr double kUsed = 0.25;

struct ClosableContact {
  Vec3 normal;
  double offset;  // from the solver's own origin
  double compliance;
  double force;  // N, never negative
};

struct ClosableSpan {
  std::array<std::size_t, 3> particles;
  std::array<double, 3> weights;
  Vec3 normal;
  double offset;  // from the solver's own origin
  double force;   // N, never negative
  std::int64_t key;
};

/// What a step's sweeps run over.
template <class Real>
struct Stage {
  BatchesOf<Real>& batches;
  std::vector<SlotOf<Real>>&particles, &forces;
  const StepKernels<Real>& kernel;
};

struct Single {
  BatchesOf<float> batches;
  std::vector<SlotOf<float>> particles, forces;
};

template <class Real>
void forget_multipliers(BatchesOf<Real>& batches) {
  for (auto& batch : batches.distances) batch.force.fill(0);
  for (auto& batch : batches.bendings) batch.force.fill(0);
}

}  // namespace

struct Solver::Implementation {
  ElasticSheet elastic;
  Layout& layout = elastic.layout;
  const Vec3& origin = elastic.origin;
  Grouped<Attachment>& attachments = elastic.attachments;
  const Kernels& kernel = kernels();
  std::vector<Slot>
      particles;  // in the layout's order, about `origin`; mobility as of the last step
  std::vector<double> inverse_mass;
  std::vector<Vec3> before;      // places at the start of the step
  std::vector<Vec3> drift;       // moved by inertia, mm
  std::vector<double> reaction;  // kept contact force, N
  std::vector<Vec3> positions;   // in the sheet's order
  std::vector<Vec3> velocities;  // in the sheet's order
  std::vector<Slot> forces;      // scratch
  std::optional<Single> single;  // of steps in single precision
  Precision precision = Precision::kDouble;
  Grouped<ClosableContact> contacts;
  std::vector<ClosableSpan> spans;
  std::optional<SelfCollision> collision;
  bool backward = false;
  double steps_since_rest = 0;
  double last_energy = 0;
  bool relaxing = false;
  std::vector<Softness> softness;  // the relaxation's step per force
  int iterations_since_weighing = 0;

  explicit Implementation(const Sheet& sheet)
      : elastic(make_elastic_sheet(sheet)),
        particles(particles_of(elastic, sheet.positions)),
        before(sheet.positions.size(), Vec3::Zero()),
        drift(sheet.positions.size(), Vec3::Zero()),
        reaction(sheet.positions.size(), 0.0),
        positions(sheet.positions),
        velocities(sheet.positions.size(), Vec3::Zero()),
        forces(sheet.positions.size()) {
    for (const int vertex : layout.original) inverse_mass.push_back(sheet.inverse_mass[at(vertex)]);
    group_contacts({}, contacts);
    if (sheet.surface) collision.emplace(sheet, elastic, particles);
  }

  /// Where much of the room between walls is used up, looks again for what is near.
  void look_around() {
    if (collision && collision->used(particles) > kUsed) collision->look(particles);
  }

  std::size_t chunks() const { return chunks_of(particles.size()); }

  void group_contacts(std::span<const Contact> from, Grouped<ClosableContact>& to) const {
    group(to, from, layout.number, [&](const Contact& c) {
      return ClosableContact{c.normal, c.offset - c.normal.dot(origin),
                             c.stiffness > 0 ? 1 / c.stiffness : 0, 0};
    });
  }

  /// Forces of spans that were there before stay.
  void take_spans(std::span<const SpanContact> from) {
    std::vector<ClosableSpan> taken;
    taken.reserve(from.size());
    std::size_t old = 0;
    for (const SpanContact& c : from) {
      assert(taken.empty() || taken.back().key < c.key);
      while (old < spans.size() && spans[old].key < c.key) ++old;
      const double force = old < spans.size() && spans[old].key == c.key ? spans[old].force : 0;
      const auto number = [&](int k) { return at(layout.number[at(c.vertices[at(k)])]); };
      taken.push_back({{number(0), number(1), number(2)},
                       c.weights,
                       c.normal,
                       c.offset - c.normal.dot(origin),
                       force,
                       c.key});
    }
    spans = std::move(taken);
  }

  template <class Real>
  static Vec3 point(const ClosableSpan& c, const std::vector<SlotOf<Real>>& slots) {
    return c.weights[0] * place(slots[c.particles[0]]) +
           c.weights[1] * place(slots[c.particles[1]]) +
           c.weights[2] * place(slots[c.particles[2]]);
  }

  template <class Real>
  void add_span_forces(std::vector<SlotOf<Real>>& to) const {
    for (const ClosableSpan& c : spans) {
      for (std::size_t i = 0; i < 3; ++i) {
        SlotOf<Real>& slot = to[c.particles[i]];
        put(slot, place(slot) + c.weights[i] * c.force * c.normal);
      }
    }
  }

  /// One pass over the spans, one after the other: they share particles. `yielding(k, push)` is how
  /// far particle k gives way to a push, which sets the force; the places themselves are corrected
  /// along the normal, where `mobile(k)`. `moved(k, by)` hears of it.
  template <class Real, class Yielding, class Mobile, class Moved>
  void project_spans(std::vector<SlotOf<Real>>& slots, const Yielding& yielding,
                     const Mobile& mobile, const Moved& moved) {
    for (ClosableSpan& c : spans) {
      double squares = 0;
      for (std::size_t i = 0; i < 3; ++i)
        if (mobile(c.particles[i])) squares += c.weights[i] * c.weights[i];
      if (!(squares > 0)) continue;
      double give = 0;
      for (std::size_t i = 0; i < 3; ++i)
        if (c.weights[i] > 0 && mobile(c.particles[i]))
          give += c.weights[i] * c.weights[i] * c.normal.dot(yielding(c.particles[i], c.normal));
      const double change = std::max(-c.force, -(c.normal.dot(point(c, slots)) - c.offset) / give);
      c.force += change;
      for (std::size_t i = 0; i < 3; ++i) {
        const std::size_t k = c.particles[i];
        if (c.weights[i] == 0 || !mobile(k)) continue;
        const Vec3 by = change * give / squares * c.weights[i] * c.normal;
        put(slots[k], place(slots[k]) + by);
        moved(k, by);
      }
    }
  }

  void forget_multipliers() {
    if (collision) collision->forget();
    for (ClosableSpan& c : spans) c.force = 0;
    xpbd::forget_multipliers(layout);
    if (single) xpbd::forget_multipliers(single->batches);
    for (TriangleBatch& batch : layout.triangles) batch.force.fill(0);
    for (Attachment& a : attachments.items) a.force = 0;
    std::fill(reaction.begin(), reaction.end(), 0.0);
  }

  void rest() {
    forget_multipliers();
    std::fill(velocities.begin(), velocities.end(), Vec3::Zero());
    steps_since_rest = 0;
  }

  Stage<double> in_double() { return {layout, particles, forces, kernel.step}; }
  Stage<float> in_single() {
    if (!single)
      single = Single{in_single_precision(layout), std::vector<SlotOf<float>>(particles.size()),
                      std::vector<SlotOf<float>>(particles.size())};
    return {single->batches, single->particles, single->forces, kernel.step_in_single};
  }

  /// The kept multipliers' forces along the present gradients, into the stage's forces.
  template <class Real>
  void turn_kept_forces(const Stage<Real>& stage) {
    for_each_particle(forces.size(), [&](std::size_t k, std::size_t) {
      Vec3 force = Vec3::Zero();
      for (const Attachment& a : attachments.of(k)) {
        const Vec3 offset = place(particles[k]) - a.target;
        if (const double length = offset.norm(); length > 0) force += a.force / length * offset;
      }
      stage.forces[k] = {};
      put(stage.forces[k], force);
      put(stage.particles[k], place(particles[k]));
    });
    for (const auto* phase : {&stage.batches.within, &stage.batches.between})
      side_by_side(phase->size(), [&](std::size_t n) {
        const BatchesOf<Real>& batches = stage.batches;
        const Task& task = (*phase)[n];
        const SlotOf<Real>* slots = stage.particles.data();
        stage.kernel.kept_distance_forces(distances_of(batches, task), slots, stage.forces.data());
        stage.kernel.kept_bending_forces(bendings_of(batches, task), slots, stage.forces.data());
        if constexpr (std::is_same_v<Real, double>)
          kernel.kept_triangle_forces(triangles_of(layout, task), slots, stage.forces.data());
      });
    add_span_forces(stage.forces);
    if constexpr (std::is_same_v<Real, double>)
      if (collision) collision->add_kept_forces(particles, forces);
  }

  /// Moves particle k by inertia, loads and kept multipliers; true where the velocity limit held it
  /// back.
  template <class Real>
  bool predict(std::size_t k, double retained, const StepOptions& options,
               const Stage<Real>& stage) {
    SlotOf<Real>& particle = stage.particles[k];
    const double dt = options.time_step;
    const double mobility = dt * dt * inverse_mass[k];
    before[k] = place(particles[k]);
    particle.mobility = static_cast<Real>(mobility);
    put(particle, before[k]);
    drift[k].setZero();
    if (!(mobility > 0)) return false;
    bool clamped = false;
    drift[k] = dt * retained * velocities[at(layout.original[k])];
    if (const double travel = drift[k].norm();
        options.velocity_limit > 0 && travel > options.velocity_limit) {
      drift[k] *= options.velocity_limit / travel;
      clamped = true;
    }
    Vec3 pushed = Vec3::Zero();
    if (options.keep_multipliers) pushed = mobility * place(stage.forces[k]);
    if (!elastic.load.empty()) pushed += mobility * elastic.load[k];
    for (ClosableContact& c : contacts.of(k)) {
      c.force = std::exchange(reaction[k], 0.0);
      pushed += mobility * c.force * c.normal;
    }
    // Near balance the pushes cancel; a hinge that has just collapsed turns a small moment into a
    // huge one.
    if (const double travel = pushed.norm();
        options.velocity_limit > 0 && travel > options.velocity_limit)
      pushed *= options.velocity_limit / travel;
    put(particle, before[k] + drift[k] + pushed);
    return clamped;
  }

  template <class Real>
  void sweep_batches(const Stage<Real>& stage) {
    const auto run = [&](const std::vector<Task>& phase) {
      side_by_side(phase.size(), [&](std::size_t n) {
        const Task& task = phase[n];
        SlotOf<Real>* slots = stage.particles.data();
        const auto project_triangles = [&] {
          if constexpr (std::is_same_v<Real, double>)
            kernel.project_triangles(triangles_of(layout, task), slots, backward);
        };
        const auto distances = distances_of(stage.batches, task);
        const auto bendings = bendings_of(stage.batches, task);
        if (!backward) {
          stage.kernel.project_distances(distances, slots, false);
          project_triangles();
        }
        stage.kernel.project_bendings(bendings, slots, backward);
        if (backward) {
          project_triangles();
          stage.kernel.project_distances(distances, slots, true);
        }
      });
    };
    run(backward ? stage.batches.between : stage.batches.within);
    run(backward ? stage.batches.within : stage.batches.between);
    backward = !backward;
  }

  /// Attachments and contacts of one particle; contacts last, so that nothing penetrates, unless
  /// the particle might meet another wall: true then.
  template <class Real>
  bool project_particle(std::size_t k, SlotOf<Real>& particle) {
    const auto mobility = static_cast<double>(particle.mobility);
    if (!(mobility > 0)) return false;
    Vec3 x = place(particle);
    for (Attachment& a : attachments.of(k)) {
      const Vec3 offset = x - a.target;
      const double length = offset.norm();
      if (!(length > 0)) continue;
      const double change = -(length + a.compliance * a.force) / (a.compliance + mobility);
      a.force += change;
      x += mobility * change / length * offset;
    }
    for (ClosableContact& c : contacts.of(k)) {
      const double gap = c.normal.dot(x) - c.offset;
      const double change =
          std::max(-c.force, -(gap + c.compliance * c.force) / (c.compliance + mobility));
      c.force += change;
      x += mobility * change * c.normal;
    }
    const bool kept = collision && collision->keep(k, x);
    put(particle, x);
    return kept;
  }

  struct Finish {
    double largest_move = 0;
    double power = 0;
    int kept_apart = 0;
  };

  template <class Real>
  void finish(std::size_t k, double dt, const SlotOf<Real>& particle, Finish& sums) {
    const std::size_t vertex = at(layout.original[k]);
    const Vec3 x = place(particle);
    const Vec3 move = x - before[k];
    Vec3 velocity = move / dt;
    if (particle.mobility > 0) {
      sums.power += move.dot(move - drift[k]) / static_cast<double>(particle.mobility);
      for (const ClosableContact& c : contacts.of(k)) {
        if (!(c.force > 0)) continue;
        reaction[k] += c.force;
        // A push is not a kick: what a closed contact moves comes to rest on it.
        velocity -= std::max(0.0, velocity.dot(c.normal)) * c.normal;
      }
    }
    sums.largest_move = std::max(sums.largest_move, move.norm());
    put(particles[k], x);
    velocities[vertex] = velocity;
    positions[vertex] = x + origin;
  }

  StepReport step(std::span<const Contact> new_contacts, const StepOptions& options,
                  std::span<const SpanContact> new_spans) {
    assert(options.time_step > 0 && options.iterations > 0);
    if (options.precision == Precision::kSingle && (!layout.triangles.empty() || collision))
      throw std::invalid_argument(
          "elastic triangles and self-collision are swept in double precision only");
    group_contacts(new_contacts, contacts);
    take_spans(new_spans);
    if (std::exchange(relaxing, false)) rest();
    look_around();
    const bool is_new_precision = std::exchange(precision, options.precision) != options.precision;
    if (!options.keep_multipliers || is_new_precision) forget_multipliers();
    return options.precision == Precision::kSingle ? step(options, in_single())
                                                   : step(options, in_double());
  }

  template <class Real>
  StepReport step(const StepOptions& options, const Stage<Real>& stage) {
    if (options.keep_multipliers) turn_kept_forces(stage);
    const double retained =
        options.adaptive_damping ? steps_since_rest / (steps_since_rest + 3) : 1 - options.damping;
    std::vector<int> clamped(chunks(), 0);
    for_each_particle(particles.size(), [&](std::size_t k, std::size_t chunk) {
      clamped[chunk] += predict(k, retained, options, stage);
    });
    std::vector<Finish> sums(chunks());
    for (int sweep = 1; sweep <= options.iterations; ++sweep) {
      sweep_batches(stage);
      project_spans(
          stage.particles,
          [&](std::size_t k, const Vec3& push) {
            return Vec3(static_cast<double>(stage.particles[k].mobility) * push);
          },
          [&](std::size_t k) { return stage.particles[k].mobility > 0; },
          [](std::size_t, const Vec3&) {});
      if constexpr (std::is_same_v<Real, double>)
        if (collision) collision->project(particles);
      const bool is_last = sweep == options.iterations;
      if (!is_last && !collision && attachments.items.empty() && contacts.items.empty()) continue;
      for_each_particle(particles.size(), [&](std::size_t k, std::size_t chunk) {
        SlotOf<Real>& particle = stage.particles[k];
        const bool kept = project_particle(k, particle);
        if (!is_last) return;
        sums[chunk].kept_apart += kept;
        finish(k, options.time_step, particle, sums[chunk]);
      });
    }

    StepReport report;
    double power = 0;
    for (std::size_t chunk = 0; chunk < chunks(); ++chunk) {
      report.clamped_vertices += clamped[chunk];
      report.largest_move = std::max(report.largest_move, sums[chunk].largest_move);
      report.kept_apart += sums[chunk].kept_apart;
      power += sums[chunk].power;
    }
    steps_since_rest = power < 0 ? 0 : steps_since_rest + 1;
    return report;
  }

  /// Of everything but contacts between vertices, at the present places, by particle.
  Tally all_forces(std::vector<Slot>& to) const {
    Tally tally = elastic_forces(elastic, particles, to);
    if (collision) add(collision->add_forces(particles, to), tally);
    add_span_forces(to);
    return tally;
  }

  /// What is unbalanced at particle k under `force` and what its closed contacts give back; adds it
  /// to `sums`.
  Vec3 weigh(std::size_t k, Vec3 force, std::span<const ClosableContact> at_k, double tolerance,
             Unbalanced& sums) const {
    if (!(inverse_mass[k] > 0)) return Vec3::Zero();
    for (const ClosableContact& c : at_k) {
      const double gap = c.normal.dot(place(particles[k])) - c.offset;
      if (gap > tolerance) continue;
      // A rigid contact gives what is asked of it; a soft one what its penetration makes.
      const double push = c.compliance > 0 ? -gap / c.compliance : -force.dot(c.normal);
      if (!(push > 0)) continue;
      force += push * c.normal;
      sums.add_contact(push);
    }
    sums.add(force, layout.original[k]);
    return force;
  }

  ForceBalance conclude(const Tally& tally, std::span<const Unbalanced> parts) const {
    Unbalanced all;
    for (const ClosableSpan& c : spans) {
      all.contact_sum += c.force;
      all.in_contact += c.force > 0;
    }
    for (const Unbalanced& part : parts) all.merge(part);
    return all.conclude(tally);
  }

  ForceBalance balance(std::span<const Contact> at_contacts, double tolerance) const {
    std::vector<Slot> unbalanced;
    const Tally tally = all_forces(unbalanced);
    Grouped<ClosableContact> grouped;
    group_contacts(at_contacts, grouped);
    std::vector<Unbalanced> parts(chunks());
    for_each_particle(particles.size(), [&](std::size_t k, std::size_t chunk) {
      weigh(k, place(unbalanced[k]), std::as_const(grouped).of(k), tolerance, parts[chunk]);
    });
    return conclude(tally, parts);
  }

  RelaxReport relax(std::span<const Contact> new_contacts, const RelaxOptions& options,
                    std::span<const SpanContact> new_spans) {
    group_contacts(new_contacts, contacts);
    take_spans(new_spans);
    if (!std::exchange(relaxing, true)) {
      rest();
      iterations_since_weighing = kWeighEvery;
    }
    look_around();
    if (++iterations_since_weighing > (spans.empty() ? kWeighEvery : kWeighFoldedEvery)) {
      softness = measure_softness(elastic, particles,
                                  collision ? collision->links(particles) : std::vector<Link>());
      iterations_since_weighing = 0;
    }
    // Forces are taken where momentum alone would lead: that damps what swings fast and leaves the
    // slow motion its speed.
    const double retained = steps_since_rest / (steps_since_rest + 3);
    for_each_particle(particles.size(), [&](std::size_t k, std::size_t) {
      before[k] = place(particles[k]);
      drift[k].setZero();
      if (!(inverse_mass[k] > 0)) return;
      drift[k] = retained * velocities[at(layout.original[k])];
      Vec3 ahead = before[k] + drift[k];
      if (collision && collision->keep(k, ahead)) drift[k] = ahead - before[k];
      put(particles[k], ahead);
    });
    const Tally tally = all_forces(forces);
    std::vector<Unbalanced> parts(chunks());
    std::vector<Finish> sums(chunks());
    for_each_particle(particles.size(), [&](std::size_t k, std::size_t chunk) {
      const Vec3 residual = weigh(k, place(forces[k]), std::as_const(contacts).of(k),
                                  options.contact_tolerance, parts[chunk]);
      if (inverse_mass[k] > 0) relax_particle(k, residual, options, sums[chunk]);
    });
    project_spans(
        particles,
        [&](std::size_t k, const Vec3& push) { return Vec3(options.step * (softness[k] * push)); },
        [&](std::size_t k) { return inverse_mass[k] > 0; },
        [&](std::size_t k, Vec3 by) {
          if (Vec3 x = place(particles[k]); collision && collision->keep(k, x)) {
            by += x - place(particles[k]);
            put(particles[k], x);
          }
          positions[at(layout.original[k])] += by;
          velocities[at(layout.original[k])] += by;
        });
    RelaxReport report;
    report.balance = conclude(tally, parts);
    double power = 0;
    for (const Finish& part : sums) {
      report.largest_move = std::max(report.largest_move, part.largest_move);
      power += part.power;
    }
    // Contacts between vertices come and go, and each may kick: momentum is given up as soon as the
    // energy rises.
    const bool rising = !spans.empty() && tally.energy > std::exchange(last_energy, tally.energy);
    steps_since_rest = power < 0 || rising ? 0 : steps_since_rest + 1;
    return report;
  }

  void relax_particle(std::size_t k, const Vec3& residual, const RelaxOptions& options,
                      Finish& sums) {
    Vec3 move = drift[k] + options.step * (softness[k] * place(forces[k]));
    if (const double travel = move.norm();
        options.largest_move > 0 && travel > options.largest_move)
      move *= options.largest_move / travel;
    Vec3 x = before[k] + move;
    bool closed = false;
    for (const ClosableContact& c : contacts.of(k)) {
      // Yields to the contact's push as to any other force, so that they cancel at rest.
      const Vec3 yielding = options.step * (softness[k] * c.normal);
      const double gap = c.normal.dot(x) - c.offset;
      const double give = c.compliance + yielding.dot(c.normal);
      const double push = give > 0 ? std::max(0.0, -gap / give) : 0;
      x += push * yielding;
      closed = closed || push > 0;
    }
    if (collision) collision->keep(k, x);
    move = x - before[k];
    sums.power += move.dot(residual);
    sums.largest_move = std::max(sums.largest_move, move.norm());
    put(particles[k], x);
    positions[at(layout.original[k])] = x + origin;
    if (closed)  // a push is not a kick: what a closed contact moves comes to rest on it
      for (const ClosableContact& c : contacts.of(k))
        move -= std::max(0.0, move.dot(c.normal)) * c.normal;
    velocities[at(layout.original[k])] = move;
  }
};

Solver::Solver(const Sheet& sheet) : implementation_(std::make_unique<Implementation>(sheet)) {}
Solver::~Solver() = default;
Solver::Solver(Solver&&) noexcept = default;

StepReport Solver::step(std::span<const Contact> contacts, const StepOptions& options,
                        std::span<const SpanContact> spans) {
  return implementation_->step(contacts, options, spans);
}

RelaxReport Solver::relax(std::span<const Contact> contacts, const RelaxOptions& options,
                          std::span<const SpanContact> spans) {
  return implementation_->relax(contacts, options, spans);
}

std::span<const Vec3> Solver::positions() const { return implementation_->positions; }
std::span<const Vec3> Solver::velocities() const { return implementation_->velocities; }

void Solver::set_velocities(std::span<const Vec3> velocities) {
  assert(velocities.size() == implementation_->velocities.size());
  implementation_->velocities.assign(velocities.begin(), velocities.end());
}

void Solver::set_positions(std::span<const Vec3> positions) {
  Implementation& s = *implementation_;
  assert(positions.size() == s.positions.size());
  s.positions.assign(positions.begin(), positions.end());
  s.particles = particles_of(s.elastic, positions);
  if (s.collision) s.collision->look(s.particles);
  s.rest();
}

ForceBalance Solver::balance(std::span<const Contact> contacts, double contact_tolerance) const {
  return implementation_->balance(contacts, contact_tolerance);
}

std::vector<Push> Solver::pushes() const {
  const Implementation& s = *implementation_;
  return s.collision ? by_vertex(s.collision->pushes(s.particles), s.elastic) : std::vector<Push>();
}

void scale_masses(Sheet& sheet, double time_step, double kappa) {
  std::vector<double> pull(sheet.positions.size(), 0.0);
  const auto x = [&](int i) -> const Vec3& { return sheet.positions[at(i)]; };
  for (const DistanceConstraint& d : sheet.distances) {
    pull[at(d.i)] += d.stiffness;
    pull[at(d.j)] += d.stiffness;
  }
  for (const BendingConstraint& b : sheet.bendings) {
    std::array<Vec3, 4> gradient;
    hinge_angle(x(b.edge_a), x(b.edge_b), x(b.wing_a), x(b.wing_b), &gradient);
    const std::array<int, 4> vertex{b.edge_a, b.edge_b, b.wing_a, b.wing_b};
    for (std::size_t k = 0; k < 4; ++k)
      pull[at(vertex[k])] += b.stiffness * gradient[k].squaredNorm();
  }
  for (const TriangleConstraint& t : sheet.triangles) {
    // 1 / (1 - nu) is the largest of a plane strain's stiffnesses over twice the shear modulus.
    const double largest = shear_modulus(t) * t.base * t.height / (1 - t.poisson_ratio);
    const double along = 1 / t.base, across = 1 / t.height, skew = along * t.foot / t.height;
    pull[at(t.vertices[0])] += largest * (along * along + (across - skew) * (across - skew));
    pull[at(t.vertices[1])] += largest * (along * along + skew * skew);
    pull[at(t.vertices[2])] += largest * across * across;
  }
  for (const AttachmentConstraint& a : sheet.attachments) pull[at(a.vertex)] += a.stiffness;
  for (std::size_t i = 0; i < pull.size(); ++i)
    if (sheet.inverse_mass[i] > 0 && pull[i] > 0)
      sheet.inverse_mass[i] = kappa / (time_step * time_step * pull[i]);
}

}  // namespace vstent::xpbd
