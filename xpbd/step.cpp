#include <algorithm>
#include <cassert>
#include <cmath>
#include <stdexcept>
#include <type_traits>
#include <utility>

#include "xpbd/solver_state.hpp"

namespace vstent::xpbd {
namespace {

/// What a step's sweeps run over.
template <class Real>
struct Stage {
  std::vector<SlotOf<Real>>&particles, &forces;
  const StepKernels<Real>& kernel;
};

Stage<double> in_double(SolverState& s) {
  s.forces.resize(s.particles.size());
  return {s.particles, s.forces, s.kernel.step};
}

Stage<float> in_single(SolverState& s) {
  if (!s.single)
    s.single = Single{std::vector<SlotOf<float>>(s.particles.size()),
                      std::vector<SlotOf<float>>(s.particles.size())};
  return {s.single->particles, s.single->forces, s.kernel.step_in_single};
}

template <class Real>
class Step {
 public:
  Step(SolverState& state, const StepOptions& options, const Stage<Real>& stage)
      : s_(state), options_(options), stage_(stage) {}

  StepReport take() {
    if (options_.keep_multipliers) turn_kept_forces();
    const double retained = options_.adaptive_damping
                                ? s_.steps_since_rest / (s_.steps_since_rest + 3)
                                : 1 - options_.damping;
    const double change = options_.time_step / std::exchange(s_.time_step, options_.time_step);
    std::vector<int> clamped(s_.chunks(), 0);
    for_each_particle(s_.particles.size(), [&](std::size_t k, std::size_t chunk) {
      clamped[chunk] += predict(k, retained, change * change);
    });
    std::vector<Motion> sums(s_.chunks());
    for (int sweep = 1; sweep <= options_.iterations; ++sweep) {
      sweep_batches();
      project_spans(
          s_.spans, stage_.particles,
          [&](std::size_t k, const Vec3& push) {
            return Vec3(static_cast<double>(stage_.particles[k].mobility) * push);
          },
          [&](std::size_t k) { return stage_.particles[k].mobility > 0; },
          [](std::size_t, const Vec3&) {});
      if constexpr (std::is_same_v<Real, double>)
        if (s_.collision) s_.collision->project(s_.particles);
      const bool is_last = sweep == options_.iterations;
      if (!is_last && !s_.collision && s_.attachments.items.empty() && s_.contacts.items.empty())
        continue;
      for_each_particle(s_.particles.size(), [&](std::size_t k, std::size_t chunk) {
        SlotOf<Real>& particle = stage_.particles[k];
        const bool kept = project_particle(k, particle);
        if (!is_last) return;
        sums[chunk].kept_apart += kept;
        finish(k, particle, sums[chunk]);
      });
    }

    StepReport report;
    double power = 0;
    for (std::size_t chunk = 0; chunk < s_.chunks(); ++chunk) {
      report.clamped_vertices += clamped[chunk];
      report.largest_move = std::max(report.largest_move, sums[chunk].largest_move);
      report.kept_apart += sums[chunk].kept_apart;
      power += sums[chunk].power;
    }
    s_.steps_since_rest = power < 0 ? 0 : s_.steps_since_rest + 1;
    return report;
  }

 private:
  /// The kept multipliers' forces along the present gradients, into the stage's forces.
  void turn_kept_forces() {
    for_each_particle(s_.particles.size(), [&](std::size_t k, std::size_t) {
      Vec3 force = Vec3::Zero();
      for (const Attachment& a : s_.attachments.of(k)) {
        const Vec3 offset = place(s_.particles[k]) - a.target;
        if (const double length = offset.norm(); length > 0) force += a.force / length * offset;
      }
      stage_.forces[k] = {};
      put(stage_.forces[k], force);
      put(stage_.particles[k], place(s_.particles[k]));
    });
    for (const auto* phase : {&s_.layout.within, &s_.layout.between})
      side_by_side(phase->size(), [&](std::size_t n) {
        stage_.kernel.add_kept_forces(batches_of(std::as_const(s_.layout), (*phase)[n]),
                                      stage_.particles.data(), stage_.forces.data());
      });
    add_span_forces(s_.spans, stage_.forces);
    if constexpr (std::is_same_v<Real, double>)
      if (s_.collision) s_.collision->add_kept_forces(s_.particles, s_.forces);
  }

  /// Where particle k was before the step. In double precision that takes the place of its forces.
  Vec3 before(std::size_t k) const {
    if constexpr (std::is_same_v<Real, double>) return place(s_.forces[k]);
    return place(s_.particles[k]);
  }

