#include "deployment/deploy.hpp"

#include <algorithm>
#include <cmath>

#include "stents/axis.hpp"
#include "vessels/error.hpp"
#include "vessels/text.hpp"

namespace vstent::deployment {
namespace {

using vessels::number;

// The paper's constants are in centimetres and grams; a spring of 1e5 g/s^2 is 1e5 dyn/cm = 0.1
// N/mm, and a hinge of 1e3 g cm^2/s^2 = 1e3 erg is 0.1 N mm.
constexpr xpbd::UniformStiffness kPaperWall{0.1, 0.1};
// While settling the wall moves so little that contacts found once serve several iterations.
constexpr int kSettlingIterations = 10;

/// The stent as a solid, its surface drawn `inset` (mm) inside the outer radius: contact at that
/// distance puts the wall on the outer surface over the whole length, and rounds its edge just
/// beyond the ends.
sdf::Solid solid_of(const StentState& state, Shape shape, double inset) {
  std::vector<double> radii(state.radii);
  for (double& r : radii) r -= inset;
  sdf::Solid solid = sdf::make_tube(state.axis, radii, shape == Shape::capsule);
  if (shape == Shape::paper) solid.joints = sdf::Joints::flat;
  return solid;
}

xpbd::Sheet make_wall(const Setup& setup, const std::vector<Vec3>& points) {
  const Case& c = setup.specification;
  const vessels::Region& region = setup.region;
  if (c.paper_wall) return xpbd::make_sheet(points, region.triangles, region.pinned, kPaperWall);
  const xpbd::Membrane membrane{*c.youngs_modulus, *c.thickness, *c.poisson_ratio};
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

StentState stent_state(const Setup& setup, double expansion) {
  const Placement& p = setup.placement;
  StentState state;
  state.axis = stents::straightened(p.axis, expansion * *setup.specification.straightening);
  state.radii = stents::expanded_radii(setup.stent, p.arc, setup.start_radius, expansion);
  return state;
}

int growth_steps(const Setup& setup) {
  double travel = 0;
  const StentState start = stent_state(setup, 0);
  const StentState end = stent_state(setup, 1);
  for (std::size_t i = 0; i < start.axis.size(); ++i) {
    travel = std::max(travel, end.radii[i] - start.radii[i] + (end.axis[i] - start.axis[i]).norm());
  }
  return std::max(1, static_cast<int>(std::ceil(travel / *setup.specification.growth_per_step)));
}

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

Outcome deploy(const Setup& setup, const Observer& observe) {
  const Case& c = setup.specification;
  const vessels::Region& region = setup.region;
  const double contact_distance = *c.contact_distance;
  const double reach = 3 * *c.growth_per_step;
  const double stiffness = c.contact_stiffness.value_or(0);
  // Under soft contact the wall rests inside the stent, the deeper the softer it is.
  const double sink = stiffness > 0 ? 0.25 * setup.stent.diameter / 2 : 0;
  // Nodal gradients see 2.45 voxels around a point; the wall may enter by the growth of a step and
  // leave by the reach. A growing stent needs no finer field than its steps.
  const auto field = [&](const StentState& stent, double voxel) {
    const sdf::VoxelOptions voxels{voxel, (contact_distance + 2 * reach + sink) / voxel + 3.5};
    return sdf::voxelise(solid_of(stent, c.shape, contact_distance), voxels);
  };

  std::vector<Vec3> points;
  for (const int v : region.vertices)
    points.push_back(setup.surface.mesh.points[static_cast<std::size_t>(v)]);
  xpbd::Sheet wall = make_wall(setup, points);
  const double kappa =
      1.0;  // k dt^2/m; with kept multipliers and two sweeps or more this stays stable
  xpbd::StepOptions growing;
  growing.iterations = *c.iterations;
  growing.velocity_limit = 0.5 * contact_distance;
  growing.adaptive_damping = true;
  xpbd::scale_masses(wall, growing.time_step, kappa);
  xpbd::RelaxOptions settling;
  settling.step = 1.3;
  settling.largest_move = 0.5 * contact_distance;
  settling.contact_tolerance = 1e-3 * contact_distance;
  xpbd::Solver solver(wall);

  Outcome outcome;
  const int growth = growth_steps(setup);
  StentState state;
  sdf::LevelSet level_set = field(stent_state(setup, 0), 2 * *c.voxel_size);
  for (int step = 1; step <= growth + *c.max_settling_steps && !outcome.converged; ++step) {
    StepRecord record;
    record.step = step;
    record.settling = step > growth;
    record.expansion = std::min(1.0, static_cast<double>(step) / growth);
    if (!record.settling) {
      state = stent_state(setup, record.expansion);
      level_set = field(state, (step < growth ? 2 : 1) * *c.voxel_size);
    }
    const auto contacts = find_contacts(level_set, solver.positions(), region.pinned,
                                        contact_distance, reach, stiffness);
    xpbd::ForceBalance balance;
    if (record.settling) {
      for (int i = 0; i < kSettlingIterations; ++i) {
        const xpbd::RelaxReport report = solver.relax(contacts, settling);
        record.largest_move = std::max(record.largest_move, report.largest_move);
        balance = report.balance;
      }
      outcome.converged = balance.relative <= *c.tolerance;
    } else {
      record.largest_move = solver.step(contacts, growing).largest_move;
      balance = solver.balance(contacts, settling.contact_tolerance);
    }
    require_numbers(solver.positions(), region, step);
    record.radius = state.radii.front();
    record.straightening = record.expansion * *c.straightening;
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
  outcome.axis = state.axis;
  outcome.radii = state.radii;
  outcome.stent = solid_of(state, c.shape, 0);
  outcome.contact_force = outcome.history.empty() ? 0 : outcome.history.back().contact_force;
  return outcome;
}

}  // namespace vstent::deployment
