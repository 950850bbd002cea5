#include "deployment/deploy.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "deployment/give_way.hpp"
#include "deployment/stent_contact.hpp"
#include "deployment/wall_levels.hpp"
#include "vessels/check.hpp"
#include "vessels/error.hpp"
#include "xpbd/equilibrium.hpp"
#include "xpbd/lead_apart.hpp"

namespace vstent::deployment {
namespace {

// The paper's constants are in centimetres and grams; a spring of 1e5 g/s^2 is 1e5 dyn/cm = 0.1
// N/mm, and a hinge of 1e3 g cm^2/s^2 = 1e3 erg is 0.1 N mm.
constexpr xpbd::UniformStiffness kPaperWall{0.1, 0.1};
// Of a voxel: what may be missing at rest to what the wall is let into struts.
constexpr double kSinkTolerance = 0.2;
// While settling the wall moves so little that contacts found once serve several iterations.
constexpr int kSettlingIterations = 10;
// Rounds of them without a tenth less of the residual: the search has come to its end, balanced or
// not. On a coarse wall the next one goes on from there; on the patch the run has failed.
constexpr int kStalledRounds = 50;
// Force balance that is good enough for a shape that a finer wall, or a stent of struts, takes
// over.
constexpr double kRough = 0.02;
// On the coarsest wall, which is cheap: the wall finds one and the same place on the stent whatever
// the way there.
constexpr double kExact = 1e-4;
// Of a coarse wall's edges: by how much the stent's ends are rounded for it. On a sharper edge
// every row of vertices that slides over it is caught, and where the wall comes to rest depends on
// how it came.
constexpr double kEdgeRounding = 2;
// Time steps in which walls that come near each other may follow one step of growth.
constexpr int kStepsApart = 20;
// Of the contact force: what may push a stent that gives way without being balanced. On the
// coarsest wall, where looks are cheap, its axis then lies within 0.1 % of its radius of its rest.
constexpr double kStentAtRest = 2e-4;
constexpr double kStentBalanced = 2e-3;
// While it is looked for: how well the wall settles, but better the nearer it is; rounds without
// progress, of one wall; and looks without.
constexpr double kLook = 1e-3;
constexpr double kLookOfUnbalanced = 0.05;
constexpr int kStalledLook = 5;
constexpr int kStalledLooks = 12;
// k dt^2/m; with kept multipliers and two sweeps or more this stays stable.
constexpr double kKappa = 1.0;
// Of the stent's radius: the way on which friction takes hold.
constexpr double kSlip = 1e-4;
// In a step with friction; the first ones meet next to no wall, and what little pushes there need
// not balance.
constexpr int kIterationsWithFriction = 200;

struct Wall {
  WallMesh mesh;
  xpbd::Sheet sheet;
  double edge_length = 0;  // mm, mean at rest
};

Wall make_wall(const Setup& setup, WallMesh mesh) {
  const Case& c = setup.specification;
  Wall wall{std::move(mesh), {}, 0};
  const WallMesh& m = wall.mesh;
  if (c.paper_wall()) {
    wall.sheet = xpbd::make_sheet(m.points, m.triangles, m.pinned, kPaperWall);
  } else {
    // A plate bends over wavelengths longer than it is thick. Into a cell, over a strut, the
    // lumen's surface gives way as soft tissue does: it is bent as a sheet no thicker than it is
    // finely cut.
    const xpbd::Membrane membrane{
        .poisson_ratio = *c.poisson_ratio,
        .model = c.membrane,
        .bending_thickness = setup.has_struts() ? *c.patch_edge_length : 0};
    wall.sheet = xpbd::make_sheet(
        m.points, m.triangles, m.pinned,
        xpbd::VariableMembrane{m.material.youngs_modulus, m.material.thickness, membrane});
  }
  if (*c.self_collision) wall.sheet.surface = surface_of(m);
  if (c.tissue_support > 0) xpbd::support(wall.sheet, m.triangles, c.tissue_support);
  for (const Triangle& t : m.triangles)
    for (std::size_t k = 0; k < 3; ++k)
      wall.edge_length += (m.points[static_cast<std::size_t>(t[(k + 1) % 3])] -
                           m.points[static_cast<std::size_t>(t[k])])
                              .norm() /
                          static_cast<double>(3 * m.triangles.size());
  return wall;
}

/// The patch, and before it coarser walls.
std::vector<Wall> make_walls(const Setup& setup) {
  WallMesh patch = patch_of(setup);
  std::vector<Wall> walls;
  for (const double spacing : setup.level_spacings)
    walls.push_back(make_wall(setup, coarsened(patch, spacing)));
  walls.push_back(make_wall(setup, std::move(patch)));
  return walls;
}

std::size_t crossings(const Wall& wall, const std::vector<Vec3>& places) {
  return vessels::self_intersections({places, wall.mesh.triangles}).size();
}
std::size_t crossings_at_rest(const Wall& wall) { return crossings(wall, wall.mesh.points); }

void require_numbers(std::span<const Vec3> positions, const vessels::Region& region, int step) {
  for (std::size_t i = 0; i < positions.size(); ++i) {
    if (!positions[i].allFinite()) {
      throw Error(ExitCode::numerical, "step " + std::to_string(step) + ": vertex " +
                                           std::to_string(region.vertices[i]) +
                                           " has no finite position any more; try a smaller "
                                           "growth_per_step or a stiffer contact");
    }
  }
}

/// One deployment: the steps in turn, recorded and shown to the observer as they come.
class Run {
 public:
  Run(const Setup& setup, const Observer& observe)
      : setup_(setup),
        case_(setup.specification),
        observe_(observe),
        stent_(setup),
        walls_(make_walls(setup)) {
    for (std::size_t level = 0; level + 1 < walls_.size(); ++level)
      finer_.emplace_back(walls_[level].mesh, walls_[level + 1].mesh);
    if (case_.gives_way) gives_.emplace(setup);
  }

