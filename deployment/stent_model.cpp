#include "deployment/stent_model.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "deployment/strut_solid.hpp"
#include "sdf/polyline.hpp"
#include "vessels/error.hpp"
#include "vessels/text.hpp"

namespace vstent::deployment {
namespace {

// Steps of growth with friction, at least.
constexpr int kFewestWithFriction = 10;
// Steps of growth without, which have to be small for other reasons, that one with it stands for.
constexpr int kStepsInOneWithFriction = 10;

StentState tube_state(const Setup& setup, double expansion) {
  const Placement& p = setup.placement;
  StentState state;
  state.straightening = expansion * *setup.specification.straightening;
  state.axis = stents::straightened(p.axis, state.straightening);
  state.radii = stents::expanded_radii(setup.stent, p.arc, setup.start_radius, expansion);
  return state;
}

stents::Pattern pattern_with(const stents::Design& design, const stents::RadiusProfile& radius) {
  try {
    return design.expanded(radius);
  } catch (const std::invalid_argument& beyond) {
    throw Error(ExitCode::usage, std::string("the stent's design: ") + beyond.what());
  }
}

/// Adds the struts, and the axis that they lie around, to a state with radii.
void thread_struts(const Setup& setup, const stents::Pattern& pattern,
                   const stents::AxisWithFrames& axis, double middle, StentState& state) {
  const bool closed = setup.design->cell() == stents::Cell::closed;
  const double start = middle - 0.5 * pattern.length;
  try {
    state.struts = stents::place(
        pattern, axis, start, closed ? stents::Bending::conforming : stents::Bending::rigid_rings);
  } catch (const std::invalid_argument& infeasible) {
    throw Error(ExitCode::geometry,
                setup.specification.surface.string() + ": " + infeasible.what());
  }
  const std::vector<double>& arc = setup.placement.arc;
  state.axis.clear();
  for (const double s : arc)
    state.axis.push_back(point_at(axis.points, axis.arc, start + s / arc.back() * pattern.length));
}

StentState strut_state(const Setup& setup, double expansion) {
  const Placement& p = setup.placement;
  const stents::Pattern pattern =
      expanded_pattern(*setup.design, setup.stent, setup.start_radius, expansion);
  const bool closed = setup.design->cell() == stents::Cell::closed;
  StentState state;
  state.straightening = expansion * *setup.specification.straightening;
  if (closed) {
    // What the cells cannot follow by shearing, the vessel must give: conform, then straighten.
    const double native = stents::largest_curvature(p.long_axis);
    const double tightest = stents::tightest_bend(pattern);
    if (native * tightest * (1 - state.straightening) >= 0.99)
      state.straightening = 1 - 0.98 / (native * tightest);
  }
  const Vec3 normal = stents::rotation_minimising_frames(p.long_axis).front().normal;
  const stents::AxisWithFrames axis =
      stents::with_frames(stents::straightened(p.long_axis, state.straightening), normal);
  for (const double s : p.arc) {
    const double nominal = stents::outer_radius(setup.stent, s / p.arc.back() * setup.stent.length);
    state.radii.push_back(setup.start_radius + expansion * (nominal - setup.start_radius));
  }
  thread_struts(setup, pattern, axis, p.long_middle, state);
  return state;
}

StentState surface_state(const Setup& setup, double expansion) {
  const Placement& p = setup.placement;
  const stents::StraightSurface& surface = setup.surface_design->surface;
  const double length = surface.length;
  StentState state;
  state.straightening = expansion * *setup.specification.straightening;
  // Carried from the native axis's first normal, the stent does not spin while it straightens.
  const Vec3 normal = stents::rotation_minimising_frames(p.long_axis).front().normal;
  stents::AxisWithFrames axis =
      stents::with_frames(stents::straightened(p.long_axis, state.straightening), normal);
  const double start = p.long_middle - 0.5 * length;
  const auto radius = [&](double z) {
    const double nominal = stents::outer_radius(setup.stent, std::clamp(z, 0.0, length));
    return setup.start_radius + expansion * (nominal - setup.start_radius);
  };
  for (const double s : p.arc) {
    const double z = s / p.arc.back() * length;
    state.axis.push_back(point_at(axis.points, axis.arc, start + z));
    // Its own waists and flares stay.
    state.radii.push_back(radius(z) - surface.outer_radius + stents::outer_radius_at(surface, z));
  }
  std::vector<double> radii;
  for (const double s : axis.arc) radii.push_back(radius(s - start));
  state.surface = std::make_shared<const stents::SurfaceMap>(
      std::move(axis), start, std::move(radii), surface.outer_radius);
  return state;
}

/// How far (mm) struts reach beyond the stent's outer radii: straight rings in a bend do.
double largest_protrusion(const StentState& state) {
  const std::vector<double> arc = arc_lengths(state.axis);
  const double face = 0.5 * state.struts->section.thickness;
  double largest = 0;
  for (const stents::PlacedMember& member : state.struts->members) {
    for (const Vec3& x : member.points) {
      const PolylinePlace place = nearest_place(state.axis, arc, x);
      const double outer = value_at(state.radii, arc, place.arc_length);
      largest = std::max(largest, std::sqrt(place.squared_distance) + face - outer);
    }
  }
  return largest;
}

/// Of the frames that carry its struts, at its proximal end.
Vec3 first_normal(const Setup& setup, const StentState& state) {
  const Polyline& native = setup.placement.long_axis;
  const Polyline line = stents::straightened(native, state.straightening);
  const stents::AxisWithFrames axis =
      stents::with_frames(line, stents::rotation_minimising_frames(native).front().normal);
  const PolylinePlace place = nearest_place(axis.points, axis.arc, state.axis.front());
  return axis.frames[static_cast<std::size_t>(place.segment)].normal;
}

Polyline continued_straight(const Polyline& line, double by) {
  const std::size_t n = line.size();
  Polyline result;
  result.push_back(line.front() - by * (line[1] - line[0]).normalized());
  result.insert(result.end(), line.begin(), line.end());
  result.push_back(line.back() + by * (line[n - 1] - line[n - 2]).normalized());
  return result;
}

}  // namespace

stents::Pattern expanded_pattern(const stents::Design& design, const stents::SmoothTube& tube,
                                 double start_radius, double expansion) {
  return pattern_with(design, [&](double share) {
    return start_radius +
           expansion * (stents::outer_radius(tube, share * tube.length) - start_radius);
  });
}

StentState stent_state(const Setup& setup, double expansion) {
  if (setup.surface_design) return surface_state(setup, expansion);
  return setup.design ? strut_state(setup, expansion) : tube_state(setup, expansion);
}

StentState yielded_state(const Setup& setup, const StentLine& line) {
  StentState state = stent_state(setup, 1);
  const Placement& p = setup.placement;
  const auto loss = [&, before = state.radii](double share) {
    const double s = share * p.arc.back();
    return value_at(before, p.arc, s) - value_at(line.radii, p.arc, s);
  };
  state.radii = line.radii;
  if (!setup.has_struts()) {
    state.axis = line.axis;
    return state;
  }
  const Vec3 normal = first_normal(setup, state);
  const double overhang = 0.5 * setup.stent.diameter;
  const stents::AxisWithFrames axis =
      stents::with_frames(continued_straight(line.axis, overhang), normal);
  const double middle = overhang + 0.5 * length(line.axis);
  if (setup.design) {
    const stents::Pattern pattern = pattern_with(*setup.design, [&](double share) {
      return stents::outer_radius(setup.stent, share * setup.stent.length) - loss(share);
    });
    thread_struts(setup, pattern, axis, middle, state);
    return state;
  }
  const stents::StraightSurface& surface = setup.surface_design->surface;
  const double start = middle - 0.5 * surface.length;
  std::vector<double> radii;
  for (const double s : axis.arc) {
    const double z = std::clamp(s - start, 0.0, surface.length);
    radii.push_back(stents::outer_radius(setup.stent, z) - loss(z / surface.length));
  }
  state.axis = line.axis;
  state.surface = std::make_shared<const stents::SurfaceMap>(axis, start, std::move(radii),
                                                             surface.outer_radius);
  return state;
}

double envelope_beyond(const Setup& setup, const StentState& state) {
  if (!state.struts) return 0;
  const double sleeve = setup.design_specification.cover.outer;
  return std::max(largest_protrusion(state), sleeve);
}

StentShape shape_of(const Setup& setup, const StentState& state) {
  if (state.surface) return state.surface->placed(setup.surface_design->surface.mesh);
  if (state.struts) return strut_solid(*state.struts);
  return envelope_of(setup, state, 0);
}

sdf::Solid envelope_of(const Setup& setup, const StentState& state, double inset) {
  std::vector<double> radii(state.radii);
  for (double& r : radii) r -= inset;
  const Shape shape = setup.specification.shape;
  sdf::Solid solid = sdf::make_tube(state.axis, radii, shape == Shape::capsule);
  if (shape == Shape::paper) solid.joints = sdf::Joints::flat;
  return solid;
}

StentState inflated(const Setup& setup, StentState state, double expansion) {
  if (state.surface) {
    // Its radii are those of its outermost points already, but for the field's roughness.
    for (double& r : state.radii) r += expansion * *setup.specification.voxel_size;
  }
  if (!state.struts) return state;
  const double recoil = setup.design_specification.recoil;
  const double protrusion = largest_protrusion(state);
  for (double& r : state.radii) r += expansion * std::max(protrusion, recoil / (1 - recoil) * r);
  return state;
}

int growth_steps(const Setup& setup) {
  double travel = 0;
  const StentState start = stent_state(setup, 0);
  const StentState end = inflated(setup, stent_state(setup, 1), 1);
  const std::vector<Vec3> along = tangents(end.axis);
  for (std::size_t i = 0; i < start.axis.size(); ++i) {
    Vec3 move = end.axis[i] - start.axis[i];
    // As a design shortens it slides along the wall; only what lifts the wall counts.
    if (setup.has_struts()) move -= move.dot(along[i]) * along[i];
    travel = std::max(travel, end.radii[i] - start.radii[i] + move.norm());
  }
  constexpr double kMostSteps = 1e6;
  const double steps = std::ceil(travel / *setup.specification.growth_per_step);
  if (steps > kMostSteps)
    throw Error(ExitCode::usage, "solver.growth_per_step of " +
                                     vessels::mm(*setup.specification.growth_per_step) + " makes " +
                                     vessels::exact(steps) +
                                     " steps of the stent's growth; at most a million are taken");
  const int given = std::max(1, static_cast<int>(steps));
  if (!(setup.specification.friction > 0)) return given;
  return std::max(kFewestWithFriction, given / kStepsInOneWithFriction);
}

}  // namespace vstent::deployment
