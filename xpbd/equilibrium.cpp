#include "xpbd/equilibrium.hpp"

#include <cmath>
#include <utility>

#include "xpbd/coarse_space.hpp"
#include "xpbd/parallel.hpp"
#include "xpbd/unbalanced.hpp"

namespace vstent::xpbd {
namespace {

// Of the largest move: far enough for differences of forces to have digits, near enough to be a
// derivative.
constexpr double kProbe = 1e-4;
// The blocks that softness is the inverse of bound the stiffness from above; conjugate gradients
// want the mean. Measured: 2 takes the fewest iterations.
constexpr double kStep = 2;
// Halvings of a step that raises the energy before the search starts afresh.
constexpr int kHalvings = 12;
// Of the energy: what rounding may add to it.
constexpr double kRounding = 1e-12;

/// The sheet somewhere, and what holds there.
struct State {
  std::vector<Slot> particles, forces;
  std::vector<char> touching;  // on the surface
  std::vector<Vec3> normals;   // of the surface, where touching
  Tally tally;
  double energy = 0;  // of the loads as well

  explicit State(std::size_t count)
      : particles(count), forces(count), touching(count, 0), normals(count, Vec3::Zero()) {}
};

}  // namespace

struct Equilibrium::Implementation {
  ElasticSheet elastic;
  ContactField field;
  std::size_t count;
  CoarseSpace coarse;
  State now, trial;
  std::vector<char> held;      // touching, and pressed against the surface
  std::vector<Vec3> residual;  // forces that nothing balances
  std::vector<Vec3> answer, last_answer, direction, held_normals;
  std::vector<Vec3> sampled_at;
  std::vector<double> clearance;  // there
  std::vector<Softness> softness;
  ForceBalance balance;
  double last_product = 0;
  int since_renewal = -1;
  bool restart = true;
  std::vector<Vec3> positions;
  // Of the particles that may touch.
  std::vector<std::size_t> near;
  std::vector<Vec3> near_places;
  std::vector<Gap> gaps;

  Implementation(const Sheet& sheet, std::span<const Vec3> start, ContactField contact_field)
      : elastic(make_elastic_sheet(sheet)),
        field(std::move(contact_field)),
        count(start.size()),
        coarse(elastic, particles_of(elastic, sheet.positions)),
        now(count),
        trial(count),
        held(count, 0),
        residual(count, Vec3::Zero()),
        answer(count, Vec3::Zero()),
        last_answer(count, Vec3::Zero()),
        direction(count, Vec3::Zero()),
        held_normals(count, Vec3::Zero()),
        sampled_at(count, Vec3::Zero()),
        clearance(count, -1.0),
        positions(start.begin(), start.end()) {
    now.particles = particles_of(elastic, start);
    visit(now);
    weigh();
    give_positions();
  }

  template <class Value>
  double sum(const Value& value) const {
    std::vector<double> partial(chunks_of(count), 0.0);
    for_each_particle(count, [&](std::size_t k, std::size_t chunk) { partial[chunk] += value(k); });
    double total = 0;
    for (const double part : partial) total += part;
    return total;
  }

  double dot(const std::vector<Vec3>& a, const std::vector<Vec3>& b) const {
    return sum([&](std::size_t k) { return a[k].dot(b[k]); });
  }

  /// Puts what lies inside the body, and what is held on it, on its surface.
  void put_on_surface(State& state) {
    near.clear();
    for (std::size_t k = 0; k < count; ++k)
      if (elastic.free[k] &&
          (held[k] || (place(state.particles[k]) - sampled_at[k]).norm() >= clearance[k]))
        near.push_back(k);
    near_places.resize(near.size());
    gaps.resize(near.size());
    for (std::size_t n = 0; n < near.size(); ++n)
      near_places[n] = place(state.particles[near[n]]) + elastic.origin;
    field(near_places, gaps);
    std::fill(state.touching.begin(), state.touching.end(), 0);
    for (std::size_t n = 0; n < near.size(); ++n) {
      const std::size_t k = near[n];
      const Gap& gap = gaps[n];
      sampled_at[k] = place(state.particles[k]);
      clearance[k] = std::max(0.0, gap.distance);
      if (gap.normal.isZero() || !(held[k] || gap.distance < 0)) continue;
      state.touching[k] = 1;
      state.normals[k] = gap.normal;
      put(state.particles[k], sampled_at[k] - gap.distance * gap.normal);
      sampled_at[k] = place(state.particles[k]);
      clearance[k] = 0;
    }
  }

  void visit(State& state) {
    put_on_surface(state);
    state.tally = elastic_forces(elastic, state.particles, state.forces);
    state.energy = state.tally.energy;
    if (!elastic.load.empty())
      state.energy -=
          sum([&](std::size_t k) { return elastic.load[k].dot(place(state.particles[k])); });
  }

  /// What is unbalanced at the present places; particles that are pulled off the surface let go.
  void weigh() {
    std::vector<Unbalanced> parts(chunks_of(count));
    for_each_particle(count, [&](std::size_t k, std::size_t chunk) {
      residual[k].setZero();
      held[k] = 0;
      if (!elastic.free[k]) return;
      residual[k] = place(now.forces[k]);
      if (now.touching[k]) {
        const double push = -residual[k].dot(now.normals[k]);
        if (push > 0) {
          held[k] = 1;
          residual[k] += push * now.normals[k];
          parts[chunk].add_contact(push);
        }
      }
      parts[chunk].add(residual[k], elastic.layout.original[k]);
    });
    Unbalanced all;
    for (const Unbalanced& part : parts) all.merge(part);
    balance = all.conclude(now.tally);
  }

