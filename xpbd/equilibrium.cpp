#include "xpbd/equilibrium.hpp"

#include <tbb/parallel_invoke.h>

#include <cmath>
#include <numeric>
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
// Of the room between walls: what a step may take, before the body's surface turns it.
constexpr double kRoomToTurn = 0.9;
// Share of the places where the sheet pushes itself that come or go until its stiffness is another,
// and the iterations that one look at it serves at least.
constexpr double kMorePushing = 0.2;
constexpr int kLeastRenewal = 5;
// Of what is unbalanced with friction's limits as they were: what their own error may come to.
constexpr double kLagging = 0.5;
// Of a step: what may be foretold of it from the forces at its other end.
constexpr double kForetold = 0.3;
// Looks in which the body may push the sheet out of itself before the search begins.
constexpr int kLooks = 100;

/// The sheet somewhere, and what holds there.
struct State {
  std::vector<Slot> particles, forces;
  std::vector<char> touching;  // on the surface
  std::vector<Vec3> normals;   // of the surface, where touching
  int kept_inside = 0;         // by the sheet itself
  double pushing = 0;          // places where it pushes itself
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
  std::optional<SelfCollision> collision;
  std::optional<Friction> friction;
  std::vector<double> pushes_of_body;  // N, by particle, 0 where it does not touch
  double lagging = 0;                  // of friction's limits: squares of what forces lack, N^2
  double unbalanced = 0;               // squares of what is left with these limits, N^2
  State now, trial;
  std::vector<char> held, last_held;          // touching, and pressed against the surface
  std::vector<Vec3> residual, last_residual;  // forces that nothing balances
  double ahead = 0;        // share of the direction by which `residual` is foretold, from here
  std::vector<Vec3> owed;  // that share, once there is another direction
  double usual_share = 0;  // the best of the last direction, 0: not known
  std::vector<Vec3> answer, last_answer, direction, held_normals;
  std::vector<Vec3> sampled_at;
  std::vector<double> clearance;  // there
  std::vector<Softness> softness;
  ForceBalance balance;
  double last_product = 0;
  int since_renewal = -1;
  double pushing_at_renewal = 0;
  bool restart = true;
  std::vector<Vec3> positions;  // by vertex, when last asked for
  // Of the particles that may touch.
  std::vector<std::vector<std::size_t>> near_of_chunk;
  std::vector<std::size_t> near;
  std::vector<Vec3> near_places;
  std::vector<Gap> gaps;

  Implementation(const Sheet& sheet, std::span<const Vec3> start, ContactField contact_field,
                 FrictionLaw law, std::span<const Vec3> anchors)
      : elastic(make_elastic_sheet(sheet)),
        field(std::move(contact_field)),
        count(start.size()),
        coarse(elastic, particles_of(elastic, sheet.positions)),
        now(count),
        trial(count),
        held(count, 0),
        last_held(count, 0),
        residual(count, Vec3::Zero()),
        last_residual(count, Vec3::Zero()),
        owed(count, Vec3::Zero()),
        answer(count, Vec3::Zero()),
        last_answer(count, Vec3::Zero()),
        direction(count, Vec3::Zero()),
        held_normals(count, Vec3::Zero()),
        sampled_at(count, Vec3::Zero()),
        clearance(count, -1.0),
        positions(start.begin(), start.end()) {
    now.particles = particles_of(elastic, start);
    if (sheet.surface) {
      collision.emplace(sheet, elastic, particles_of(elastic, sheet.positions));
      collision->look(now.particles);
    }
    visit(now);
    for (int n = 0; now.kept_inside > 0 && n < kLooks; ++n) {
      collision->look(now.particles);
      visit(now);
    }
    if (law.coefficient > 0) {
      pushes_of_body.assign(count, 0.0);
      friction.emplace(law, count);
      if (!anchors.empty()) take_anchors(anchors);
    }
    weigh();
    if (friction) {
      friction->renew(pushes_of_body);
      visit(now);
      weigh();
    }
  }

  void take_anchors(std::span<const Vec3> anchors) {
    std::vector<Vec3> places(count);
    for (std::size_t k = 0; k < count; ++k) places[k] = anchors[at(elastic.layout.original[k])];
    std::vector<Gap> at_anchors(count);
    field(places, at_anchors);
    for (std::size_t k = 0; k < count; ++k)
      if (now.touching[k] && !at_anchors[k].normal.isZero())
        friction->anchor(
            k, places[k] - at_anchors[k].distance * at_anchors[k].normal - elastic.origin);
  }