  Outcome finish() {
    if (case_.friction > 0)
      grow_with_friction();
    else
      grow();
    if (gives_) stent_.reshape(gives_->envelope());
    for (; level_ + 1 < walls_.size(); ++level_) {
      if (level_ == 0) give_way();
      settle_on_surface(level_ == 0 ? kExact : kRough, edge_rounding());
      hand_on();
    }
    if (!stent_.rigid()) {
      settle_by_relaxation();
    } else if (!setup_.has_struts()) {
      give_way();
      settle_on_surface(*case_.tolerance);
    } else {
      // Coarser walls, where there are any, have brought it to rest.
      if (walls_.size() == 1) give_way();
      if (gives_) stent_.reshape(inflated(setup_, at_rest(), 1));
      if (rests_on_balloon_) {
        settle_on_surface(kRough);
        if (!gives_ && crossings(walls_.back(), places_) > crossings_at_rest(walls_.back()))
          return grown_on_patch_alone();
      }
      stent_.deflate(at_rest());
      if (stent_.on_struts())
        settle_by_relaxation();
      else
        settle_on_surface(*case_.tolerance);
    }
    if (gives_) judge_stent();
    require_room();
    outcome_.self_contact = self_contact(setup_, pushes_, places_, stent_.state().axis);
    outcome_.patch = std::move(places_);
    outcome_.nominal_radii = stent_state(setup_, 1).radii;
    StentState final_state = at_rest();
    outcome_.axis = final_state.axis;
    outcome_.radii = final_state.radii;
    outcome_.stent = shape_of(setup_, final_state);
    outcome_.struts = std::move(final_state.struts);
    outcome_.surface = std::move(final_state.surface);
    return std::move(outcome_);
  }

 private:
  /// A wall that comes to rest on the smooth balloon slides along it, and from a narrow throat it
  /// folds. One that grows with it in small steps, and is handed to the struts as it is, does not.
  Outcome grown_on_patch_alone() {
    const Setup alone = on_patch_alone(setup_);
    Run again(alone, observe_);
    again.rests_on_balloon_ = false;
    again.outcome_.history = std::move(outcome_.history);
    return again.finish();
  }

  /// Algorithm 1 of the paper on the coarsest wall.
  void grow() {
    Wall& wall = walls_.front();
    xpbd::StepOptions options;
    options.iterations = *case_.iterations;
    options.velocity_limit = stent_.step_limit();
    options.adaptive_damping = true;
    xpbd::scale_masses(wall.sheet, options.time_step, kKappa);
    xpbd::Solver solver(wall.sheet);
    const int steps = growth_steps(setup_);
    for (int step = 1; step <= steps; ++step) {
      StepRecord record;
      record.expansion = static_cast<double>(step) / steps;
      stent_.grow(inflated(setup_, stent_state(setup_, record.expansion), record.expansion),
                  step < steps);
      stent_.find(solver.positions(), wall.mesh.pinned);
      // Walls that must not meet go as far as they may; then they are looked at again.
      for (int n = 0; n < kStepsApart; ++n) {
        const xpbd::StepReport moved = solver.step(stent_.vertices(), options);
        record.largest_move = std::max(record.largest_move, moved.largest_move);
        if (moved.kept_apart == 0) break;
        stent_.find(solver.positions(), wall.mesh.pinned);
      }
      record.self_contacts = static_cast<int>(solver.pushes().size());
      places_.assign(solver.positions().begin(), solver.positions().end());
      note(record, solver.balance(stent_.vertices(), relaxation().contact_tolerance));
    }
  }

