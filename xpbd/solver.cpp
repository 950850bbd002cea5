#include "xpbd/solver.hpp"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <utility>

#include "xpbd/solver_state.hpp"
#include "xpbd/unbalanced.hpp"

namespace vstent::xpbd {
namespace {

// Iterations of relax between looks at how stiff each particle's surroundings have become.
constexpr int kWeighEvery = 50;
// And where struts fold it sharply.
constexpr int kWeighFoldedEvery = 10;
// Of the room between walls: used up by so much, they look again for what is near.
constexpr double kUsed = 0.25;

template <class Batch>
void forget(std::vector<Batch>& batches, Springs Batch::*springs) {
  for (Batch& batch : batches) (batch.*springs).force.fill(0);
}

}  // namespace

SolverState::SolverState(const Sheet& sheet)
    : elastic(make_elastic_sheet(sheet)),
      particles(particles_of(elastic, sheet.positions)),
      velocities(sheet.positions.size(), Vec3::Zero()) {
  for (std::size_t k = 0; k < particles.size(); ++k)
    particles[k].mobility = sheet.inverse_mass[at(layout.original[k])];
  if (sheet.surface) collision.emplace(sheet, elastic, particles);
}

void SolverState::look_around() {
  if (collision && collision->used(particles) > kUsed) collision->look(particles);
}

Grouped<ClosableContact> SolverState::grouped(std::span<const Contact> from) const {
  Grouped<ClosableContact> made;
  group(made, from, layout.number, [&](const Contact& c) {
    return ClosableContact{c.normal, c.offset - c.normal.dot(origin),
                           c.stiffness > 0 ? 1 / c.stiffness : 0, 0};
  });
  return made;
}

void SolverState::take_spans(std::span<const SpanContact> from) {
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

void SolverState::forget_multipliers() {
  if (collision) collision->forget();
  for (ClosableSpan& c : spans) c.force = 0;
  forget(layout.distances, &DistanceBatch::length);
  forget(layout.hinged_edges, &HingedEdgeBatch::length);
  forget(layout.hinged_edges, &HingedEdgeBatch::fold);
  forget(layout.bendings, &BendingBatch::fold);
  for (TriangleBatch& batch : layout.triangles) batch.force.fill(0);
  for (Attachment& a : attachments.items) a.force = 0;
  for (ClosableContact& c : contacts.items) c.force = 0;
}

void SolverState::rest() {
  forget_multipliers();
  std::fill(velocities.begin(), velocities.end(), Vec3::Zero());
  steps_since_rest = 0;
}

struct Solver::Implementation : SolverState {
  using SolverState::SolverState;

  /// Of everything but contacts between vertices, at the present places, by particle.
  Tally all_forces(std::vector<Slot>& to) const {
    Tally tally = elastic_forces(elastic, particles, to);
    if (collision) add(collision->add_forces(particles, to), tally);
    add_span_forces(spans, to);
    return tally;
  }

  /// What is unbalanced at particle k under `force` and what its closed contacts give back; adds it
  /// to `sums`.
  Vec3 weigh(std::size_t k, Vec3 force, std::span<const ClosableContact> at_k, double tolerance,
             Unbalanced& sums) const {
    if (!elastic.free[k]) return Vec3::Zero();
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
    const Grouped<ClosableContact> closable = grouped(at_contacts);
    std::vector<Unbalanced> parts(chunks());
    for_each_particle(particles.size(), [&](std::size_t k, std::size_t chunk) {
      weigh(k, place(unbalanced[k]), closable.of(k), tolerance, parts[chunk]);
    });
    return conclude(tally, parts);
  }

  RelaxReport relax(std::span<const Contact> new_contacts, const RelaxOptions& options,
                    std::span<const SpanContact> new_spans) {
    contacts = grouped(new_contacts);
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
      if (!elastic.free[k]) return;
      const Vec3 before = place(particles[k]);
      velocities[k] *= retained;
      Vec3 ahead = before + velocities[k];
      if (collision && collision->keep(k, ahead)) velocities[k] = ahead - before;
      put(particles[k], ahead);
    });
    const Tally tally = all_forces(forces);
    std::vector<Unbalanced> parts(chunks());
    std::vector<Motion> sums(chunks());
    for_each_particle(particles.size(), [&](std::size_t k, std::size_t chunk) {
      const Vec3 residual = weigh(k, place(forces[k]), std::as_const(contacts).of(k),
                                  options.contact_tolerance, parts[chunk]);
      if (elastic.free[k]) relax_particle(k, residual, options, sums[chunk]);
    });
    project_spans(
        spans, particles,
        [&](std::size_t k, const Vec3& push) { return Vec3(options.step * (softness[k] * push)); },
        [&](std::size_t k) { return elastic.free[k] != 0; },
        [&](std::size_t k, Vec3 by) {
          if (Vec3 x = place(particles[k]); collision && collision->keep(k, x)) {
            by += x - place(particles[k]);
            put(particles[k], x);
          }
          velocities[k] += by;
        });
    RelaxReport report;
    report.balance = conclude(tally, parts);
    double power = 0;
    for (const Motion& part : sums) {
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
                      Motion& sums) {
    const Vec3 before = place(particles[k]) - velocities[k];
    Vec3 move = velocities[k] + options.step * (softness[k] * place(forces[k]));
    if (const double travel = move.norm();
        options.largest_move > 0 && travel > options.largest_move)
      move *= options.largest_move / travel;
    Vec3 x = before + move;
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
    move = x - before;
    sums.power += move.dot(residual);
    sums.largest_move = std::max(sums.largest_move, move.norm());
    put(particles[k], x);
    if (closed)  // a push is not a kick: what a closed contact moves comes to rest on it
      for (const ClosableContact& c : contacts.of(k))
        move -= std::max(0.0, move.dot(c.normal)) * c.normal;
    velocities[k] = move;
  }

  void give_positions() const {
    positions.resize(particles.size());
    for_each_particle(particles.size(), [&](std::size_t k, std::size_t) {
      positions[at(layout.original[k])] = place(particles[k]) + origin;
    });
  }
};

Solver::Solver(const Sheet& sheet) : implementation_(std::make_unique<Implementation>(sheet)) {}
Solver::~Solver() = default;
Solver::Solver(Solver&&) noexcept = default;

StepReport Solver::step(std::span<const Contact> contacts, const StepOptions& options,
                        std::span<const SpanContact> spans) {
  return xpbd::step(*implementation_, contacts, options, spans);
}

RelaxReport Solver::relax(std::span<const Contact> contacts, const RelaxOptions& options,
                          std::span<const SpanContact> spans) {
  return implementation_->relax(contacts, options, spans);
}

std::span<const Vec3> Solver::positions() const {
  implementation_->give_positions();
  return implementation_->positions;
}

std::vector<Vec3> Solver::velocities() const {
  const Implementation& s = *implementation_;
  std::vector<Vec3> velocities(s.velocities.size());
  for (std::size_t k = 0; k < velocities.size(); ++k)
    velocities[at(s.layout.original[k])] = s.velocities[k];
  return velocities;
}

void Solver::set_velocities(std::span<const Vec3> velocities) {
  Implementation& s = *implementation_;
  assert(velocities.size() == s.velocities.size());
  for (std::size_t k = 0; k < velocities.size(); ++k)
    s.velocities[k] = velocities[at(s.layout.original[k])];
}

void Solver::set_positions(std::span<const Vec3> positions) {
  Implementation& s = *implementation_;
  assert(positions.size() == s.particles.size());
  for (std::size_t k = 0; k < positions.size(); ++k)
    put(s.particles[k], positions[at(s.layout.original[k])] - s.origin);
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

}  // namespace vstent::xpbd
