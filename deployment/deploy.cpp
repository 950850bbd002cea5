#include "deployment/deploy.hpp"

#include <algorithm>
#include <cmath>

#include "deployment/strut_contacts.hpp"
#include "vessels/error.hpp"
#include "vessels/text.hpp"

namespace vstent::deployment {
namespace {

using vessels::number;

// The paper's constants are in centimetres and grams; a spring of 1e5 g/s^2 is 1e5 dyn/cm = 0.1
// N/mm, and a hinge of 1e3 g cm^2/s^2 = 1e3 erg is 0.1 N mm.
constexpr xpbd::UniformStiffness kPaperWall{0.1, 0.1};
// Of a growth step: the most that a strut at rest lifts the wall between two searches for contacts.
constexpr double kGentle = 0.1;
// While settling the wall moves so little that contacts found once serve several iterations.
constexpr int kSettlingIterations = 10;
// Voxels around struts: the field is only followed from above.
constexpr double kStrutBand = 5;

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

/// The stent as the wall meets it: its distance field at the present size, and the contacts found
/// with it.
class StentContact {
 public:
  explicit StentContact(const Setup& setup) : setup_(setup) {
    const Case& c = setup.specification;
    if (setup.has_struts()) {
      const StrutSize& strut = setup.strut;
      const double half = strut.half();
      struts_.emplace(setup.region.triangles, setup.region.pinned,
                      StrutContactOptions{.depth = 1.5 * strut.thickness + *c.growth_per_step,
                                          .reach = half,
                                          .spacing = 0.5 * half,
                                          .support = strut.width});
    } else {
      contact_distance_ = *c.contact_distance;
      reach_ = 3 * *c.growth_per_step;
      stiffness_ = c.contact_stiffness.value_or(0);
      // Under soft contact the wall rests inside the stent, the deeper the softer it is.
      if (stiffness_ > 0) sink_ = 0.25 * setup.stent.diameter / 2;
    }
  }

  /// A growing stent needs no finer field than its steps: `voxels` counts the case's own per voxel.
  void set(StentState state, int voxels) {
    const double voxel = voxels * *setup_.specification.voxel_size;
    // Nodal gradients see 2.45 voxels around a point; the wall may enter by the growth of a step
    // and leave by the reach.
    const double half_width =
        setup_.has_struts() ? kStrutBand : (contact_distance_ + 2 * reach_ + sink_) / voxel + 3.5;
    if (setup_.has_struts()) {
      moved_ = largest_move(state_, state);
      envelope_radius_ = state.radii;
      // Straight struts of rigid rings poke out of a bent envelope, by less than this.
      for (double& r : envelope_radius_) r += 0.1 * r;
    }
    state_ = std::move(state);
    if (state_.surface) {
      if (!field_) field_ = sdf::voxelise(setup_.surface_design->surface.mesh, finest());
      metal_ = std::make_unique<MappedMetal>(*field_, *state_.surface);
      return;
    }
    field_ = voxelised(shape_of(setup_, state_, contact_distance_), {voxel, half_width});
    if (struts_) metal_ = std::make_unique<VoxelisedMetal>(*field_);
  }

  /// While the stent grows it lifts the wall along; at rest it does so gently, where the wall has
  /// slid under a strut.
  void find(std::span<const Vec3> positions, bool growing) {
    if (struts_) {
      const double step = *setup_.specification.growth_per_step;
      struts_->update(*metal_, {state_.axis, envelope_radius_}, positions,
                      std::exchange(moved_, 0.0), growing ? 2 * step : kGentle * step);
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

  /// mm: how far the wall may move in an iteration without losing its contacts.
  double step_limit() const {
    return struts_ ? *setup_.specification.growth_per_step : 0.5 * contact_distance_;
  }

 private:
  /// A surface is voxelised once, so as finely as the case asks for in the end.
  sdf::VoxelOptions finest() const { return {*setup_.specification.voxel_size, kStrutBand}; }

  const Setup& setup_;
  StentState state_;
  std::optional<sdf::LevelSet> field_;
  std::unique_ptr<const MetalField> metal_;
  std::optional<StrutContacts> struts_;
  std::vector<double> envelope_radius_;
  double moved_ = 0;
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
  // Thin struts kick what they lift; without inertia and kept forces it stays where it was lifted
  // to.
  growing.adaptive_damping = growing.keep_multipliers = !setup.has_struts();
  growing.damping = setup.has_struts() ? 1 : 0;
  xpbd::scale_masses(wall, growing.time_step, kappa);
  xpbd::RelaxOptions settling;
  settling.step = 1.3;
  settling.largest_move = stent.step_limit();
  settling.contact_tolerance = 2e-3 * stent.step_limit();
  xpbd::Solver solver(wall);

  Outcome outcome;
  const int growth = growth_steps(setup);
  for (int step = 1; step <= growth + *c.max_settling_steps && !outcome.converged; ++step) {
    StepRecord record;
    record.step = step;
    record.settling = step > growth;
    record.expansion = std::min(1.0, static_cast<double>(step) / growth);
    if (!record.settling) stent.set(stent_state(setup, record.expansion), step < growth ? 2 : 1);
    stent.find(solver.positions(), !record.settling);
    xpbd::ForceBalance balance;
    if (record.settling) {
      for (int i = 0; i < kSettlingIterations; ++i) {
        const xpbd::RelaxReport report = solver.relax(stent.vertices(), settling, stent.spans());
        record.largest_move = std::max(record.largest_move, report.largest_move);
        balance = report.balance;
      }
      outcome.converged = balance.relative <= *c.tolerance;
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
  outcome.axis = stent.state().axis;
  outcome.radii = stent.state().radii;
  outcome.stent = shape_of(setup, stent.state());
  outcome.struts = stent.state().struts;
  outcome.surface = stent.state().surface;
  outcome.contact_force = outcome.history.empty() ? 0 : outcome.history.back().contact_force;
  return outcome;
}

}  // namespace vstent::deployment