  /// The next wall takes over the places, but not where it would pass through itself.
  void hand_on() {
    std::vector<Vec3> places = finer_[level_](places_);
    const Wall& next = walls_[level_ + 1];
    if (near_itself_ && crossings(next, places) > crossings_at_rest(next))
      places = xpbd::lead_apart(next.sheet, places);
    places_ = std::move(places);
    if (!anchors_.empty()) anchors_ = finer_[level_](anchors_);
  }

  /// \throws Error where the stent has pressed the wall against wall that cannot give way
  void require_room() const {
    if (kept_inside_ == 0) return;
    throw Error(ExitCode::geometry,
                "the stent does not reach its size: " + std::to_string(kept_inside_) +
                    " vertices of the wall stay inside it, because other wall behind them is held; "
                    "let more of it move (/patch/margin), take a smaller stent, or set "
                    "/wall/self_collision to false");
  }

  /// Where the wall sticks depends on where it touched first: it is in balance at every step.
  void grow_with_friction() {
    const Wall& wall = walls_.front();
    places_ = wall.sheet.positions;
    const int steps = growth_steps(setup_);
    for (int step = 1; step <= steps; ++step) {
      StepRecord record;
      record.expansion = static_cast<double>(step) / steps;
      stent_.reshape(stent_state(setup_, record.expansion));
      xpbd::Equilibrium equilibrium = on_surface(edge_rounding());
      for (int i = 0; i < kIterationsWithFriction && equilibrium.balance().relative > kRough; ++i) {
        const xpbd::RelaxReport report = equilibrium.iterate({.largest_move = wall.edge_length});
        record.largest_move = std::max(record.largest_move, report.largest_move);
      }
      take_places(equilibrium);
      note(record, equilibrium.balance());
    }
  }

  xpbd::Equilibrium on_surface(double edge_radius) const {
    const xpbd::FrictionLaw friction{case_.friction, kSlip * setup_.stent.diameter / 2};
    return {walls_[level_].sheet, places_, stent_.exact_surface(edge_radius), friction, anchors_};
  }

  void take_places(const xpbd::Equilibrium& equilibrium) {
    const std::span<const Vec3> places = equilibrium.positions();
    places_.assign(places.begin(), places.end());
    if (case_.friction > 0) anchors_ = equilibrium.anchors();
  }

  StentState at_rest() const { return gives_ ? gives_->at_rest() : stent_state(setup_, 1); }

  bool may_go_on() const { return settling_steps_ < *case_.max_settling_steps; }

  void settle_on_surface(double tolerance, double edge_radius = 0,
                         int most_stalled = kStalledRounds) {
    const Wall& wall = walls_[level_];
    xpbd::Equilibrium equilibrium = on_surface(edge_radius);
    outcome_.converged = false;
    near_itself_ = equilibrium.is_near_itself();
    double least = std::numeric_limits<double>::infinity();
    for (int stalled = 0; !outcome_.converged && may_go_on() && stalled < most_stalled; ++stalled) {
      StepRecord record;
      record.settling = true;
      for (int i = 0; i < kSettlingIterations && !outcome_.converged; ++i) {
        const xpbd::RelaxReport report = equilibrium.iterate({.largest_move = wall.edge_length});
        record.largest_move = std::max(record.largest_move, report.largest_move);
        outcome_.converged = report.balance.relative <= tolerance && equilibrium.kept_inside() == 0;
      }
      near_itself_ = near_itself_ || equilibrium.is_near_itself();
      kept_inside_ = equilibrium.kept_inside();
      pushes_ = equilibrium.pushes();
      record.self_contacts = static_cast<int>(pushes_.size());
      take_places(equilibrium);
      if (gives_) contact_forces_ = equilibrium.contact_forces();
      note(record, equilibrium.balance());
      if (equilibrium.balance().relative < 0.9 * least) {
        least = equilibrium.balance().relative;
        stalled = -1;
      }
    }
  }

  void judge_stent() {
    outcome_.given_way = gives_->report();
    outcome_.converged = outcome_.converged && outcome_.given_way->unbalanced <= kStentBalanced;
  }

  double edge_rounding() const { return kEdgeRounding * walls_[level_].edge_length; }

  /// Wall and stent settle in turn until forces balance on both. On sharp edges, where rows of
  /// vertices are caught and let go, forces would jump.
  void give_way() {
    if (!gives_) return;
    gives_->new_wall();
    const double sought = level_ == 0 ? kStentAtRest : kStentBalanced;
    double tolerance = kLook;
    double least = std::numeric_limits<double>::infinity();
    for (int stalled = 0; may_go_on(); ++stalled) {
      stent_.reshape(gives_->envelope());
      settle_on_surface(tolerance, edge_rounding(), kStalledLook);
      gives_->settled(places_, contact_forces_, outcome_.history.back().energy);
      const double unbalanced = gives_->report().unbalanced;
      if (unbalanced <= sought || stalled > kStalledLooks) return;
      if (unbalanced < 0.9 * least) {
        least = unbalanced;
        stalled = -1;
      }
      tolerance = std::clamp(kLookOfUnbalanced * unbalanced, kExact, kLook);
      if (stalled == kStalledLooks) {
        gives_->new_wall();  // back to the best place
      } else {
        gives_->move_on();
      }
    }
  }

