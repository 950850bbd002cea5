#include "deployment/deploy.hpp"

#include <algorithm>
#include <cmath>

#include "deployment/strut_contacts.hpp"
#include "stents/cover.hpp"
#include "vessels/error.hpp"
#include "vessels/text.hpp"

namespace vstent::deployment {
namespace {

using vessels::number;

// The paper's constants are in centimetres and grams; a spring of 1e5 g/s^2 is 1e5 dyn/cm = 0.1
// N/mm, and a hinge of 1e3 g cm^2/s^2 = 1e3 erg is 0.1 N mm.
constexpr xpbd::UniformStiffness kPaperWall{0.1, 0.1};
// Of a strut's thickness: the most that it lifts the wall between two searches for contacts.
constexpr double kGentle = 0.05;
// Of a voxel: what edges and triangles are let into struts, and what may be missing to that at
// rest. With what the field itself is wrong by, no place is then half a voxel deep.
constexpr double kSink = 0.25, kSinkTolerance = 0.2;
// While settling the wall moves so little that contacts found once serve several iterations.
constexpr int kSettlingIterations = 10;

xpbd::Sheet make_wall(const Setup& setup, const std::vector<Vec3>& points) {
  const Case& c = setup.specification;
  const vessels::Region& region = setup.region;
  if (c.paper_wall) return xpbd::make_sheet(points, region.triangles, region.pinned, kPaperWall);
  xpbd::Membrane membrane{*c.youngs_modulus, *c.thickness, *c.poisson_ratio};
  // A plate bends over wavelengths longer than it is thick. Into a cell, over a strut, the lumen's
  // surface gives way as soft tissue does: it is bent as a sheet no thicker than it is finely cut.
  if (setup.has_struts()) membrane.bending_thickness = std::min(*c.thickness, *c.patch_edge_length);
  return xpbd::make_sheet(points, region.triangles, region.pinned, membrane);
}

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

}  // namespace

std::vector<xpbd::Contact> find_contacts(const sdf::LevelSet& stent,
                                         std::span<const Vec3> positions,
                                         std::span<const char> pinned, double contact_distance,
                                         double reach, double stiffness) {
  std::vector<sdf::Sample> samples(positions.size());
  stent.sample(positions, samples);
  std::vector<xpbd::Contact> contacts;
  for (std::size_t i = 0; i < positions.size(); ++i) {
    if (pinned[i] || samples[i].distance >= contact_distance + reach) continue;
    if (samples[i].gradient.isZero()) {
      if (samples[i].distance > 0) continue;
      throw Error(ExitCode::numerical,
                  "a wall vertex at " + vessels::place(positions[i]) +
                      " mm lies deeper inside the stent than its level set reaches; "
                      "try a smaller growth_per_step or a stiffer contact");
    }
    xpbd::Contact contact;
    contact.vertex = static_cast<int>(i);
    contact.normal = samples[i].gradient;
    contact.offset = contact.normal.dot(positions[i]) + contact_distance - samples[i].distance;
    contact.stiffness = stiffness;
    contacts.push_back(contact);
  }
  return contacts;
}

namespace {

/// Of the balloon's level set, mm.
double balloon_voxel_size(const Setup& setup) {
  const Case& c = setup.specification;
  return setup.has_struts() ? std::min(setup.stent.diameter / 50, *c.contact_distance)
                            : *c.voxel_size;
}

/// The stent as the wall meets it: its distance field at the present size, and the contacts found
/// with it. Struts are carried outwards on a balloon, which holds the wall between them as well:
/// so the wall comes down on the struts from outside and cannot slip past one.
class StentContact {
 public:
  explicit StentContact(const Setup& setup) : setup_(setup) {
    const Case& c = setup.specification;
    contact_distance_ = *c.contact_distance;
    reach_ = 3 * *c.growth_per_step;
    if (setup.has_struts()) return;
    stiffness_ = c.contact_stiffness.value_or(0);
    // Under soft contact the wall rests inside the stent, the deeper the softer it is.
    if (stiffness_ > 0) sink_ = 0.25 * setup.stent.diameter / 2;
  }

  /// `voxel_size` in mm: a growing stent needs no finer field than its steps.
  void grow(StentState state, double voxel_size) {
    // Nodal gradients see 2.45 voxels around a point; the wall may enter by the growth of a step
    // and leave by the reach.
    const double half_width = (contact_distance_ + 2 * reach_ + sink_) / voxel_size + 3.5;
    field_ = sdf::voxelise(envelope_of(setup_, state, contact_distance_), {voxel_size, half_width});
    state_ = std::move(state);
  }

  /// Takes the balloon away: the wall settles on the struts, or on the sleeve of a graft.
  void deflate(StentState state) {
    const Case& c = setup_.specification;
    const stents::Cover& cover = setup_.design_specification.cover;
    if (stents::covered(cover)) {
      for (double& r : state.radii) r += cover.outer;
      return grow(std::move(state), balloon_voxel_size(setup_));
    }
    reach_ = setup_.strut.half();
    state_ = std::move(state);
    contacts_.clear();
    const double half_width = (2 * reach_ + *c.patch_edge_length) / *c.voxel_size + 2.5;
    field_ = voxelised(shape_of(setup_, state_), {*c.voxel_size, half_width});
    struts_.emplace(setup_.region.triangles, setup_.region.pinned,
                    StrutContactOptions{
                        .reach = reach_, .spacing = 0.5 * reach_, .sink = kSink * *c.voxel_size});
  }