  /// Sums of the values of all particles.
  template <class Value>
  auto sum(const Value& value) const {
    using Sum = decltype(value(std::size_t{}));
    std::vector<Sum> partial(chunks_of(count), Sum{});
    for_each_particle(count, [&](std::size_t k, std::size_t chunk) { partial[chunk] += value(k); });
    Sum total{};
    for (const Sum& part : partial) total += part;
    return total;
  }

  /// The particles that may touch, and where they are.
  void find_near(const State& state) {
    near_of_chunk.resize(chunks_of(count));
    for (std::vector<std::size_t>& part : near_of_chunk) part.clear();
    for_each_particle(count, [&](std::size_t k, std::size_t chunk) {
      if (elastic.free[k] &&
          (held[k] || (place(state.particles[k]) - sampled_at[k]).norm() >= clearance[k]))
        near_of_chunk[chunk].push_back(k);
    });
    near.clear();
    for (const std::vector<std::size_t>& part : near_of_chunk)
      near.insert(near.end(), part.begin(), part.end());
    near_places.resize(near.size());
    for_each_particle(near.size(), [&](std::size_t n, std::size_t) {
      near_places[n] = place(state.particles[near[n]]) + elastic.origin;
    });
  }

  /// Puts what lies inside the body, and what is held on it, on its surface.
  void put_on_surface(State& state) {
    find_near(state);
    gaps.resize(near.size());
    field(near_places, gaps);
    std::fill(state.touching.begin(), state.touching.end(), 0);
    std::vector<int> kept_inside(chunks_of(near.size()), 0);
    for_each_particle(near.size(), [&](std::size_t n, std::size_t chunk) {
      const std::size_t k = near[n];
      const Gap& gap = gaps[n];
      sampled_at[k] = place(state.particles[k]);
      clearance[k] = std::max(0.0, gap.distance);
      if (gap.normal.isZero() || !(held[k] || gap.distance < 0)) return;
      Vec3 on_surface = sampled_at[k] - gap.distance * gap.normal;
      const bool kept = collision && collision->keep_pushed(k, on_surface);
      kept_inside[chunk] += kept;
      state.touching[k] = !kept;
      state.normals[k] = gap.normal;
      put(state.particles[k], on_surface);
      sampled_at[k] = on_surface;
      clearance[k] = 0;
    });
    state.kept_inside = std::accumulate(kept_inside.begin(), kept_inside.end(), 0);
  }

  void visit(State& state) {
    put_on_surface(state);
    state.tally = elastic_forces(elastic, state.particles, state.forces);
    if (collision) {
      const Tally pushed = collision->add_forces(state.particles, state.forces);
      state.pushing = pushed.carried;
      add(pushed, state.tally);
    }
    if (friction)
      state.tally.energy += friction->add_forces(state.particles, state.touching, state.forces);
    state.energy = state.tally.energy;
    if (!elastic.load.empty())
      state.energy -=
          sum([&](std::size_t k) { return elastic.load[k].dot(place(state.particles[k])); });
  }

  /// What is unbalanced at the present places; particles that are pulled off the surface let go.
  void weigh() {
    std::vector<Unbalanced> parts(chunks_of(count));
    std::vector<double> lacks(chunks_of(count), 0.0), left(chunks_of(count), 0.0);
    for_each_particle(count, [&](std::size_t k, std::size_t chunk) {
      residual[k].setZero();
      held[k] = 0;
      if (!elastic.free[k]) return;
      residual[k] = place(now.forces[k]);
      double push = 0;
      if (now.touching[k]) {
        push = std::max(0.0, -residual[k].dot(now.normals[k]));
        if (push > 0) {
          held[k] = 1;
          residual[k] += push * now.normals[k];
          parts[chunk].add_contact(push);
        }
      }
      Vec3 unbalanced_force = residual[k];
      if (friction) {
        const Vec3 here = place(now.particles[k]);
        pushes_of_body[k] = push;
        if (!held[k])
          friction->let_go(k);
        else if (!friction->anchored(k))
          friction->anchor(k, here);
        const Vec3 lack = friction->missing(k, here, push);
        unbalanced_force += lack;
        lacks[chunk] += lack.squaredNorm();
        left[chunk] += residual[k].squaredNorm();
      }
      parts[chunk].add(unbalanced_force, elastic.layout.original[k]);
    });
    Unbalanced all;
    for (const Unbalanced& part : parts) all.merge(part);
    balance = all.conclude(now.tally);
    lagging = std::accumulate(lacks.begin(), lacks.end(), 0.0);
    unbalanced = std::accumulate(left.begin(), left.end(), 0.0);
  }