  xpbd::RelaxOptions relaxation() const {
    return {.step = 1.3,
            .largest_move = stent_.step_limit(),
            .contact_tolerance = 2e-3 * stent_.step_limit()};
  }

  /// On struts, whose contacts lie between vertices, and on soft stents.
  void settle_by_relaxation() {
    const Wall& wall = walls_.back();
    xpbd::Solver solver(wall.sheet);
    solver.set_positions(places_);
    const auto find = [&] {
      if (stent_.on_struts())
        stent_.find_on_struts(solver.positions());
      else
        stent_.find(solver.positions(), wall.mesh.pinned);
    };
    const xpbd::RelaxOptions options = relaxation();
    outcome_.converged = false;
    while (!outcome_.converged && may_go_on()) {
      StepRecord record;
      record.settling = true;
      find();
      record.deepest = stent_.deepest();
      xpbd::ForceBalance balance;
      double moved = 0;
      for (int i = 0; i < kSettlingIterations; ++i) {
        if (moved > stent_.safe_move()) {
          find();
          moved = 0;
        }
        const xpbd::RelaxReport report = solver.relax(stent_.vertices(), options, stent_.spans());
        record.largest_move = std::max(record.largest_move, report.largest_move);
        moved += report.largest_move;
        balance = report.balance;
      }
      outcome_.converged = balance.relative <= *case_.tolerance &&
                           record.deepest <= kSinkTolerance * *case_.voxel_size;
      pushes_ = solver.pushes();
      record.self_contacts = static_cast<int>(pushes_.size());
      places_.assign(solver.positions().begin(), solver.positions().end());
      note(record, balance);
    }
  }

  /// Completes the record, keeps it, and shows it with the places that the finest wall would have.
  void note(StepRecord record, const xpbd::ForceBalance& balance) {
    record.step = static_cast<int>(outcome_.history.size()) + 1;
    if (record.settling) {
      record.expansion = 1;
      ++settling_steps_;
    }
    record.vertices = static_cast<int>(places_.size());
    record.radius = stent_.state().radii.front();
    record.straightening = stent_.state().straightening;
    record.contacts = balance.in_contact;
    record.residual = balance.relative;
    record.contact_force = balance.contact_force_sum;
    record.energy = balance.energy;
    if (gives_) {
      record.stent_shift = gives_->report().shift;
      record.stent_unbalanced = gives_->report().unbalanced;
    }
    outcome_.history.push_back(record);
    const bool are_numbers =
        std::all_of(places_.begin(), places_.end(), [](const Vec3& x) { return x.allFinite(); });
    if (!observe_ && are_numbers) return;
    std::vector<Vec3> finest = places_;
    for (std::size_t level = level_; level < finer_.size(); ++level) finest = finer_[level](finest);
    require_numbers(finest, setup_.region, record.step);
    if (observe_ && !observe_(record, finest))
      throw Error(ExitCode::interrupted, "stopped on request");
  }

  const Setup& setup_;
  const Case& case_;
  const Observer& observe_;
  StentContact stent_;
  std::vector<Wall> walls_;          // from coarse to fine
  std::vector<Prolongation> finer_;  // from each to the next
  std::optional<GiveWay> gives_;     // a stent that does
  std::vector<Vec3> contact_forces_;
  std::size_t level_ = 0;
  std::vector<Vec3> places_;   // of the wall at this level
  std::vector<Vec3> anchors_;  // where friction holds them; empty: nowhere yet
  bool rests_on_balloon_ = true;
  int settling_steps_ = 0;
  std::vector<xpbd::Push> pushes_;  // of the wall against itself
  bool near_itself_ = false;
  int kept_inside_ = 0;  // the stent, by other wall
  Outcome outcome_;
};

}  // namespace

Outcome deploy(const Setup& setup, const Observer& observe) {
  const vessels::Region& region = setup.region;
  Outcome outcome = Run(setup, observe).finish();
  outcome.positions = setup.surface.mesh.points;
  outcome.moved.assign(outcome.positions.size(), 0);
  for (std::size_t i = 0; i < region.vertices.size(); ++i) {
    const auto v = static_cast<std::size_t>(region.vertices[i]);
    if (region.pinned[i]) continue;
    outcome.positions[v] = outcome.patch[i];
    outcome.moved[v] = 1;
  }
  outcome.contact_force = outcome.history.empty() ? 0 : outcome.history.back().contact_force;
  return outcome;
}

}  // namespace vstent::deployment