  void find(std::span<const Vec3> positions) {
    if (struts_) {
      const double gentle = kGentle * setup_.strut.thickness;
      struts_->update(*field_, positions, gentle);
    } else {
      contacts_ = find_contacts(*field_, positions, setup_.region.pinned, contact_distance_, reach_,
                                stiffness_);
    }
  }

  std::span<const xpbd::Contact> vertices() const { return contacts_; }
  std::span<const xpbd::SpanContact> spans() const {
    return struts_ ? struts_->contacts() : std::span<const xpbd::SpanContact>();
  }
  const StentState& state() const { return state_; }
  double deepest() const { return struts_ ? struts_->deepest() : 0; }

  /// mm: how far the wall may move on the contacts found: no further than to where it would come
  /// upon a strut that it did not see.
  double safe_move() const {
    return struts_ ? 0.5 * reach_ : std::numeric_limits<double>::infinity();
  }

  /// mm: how far the wall may move in an iteration without losing its contacts.
  double step_limit() const { return struts_ ? 0.5 * reach_ : 0.5 * contact_distance_; }

 private:
  const Setup& setup_;
  StentState state_;
  std::optional<sdf::LevelSet> field_;
  std::optional<StrutContacts> struts_;
  double contact_distance_ = 0, reach_ = 0, stiffness_ = 0, sink_ = 0;
  std::vector<xpbd::Contact> contacts_;
};

}  // namespace

Outcome deploy(const Setup& setup, const Observer& observe) {
  const Case& c = setup.specification;
  const vessels::Region& region = setup.region;
  std::vector<Vec3> points;
  for (const int v : region.vertices)
    points.push_back(setup.surface.mesh.points[static_cast<std::size_t>(v)]);
  xpbd::Sheet wall = make_wall(setup, points);
  const double kappa =
      1.0;  // k dt^2/m; with kept multipliers and two sweeps or more this stays stable
  StentContact stent(setup);
  xpbd::StepOptions growing;
  growing.iterations = *c.iterations;
  growing.velocity_limit = stent.step_limit();
  growing.adaptive_damping = true;
  xpbd::scale_masses(wall, growing.time_step, kappa);
  xpbd::RelaxOptions settling;
  settling.step = 1.3;
  const auto limit_settling = [&] {
    settling.largest_move = stent.step_limit();
    settling.contact_tolerance = 2e-3 * stent.step_limit();
  };
  limit_settling();
  xpbd::Solver solver(wall);

  Outcome outcome;
  const int growth = growth_steps(setup);
  const double voxel_size = balloon_voxel_size(setup);
  for (int step = 1; step <= growth + *c.max_settling_steps && !outcome.converged; ++step) {
    StepRecord record;
    record.step = step;
    record.settling = step > growth;
    record.expansion = std::min(1.0, static_cast<double>(step) / growth);
    if (!record.settling) {
      stent.grow(inflated(setup, stent_state(setup, record.expansion), record.expansion),
                 step < growth ? 2 * voxel_size : voxel_size);
    } else if (setup.has_struts() && step == growth + 1) {
      stent.deflate(stent_state(setup, 1));
      limit_settling();
    }
    stent.find(solver.positions());
    record.deepest = stent.deepest();
    xpbd::ForceBalance balance;
    if (record.settling) {
      double moved = 0;
      for (int i = 0; i < kSettlingIterations; ++i) {
        if (moved > stent.safe_move()) {
          stent.find(solver.positions());
          moved = 0;
        }
        const xpbd::RelaxReport report = solver.relax(stent.vertices(), settling, stent.spans());
        record.largest_move = std::max(record.largest_move, report.largest_move);
        moved += report.largest_move;
        balance = report.balance;
      }
      outcome.converged =
          balance.relative <= *c.tolerance && record.deepest <= kSinkTolerance * *c.voxel_size;
    } else {
      record.largest_move = solver.step(stent.vertices(), growing, stent.spans()).largest_move;
      balance = solver.balance(stent.vertices(), settling.contact_tolerance);
    }
    require_numbers(solver.positions(), region, step);
    record.radius = stent.state().radii.front();
    record.straightening = stent.state().straightening;
    record.contacts = balance.in_contact;
    record.residual = balance.relative;
    record.contact_force = balance.contact_force_sum;
    record.energy = balance.energy;
    outcome.history.push_back(record);
    if (observe && !observe(record, solver.positions()))
      throw Error(ExitCode::interrupted, "stopped on request");
  }

  outcome.positions = setup.surface.mesh.points;
  outcome.moved.assign(outcome.positions.size(), 0);
  for (std::size_t i = 0; i < region.vertices.size(); ++i) {
    const auto v = static_cast<std::size_t>(region.vertices[i]);
    if (region.pinned[i]) continue;
    outcome.positions[v] = solver.positions()[i];
    outcome.moved[v] = 1;
  }
  StentState final_state = stent_state(setup, 1);
  outcome.axis = final_state.axis;
  outcome.radii = final_state.radii;
  outcome.stent = shape_of(setup, final_state);
  outcome.struts = std::move(final_state.struts);
  outcome.surface = std::move(final_state.surface);
  outcome.contact_force = outcome.history.empty() ? 0 : outcome.history.back().contact_force;
  return outcome;
}

}  // namespace vstent::deployment
