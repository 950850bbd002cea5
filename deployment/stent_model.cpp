#include "deployment/stent_model.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "deployment/strut_solid.hpp"
#include "sdf/polyline.hpp"
#include "vessels/error.hpp"

namespace vstent::deployment {
namespace {

StentState tube_state(const Setup& setup, double expansion) {
  const Placement& p = setup.placement;
  StentState state;
  state.straightening = expansion * *setup.specification.straightening;
  state.axis = stents::straightened(p.axis, state.straightening);
  state.radii = stents::expanded_radii(setup.stent, p.arc, setup.start_radius, expansion);
  return state;
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
  const double start = p.long_middle - 0.5 * pattern.length;
  try {
    state.struts = stents::place(
        pattern, axis, start, closed ? stents::Bending::conforming : stents::Bending::rigid_rings);
  } catch (const std::invalid_argument& infeasible) {
    throw Error(ExitCode::geometry,
                setup.specification.surface.string() + ": " + infeasible.what());
  }
  for (const double s : p.arc) {
    const double share = s / p.arc.back();
    state.axis.push_back(point_at(axis.points, axis.arc, start + share * pattern.length));
    const double nominal = stents::outer_radius(setup.stent, share * setup.stent.length);
    state.radii.push_back(setup.start_radius + expansion * (nominal - setup.start_radius));
  }
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

}  // namespace

stents::Pattern expanded_pattern(const stents::Design& design, const stents::SmoothTube& tube,
                                 double start_radius, double expansion) {
  try {
    return design.expanded([&](double share) {
      return start_radius +
             expansion * (stents::outer_radius(tube, share * tube.length) - start_radius);
    });
  } catch (const std::invalid_argument& beyond) {
    throw Error(ExitCode::usage, std::string("the stent's design: ") + beyond.what());
  }
}

StentState stent_state(const Setup& setup, double expansion) {
  if (setup.surface_design) return surface_state(setup, expansion);
  return setup.design ? strut_state(setup, expansion) : tube_state(setup, expansion);
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
  return std::max(1, static_cast<int>(std::ceil(travel / *setup.specification.growth_per_step)));
}

}  // namespace vstent::deployment