  /// Takes out what would lift a held particle off, or push it in.
  void keep_tangent(std::vector<Vec3>& moves, const State& state) const {
    for_each_particle(count, [&](std::size_t k, std::size_t) {
      if (held[k]) moves[k] -= state.normals[k].dot(moves[k]) * state.normals[k];
    });
  }

  void renew() {
    softness = measure_softness(elastic, now.particles);
    for (std::size_t k = 0; k < count; ++k)
      held_normals[k] = held[k] ? now.normals[k] : Vec3::Zero();
    coarse.update(elastic, now.particles, held_normals);
    since_renewal = 0;
    restart = true;
  }

  /// The motion that would balance the residual, about.
  void precondition() {
    for_each_particle(count, [&](std::size_t k, std::size_t) {
      if (!elastic.free[k]) return;
      answer[k] = kStep * (softness[k] * residual[k]);
      if (!held[k]) return;
      // The same stiffness, with the normal held.
      const Vec3 yielding = softness[k] * now.normals[k];
      const double give = yielding.dot(now.normals[k]);
      if (give > 0) answer[k] -= now.normals[k].dot(answer[k]) / give * yielding;
    });
    coarse.add_answer(residual, answer);
    keep_tangent(answer, now);
  }

  double largest(const std::vector<Vec3>& moves) const {
    std::vector<double> partial(chunks_of(count), 0.0);
    for_each_particle(count, [&](std::size_t k, std::size_t chunk) {
      partial[chunk] = std::max(partial[chunk], moves[k].squaredNorm());
    });
    return std::sqrt(*std::max_element(partial.begin(), partial.end()));
  }

  void lead(State& to, double share) const {
    for_each_particle(count, [&](std::size_t k, std::size_t) {
      put(to.particles[k], place(now.particles[k]) + share * direction[k]);
    });
  }

  /// Second derivative of the energy along the direction, on the surface.
  double curvature(double share) {
    lead(trial, share);
    visit(trial);
    return sum([&](std::size_t k) {
             Vec3 there = place(trial.forces[k]);
             if (held[k]) there -= there.dot(trial.normals[k]) * trial.normals[k];
             return elastic.free[k] ? direction[k].dot(residual[k] - there) : 0.0;
           }) /
           share;
  }

  RelaxReport iterate(const EquilibriumOptions& options) {
    if (since_renewal < 0 || since_renewal >= options.renewal) renew();
    ++since_renewal;
    std::swap(answer, last_answer);
    precondition();
    const double product = dot(residual, answer);
    const double conjugate = dot(residual, last_answer);
    const double beta = std::exchange(restart, false) || !(last_product > 0)
                            ? 0
                            : std::max(0.0, (product - conjugate) / last_product);
    last_product = product;
    for_each_particle(
        count, [&](std::size_t k, std::size_t) { direction[k] = answer[k] + beta * direction[k]; });
    keep_tangent(direction, now);
    double slope = dot(direction, residual);
    if (!(slope > 0)) {
      direction = answer;
      slope = product;
    }
    RelaxReport report{0, balance};
    const double reach = largest(direction);
    if (!(slope > 0) || !(reach > 0)) return report;

    const double most = options.largest_move / reach;
    const double curved = curvature(kProbe * most);
    double share = curved > 0 ? std::min(slope / curved, most) : most;
    const double limit = now.energy + kRounding * std::abs(now.energy);
    for (int halving = 0;; ++halving, share /= 2) {
      lead(trial, share);
      visit(trial);
      if (trial.energy <= limit || halving == kHalvings) break;
      restart = true;
    }
    std::swap(now, trial);
    weigh();
    give_positions();
    report.largest_move = share * reach;
    report.balance = balance;
    return report;
  }

  void give_positions() {
    for_each_particle(count, [&](std::size_t k, std::size_t) {
      if (elastic.free[k])
        positions[at(elastic.layout.original[k])] = place(now.particles[k]) + elastic.origin;
    });
  }
};

Equilibrium::Equilibrium(const Sheet& sheet, std::span<const Vec3> start, ContactField field)
    : implementation_(std::make_unique<Implementation>(sheet, start, std::move(field))) {}
Equilibrium::~Equilibrium() = default;
Equilibrium::Equilibrium(Equilibrium&&) noexcept = default;

RelaxReport Equilibrium::iterate(const EquilibriumOptions& options) {
  return implementation_->iterate(options);
}

std::span<const Vec3> Equilibrium::positions() const { return implementation_->positions; }
ForceBalance Equilibrium::balance() const { return implementation_->balance; }

std::vector<Vec3> Equilibrium::contact_forces() const {
  const Implementation& i = *implementation_;
  std::vector<Vec3> forces(i.count, Vec3::Zero());
  for (std::size_t k = 0; k < i.count; ++k) {
    const Vec3& normal = i.now.normals[k];
    if (i.held[k])
      forces[at(i.elastic.layout.original[k])] = -place(i.now.forces[k]).dot(normal) * normal;
  }
  return forces;
}

}  // namespace vstent::xpbd