  /// Takes out what would lift a held particle off, or push it in.
  void keep_tangent(std::size_t k, Vec3& move) const {
    if (held[k]) move -= now.normals[k].dot(move) * now.normals[k];
  }

  void renew() {
    std::vector<Link> links = collision ? collision->links(now.particles) : std::vector<Link>();
    if (friction) {
      friction->renew(pushes_of_body);
      visit(now);
      weigh();
      friction->add_links(now.particles, links);
    }
    for_each_particle(count, [&](std::size_t k, std::size_t) {
      held_normals[k] = held[k] ? now.normals[k] : Vec3::Zero();
    });
    softness = measure_softness(elastic, now.particles, links);
    coarse.update(elastic, now.particles, held_normals, links);
    since_renewal = 0;
    pushing_at_renewal = now.pushing;
    restart = true;
  }

  bool is_outdated(int renewal) const {
    return since_renewal < 0 || since_renewal >= renewal ||
           (since_renewal >= kLeastRenewal &&
            (std::abs(now.pushing - pushing_at_renewal) > kMorePushing * pushing_at_renewal ||
             lagging > kLagging * unbalanced));
  }

  /// Works of the residual along the motion that would balance it, about, and along the last one.
  struct Works {
    double present = 0, last = 0;
    void operator+=(const Works& w) { present += w.present, last += w.last; }
  };
  Works precondition() {
    Eigen::VectorXd together;
    const auto one_by_one = [&](std::size_t k, std::size_t) {
      if (!elastic.free[k]) return;
      answer[k] = kStep * (softness[k] * residual[k]);
      if (!held[k]) return;
      // The same stiffness, with the normal held.
      const Vec3 yielding = softness[k] * now.normals[k];
      const double give = yielding.dot(now.normals[k]);
      if (give > 0) answer[k] -= now.normals[k].dot(answer[k]) / give * yielding;
    };
    tbb::parallel_invoke([&] { together = coarse.answer(residual); },
                         [&] { for_each_particle(count, one_by_one); });
    return sum([&](std::size_t k) {
      answer[k] += coarse.move(together, k);
      keep_tangent(k, answer[k]);
      return Works{residual[k].dot(answer[k]), residual[k].dot(last_answer[k])};
    });
  }

  /// Of a direction: what the residual works along it, and the square of its largest move.
  struct Course {
    double slope = 0, square = 0;
    void operator+=(const Course& c) { slope += c.slope, square = std::max(square, c.square); }
  };
  /// The present answer's, and `beta` times the direction there was.
  Course turn(double beta) {
    return sum([&](std::size_t k) {
      owed[k] = ahead * direction[k];
      keep_tangent(k, owed[k]);
      direction[k] = beta == 0 ? answer[k] : Vec3(answer[k] + beta * direction[k]);
      keep_tangent(k, direction[k]);
      return Course{residual[k].dot(direction[k]), direction[k].squaredNorm()};
    });
  }

  /// Takes the residual as it is here.
  void foretell_nothing() {
    if (std::exchange(ahead, 0.0) != 0) weigh();
  }

  /// The next direction, conjugate to the last one if `beta` is not 0.
  Course choose_direction(double& beta) {
    for (;;) {
      if (restart) foretell_nothing();
      std::swap(answer, last_answer);
      Works work = precondition();
      beta = std::exchange(restart, false) || !(last_product > 0)
                 ? 0
                 : std::max(0.0, (work.present - work.last) / last_product);
      if (beta == 0 && ahead != 0) {
        foretell_nothing();
        work = precondition();
      }
      last_product = work.present;
      const Course course = turn(beta);
      if (course.slope > 0 || beta == 0) return course;
      restart = true;
    }
  }

  /// What may be taken of a share of the direction between two looks for what is near, after one
  /// more look if need be: a little less, for what is put back on the surface.
  double share_apart(double share) {
    const auto allowed = [&] {
      return kRoomToTurn * collision->allowed(now.particles, direction, share / kRoomToTurn);
    };
    if (const double at_once = allowed(); at_once >= share) return share;
    collision->look(now.particles);
    return allowed();
  }

  void lead(State& to, double share) const {
    for_each_particle(count, [&](std::size_t k, std::size_t) {
      put(to.particles[k], place(now.particles[k]) + share * direction[k]);
    });
  }

  /// What the energy may come to.
  double limit() const { return now.energy + kRounding * std::abs(now.energy); }