  /// Moves particle k by inertia, loads and kept multipliers; true where the velocity limit held it
  /// back.
  bool predict(std::size_t k, double retained, double change_of_mobility) {
    SlotOf<Real>& particle = stage_.particles[k];
    s_.particles[k].mobility *= change_of_mobility;
    const double mobility = s_.particles[k].mobility;
    const Vec3 here = place(s_.particles[k]);
    const Vec3 force = place(stage_.forces[k]);
    if constexpr (std::is_same_v<Real, double>) put(s_.forces[k], here);
    particle.mobility = static_cast<Real>(mobility);
    put(particle, here);
    Vec3& drift = s_.velocities[k];
    if (!(mobility > 0)) {
      drift.setZero();
      return false;
    }
    bool clamped = false;
    drift *= options_.time_step * retained;
    if (const double travel = drift.norm();
        options_.velocity_limit > 0 && travel > options_.velocity_limit) {
      drift *= options_.velocity_limit / travel;
      clamped = true;
    }
    Vec3 pushed = Vec3::Zero();
    if (options_.keep_multipliers) pushed = mobility * force;
    if (!s_.elastic.load.empty()) pushed += mobility * s_.elastic.load[k];
    for (const ClosableContact& c : s_.contacts.of(k)) pushed += mobility * c.force * c.normal;
    // Near balance the pushes cancel; a hinge that has just collapsed turns a small moment into a
    // huge one.
    if (const double travel = pushed.norm();
        options_.velocity_limit > 0 && travel > options_.velocity_limit)
      pushed *= options_.velocity_limit / travel;
    put(particle, here + drift + pushed);
    return clamped;
  }

  void sweep_batches() {
    const auto run = [&](const std::vector<Task>& phase) {
      side_by_side(phase.size(), [&](std::size_t n) {
        stage_.kernel.project(batches_of(s_.layout, phase[n]), stage_.particles.data(),
                              s_.backward);
      });
    };
    run(s_.backward ? s_.layout.between : s_.layout.within);
    run(s_.backward ? s_.layout.within : s_.layout.between);
    s_.backward = !s_.backward;
  }

  /// Attachments and contacts of one particle; contacts last, so that nothing penetrates, unless
  /// the particle might meet another wall: true then.
  bool project_particle(std::size_t k, SlotOf<Real>& particle) {
    const auto mobility = static_cast<double>(particle.mobility);
    if (!(mobility > 0)) return false;
    Vec3 x = place(particle);
    for (Attachment& a : s_.attachments.of(k)) {
      const Vec3 offset = x - a.target;
      const double length = offset.norm();
      if (!(length > 0)) continue;
      const double change = -(length + a.compliance * a.force) / (a.compliance + mobility);
      a.force += change;
      x += mobility * change / length * offset;
    }
    for (ClosableContact& c : s_.contacts.of(k)) {
      const double gap = c.normal.dot(x) - c.offset;
      const double change =
          std::max(-c.force, -(gap + c.compliance * c.force) / (c.compliance + mobility));
      c.force += change;
      x += mobility * change * c.normal;
    }
    const bool kept = s_.collision && s_.collision->keep(k, x);
    put(particle, x);
    return kept;
  }

  void finish(std::size_t k, const SlotOf<Real>& particle, Motion& sums) {
    const Vec3 x = place(particle);
    const Vec3 move = x - before(k);
    Vec3 velocity = move / options_.time_step;
    if (particle.mobility > 0) {
      const Vec3& drift = s_.velocities[k];
      sums.power += move.dot(move - drift) / static_cast<double>(particle.mobility);
      // A push is not a kick: what a closed contact moves comes to rest on it.
      for (const ClosableContact& c : s_.contacts.of(k))
        if (c.force > 0) velocity -= std::max(0.0, velocity.dot(c.normal)) * c.normal;
    }
    sums.largest_move = std::max(sums.largest_move, move.norm());
    put(s_.particles[k], x);
    s_.velocities[k] = velocity;
  }

  SolverState& s_;
  const StepOptions& options_;
  Stage<Real> stage_;
};

/// The first contact of a particle starts with what all of its former ones pushed with.
void pass_on(const Grouped<ClosableContact>& before, Grouped<ClosableContact>& now) {
  if (before.items.empty() || now.items.empty()) return;
  for_each_particle(now.first.size() - 1, [&](std::size_t k, std::size_t) {
    if (now.of(k).empty()) return;
    for (const ClosableContact& c : before.of(k)) now.of(k).front().force += c.force;
  });
}

}  // namespace

StepReport step(SolverState& state, std::span<const Contact> contacts, const StepOptions& options,
                std::span<const SpanContact> spans) {
  assert(options.time_step > 0 && options.iterations > 0);
  if (options.precision == Precision::kSingle &&
      (!state.layout.triangles.empty() || state.collision))
    throw std::invalid_argument(
        "elastic triangles and self-collision are swept in double precision only");
  Grouped<ClosableContact> closable = state.grouped(contacts);
  pass_on(state.contacts, closable);
  state.contacts = std::move(closable);
  state.take_spans(spans);
  if (std::exchange(state.relaxing, false)) state.rest();
  state.look_around();
  if (!options.keep_multipliers) state.forget_multipliers();
  return options.precision == Precision::kSingle ? Step(state, options, in_single(state)).take()
                                                 : Step(state, options, in_double(state)).take();
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