  void move_on() {
    std::swap(now, trial);
    std::swap(residual, last_residual);
    std::swap(held, last_held);
    weigh();
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

  /// Goes where the energy is least along the direction, as its curvature here says, or less far.
  double step_by_curvature(const Course& course, double most) {
    const double curved = curvature(kProbe * most);
    double share = curved > 0 ? std::min(course.slope / curved, most) : most;
    if (collision) {
      share = share_apart(share);
      if (!(share > 0)) return 0;
    }
    for (int halving = 0;; ++halving, share /= 2) {
      lead(trial, share);
      visit(trial);
      if (trial.energy <= limit() || halving == kHalvings) break;
      restart = true;
    }
    move_on();
    return share;
  }

  /// Goes by about as much of the direction as was best of the last one, which takes one look where
  /// the curvature takes two. What the forces there show to be missing is gone with the next step,
  /// and the residual is foretold for it: shares differ by little, and as long as forces are
  /// linear, this is the same search. 0, and nothing done, where the energy would rise.
  double step_as_usual(const Course& course, double most) {
    const double share = std::min(usual_share, most);
    for_each_particle(count, [&](std::size_t k, std::size_t) {
      put(trial.particles[k], place(now.particles[k]) + owed[k] + share * direction[k]);
    });
    visit(trial);
    if (trial.energy > limit()) return 0;
    move_on();
    ahead = 0;
    const double slope = sum([&](std::size_t k) { return direction[k].dot(residual[k]); });
    if (!(slope < course.slope)) return share;
    const double missing = std::min(most, share * course.slope / (course.slope - slope)) - share;
    usual_share = share + missing;
    if (std::abs(missing) > kForetold * share) {
      lead(trial, missing);
      visit(trial);
      if (trial.energy <= limit()) move_on();
      return share;
    }
    ahead = missing;
    for_each_particle(count, [&](std::size_t k, std::size_t) {
      if (held[k] != last_held[k]) return;
      residual[k] += missing / share * (residual[k] - last_residual[k]);
      keep_tangent(k, residual[k]);
    });
    return share;
  }

  RelaxReport iterate(const EquilibriumOptions& options) {
    if (now.kept_inside > 0) {
      collision->look(now.particles);
      visit(now);
      weigh();
      restart = true;
    }
    if (is_outdated(options.renewal)) renew();
    ++since_renewal;
    double beta = 0;
    const Course course = choose_direction(beta);
    const double reach = std::sqrt(course.square);
    if (!(course.slope > 0) || !(reach > 0)) return {0, balance};
    const double most = options.largest_move / reach;
    const bool is_usual = beta > 0 && usual_share > 0 && !collision && !friction;
    double share = is_usual ? step_as_usual(course, most) : 0;
    if (share == 0 && ahead != 0) {  // the direction was chosen for elsewhere
      restart = true;
      return iterate(options);
    }
    if (share == 0) {
      share = step_by_curvature(course, most);
      if (beta > 0 && !restart) usual_share = share;
    }
    return {share * reach, balance};
  }

  void give_positions() {
    for_each_particle(count, [&](std::size_t k, std::size_t) {
      if (elastic.free[k])
        positions[at(elastic.layout.original[k])] = place(now.particles[k]) + elastic.origin;
    });
  }
};

Equilibrium::Equilibrium(const Sheet& sheet, std::span<const Vec3> start, ContactField field,
                         FrictionLaw friction, std::span<const Vec3> anchors)
    : implementation_(
          std::make_unique<Implementation>(sheet, start, std::move(field), friction, anchors)) {}
Equilibrium::~Equilibrium() = default;
Equilibrium::Equilibrium(Equilibrium&&) noexcept = default;

RelaxReport Equilibrium::iterate(const EquilibriumOptions& options) {
  return implementation_->iterate(options);
}

std::span<const Vec3> Equilibrium::positions() const {
  implementation_->give_positions();
  return implementation_->positions;
}

ForceBalance Equilibrium::balance() const { return implementation_->balance; }

std::vector<Vec3> Equilibrium::anchors() const {
  const Implementation& i = *implementation_;
  const std::span<const Vec3> here = positions();
  std::vector<Vec3> anchors(here.begin(), here.end());
  if (!i.friction) return anchors;
  const std::vector<Vec3> dragged = i.friction->dragged(i.now.particles);
  for (std::size_t k = 0; k < dragged.size(); ++k)
    anchors[at(i.elastic.layout.original[k])] = dragged[k] + i.elastic.origin;
  return anchors;
}

std::vector<Push> Equilibrium::pushes() const {
  const Implementation& i = *implementation_;
  return i.collision ? by_vertex(i.collision->pushes(i.now.particles), i.elastic)
                     : std::vector<Push>();
}

bool Equilibrium::is_near_itself() const {
  return implementation_->collision && implementation_->collision->watched() > 0;
}

int Equilibrium::kept_inside() const { return implementation_->now.kept_inside; }

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
