#include "deployment/setup.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <utility>

#include "deployment/design_file.hpp"
#include "deployment/place_stent.hpp"
#include "deployment/stent_model.hpp"
#include "deployment/wall_levels.hpp"
#include "deployment/wall_material.hpp"
#include "sdf/polyline.hpp"
#include "vessels/error.hpp"
#include "vessels/lumen_ends.hpp"
#include "vessels/refine.hpp"
#include "vessels/text.hpp"

namespace vstent::deployment {
namespace {

using vessels::mm;
using vessels::number;

void refuse_straightening_open_cells(const Case& c) {
  if (c.cell == stents::Cell::open && c.straightening.value_or(0) > 0) {
    throw Error(ExitCode::usage, c.surface.string() + ": /stent/straightening: the design " +
                                     c.design + " has open cells, which follow the vessel");
  }
}

/// Reads the surface, whose length is its own.
void choose_surface_design(Setup& setup) {
  Case& c = setup.specification;
  setup.surface_design = std::make_shared<const SurfaceDesign>(read_surface_design(c.design));
  const SurfaceDesign& design = *setup.surface_design;
  const double length = design.surface.length;
  if (c.length > 0 && std::abs(c.length - length) > 1e-6 * length) {
    throw Error(ExitCode::usage, c.surface.string() + ": /stent/length: the surface " + c.design +
                                     " is " + mm(length) + " long, not " + mm(c.length) +
                                     "; leave the length out");
  }
  c.length = length;
  c.cell = design.cell;
  setup.strut = {design.width, design.thickness};
  setup.warnings = design.findings;
  refuse_straightening_open_cells(c);
}

/// Counts out the design's rings, cells or wires, and fills in its length.
void choose_design(Setup& setup) {
  Case& c = setup.specification;
  if (c.design.empty()) return;
  if (is_surface_design(c.design)) return choose_surface_design(setup);
  setup.design_specification = find_design(c.design);
  try {
    setup.design = stents::make_design(setup.design_specification,
                                       c.length > 0 ? std::optional(c.length) : std::nullopt);
  } catch (const std::invalid_argument& impossible) {
    throw Error(ExitCode::usage, c.design + ": " + impossible.what());
  }
  c.length = setup.design->expanded(setup.design->limits().nominal_diameter).length;
  c.cell = setup.design->cell();
  const stents::CrossSection& section = setup.design_specification.section;
  setup.strut = {section.width, section.thickness};
  refuse_straightening_open_cells(c);
}

/// What the case does not say of its stiffness, the design does.
void derive_stiffness(Setup& setup) {
  Case& c = setup.specification;
  const stents::Specification& design = setup.design_specification;
  if (!c.gives_way) return;
  if (!c.bending_stiffness) c.bending_stiffness = design.bending_stiffness;
  if (!c.radial_stiffness) c.radial_stiffness = design.radial_stiffness;
}

void derive_wall(Setup& setup) {
  Case& c = setup.specification;
  const double radius = 0.5 * *c.diameter;
  if (!c.straightening) c.straightening = c.cell == stents::Cell::closed ? 1.0 : 0.0;
  const WallPreset* preset = find_wall_preset(c.wall_preset);
  if (!c.paper_wall()) {
    if (!c.youngs_modulus && c.modulus_array.empty())
      c.youngs_modulus = preset ? preset->youngs_modulus : 1.0;
    if (!c.thickness && c.thickness_array.empty())
      c.thickness = (preset ? preset->thickness_to_radius : 0.15) * radius;
    if (!c.poisson_ratio) c.poisson_ratio = 0.45;
  }
  if (!c.self_collision) c.self_collision = false;
  if (!c.patch_margin) {
    // Edge effects fade over 1/beta = sqrt(R t) / (3 (1 - nu^2))^(1/4) (case V8); four of them, and
    // a diameter for the lengths over which a lumen narrows.
    double thickness = c.thickness.value_or(0.2 * radius);
    if (!c.thickness_array.empty()) {
      const std::vector<double> values = wall_thickness(setup.surface, c);
      thickness = *std::max_element(values.begin(), values.end());
    }
    const double nu = c.poisson_ratio.value_or(1.0 / 3);
    const double boundary_layer = std::sqrt(radius * thickness) / std::pow(3 * (1 - nu * nu), 0.25);
    c.patch_margin = std::max(4 * boundary_layer, 2 * radius) * (1 + *c.straightening);
  }
  const Placement& p = setup.placement;
  setup.start_radius = 0.95 * *std::min_element(p.wall_distance.begin(), p.wall_distance.end());
}

void judge_surface_design(Setup& setup) {
  const Case& c = setup.specification;
  const SurfaceDesign& design = *setup.surface_design;
  double narrowest = *c.diameter, widest = *c.diameter;
  for (const double s : setup.placement.arc) {
    const double diameter = 2 * stents::outer_radius(setup.stent, s);
    narrowest = std::min(narrowest, diameter);
    widest = std::max(widest, diameter);
  }
  require_reachable(design, narrowest, widest, c.surface.string() + ": /stent/diameter");
  const double wall = design.surface.outer_radius - design.surface.inner_radius;
  if (setup.start_radius <= wall) {
    infeasible(c, "the surface " + c.design + " has a wall of " + mm(wall) +
                      " and does not fit through the lumen, whose radius is down to " +
                      mm(setup.start_radius / 0.95));
  }
  setup.warnings.push_back(limits_of(design, widest));
}

/// mm
double thickest_wall(const Setup& setup) {
  const Case& c = setup.specification;
  if (c.thickness_array.empty()) return *c.thickness;
  const std::vector<double> values = wall_thickness(setup.surface, c);
  return *std::max_element(values.begin(), values.end());
}

void find_patch(Setup& setup) {
  const Case& c = setup.specification;
  const Placement& p = setup.placement;
  const vessels::LumenEnds ends = vessels::find_lumen_ends(setup.surface);
  std::vector<double> reach(p.axis.size());
  for (std::size_t i = 0; i < reach.size(); ++i) {
    reach[i] =
        std::max(p.wall_distance[i], stents::outer_radius(setup.stent, p.arc[i])) + *c.patch_margin;
  }
  vessels::GivingWay giving_way;
  if (*c.self_collision) {
    // Two walls, and the triangles that reach in between vertices.
    giving_way.axis = *c.straightening > 0 ? stent_state(setup, 1).axis : p.axis;
    for (const double s : arc_lengths(giving_way.axis))
      giving_way.reach.push_back(stents::outer_radius(setup.stent, std::min(s, p.arc.back())) +
                                 2 * thickest_wall(setup) + setup.check.edge_median);
    giving_way.further = *c.patch_margin;
  }
  try {
    setup.region = vessels::find_region(setup.surface.mesh, ends.is_cap, p.axis, reach, giving_way);
  } catch (const std::invalid_argument& nothing) {
    infeasible(c, std::string(nothing.what()) + "; does the stent lie in the vessel?");
  }
}

/// Cuts the triangles that struts may touch down to the patch's edge length, and finds the patch
/// again on them.
void refine_for_struts(Setup& setup) {
  Case& c = setup.specification;
  const Placement& p = setup.placement;
  const StrutSize& strut = setup.strut;
  const double length = p.arc.back();
  if (!c.patch_edge_length) {
    c.patch_edge_length = strut.width;
    // Bisected triangles with edges up to e cover about e^2 / 4 each, two to a vertex.
    constexpr double kMostVertices = 250'000;
    const double area = std::numbers::pi * *c.diameter * length;
    const double finest = std::sqrt(2 * area / kMostVertices);
    if (*c.patch_edge_length < finest) {
      setup.warnings.push_back("the wall is refined to edges of " + mm(finest) +
                               ", not to the strut width of " + mm(strut.width) +
                               ", which would take more than " + number(kMostVertices) +
                               " vertices; /patch/edge_length sets it");
      c.patch_edge_length = finest;
    }
  }
  const double edge = *c.patch_edge_length;
  std::vector<char> in_patch(setup.surface.mesh.triangles.size(), 0);
  for (const int t : setup.region.triangle_ids) in_patch[static_cast<std::size_t>(t)] = 1;
  const double margin = 2 * strut.width;
  const auto limit = [&](int triangle, const Vec3& x) {
    constexpr double kAny = std::numeric_limits<double>::infinity();
    if (!in_patch[static_cast<std::size_t>(triangle)]) return kAny;
    const PolylinePlace place = nearest_place(p.axis, p.arc, x);
    const double radius = stents::outer_radius(setup.stent, place.arc_length) + margin;
    return place.squared_distance <= radius * radius ? edge : kAny;
  };
  constexpr std::size_t kVertexLimit = 3'000'000;
  vessels::Surface refined = vessels::refine(setup.surface, limit, kVertexLimit);
  if (refined.mesh.points.size() == setup.surface.mesh.points.size()) return;
  setup.unrefined = std::exchange(setup.surface, std::move(refined));
  find_patch(setup);
}

void warn_of_cut_patch(Setup& setup) {
  if (!setup.region.meets_opening) return;
  setup.warnings.push_back("the patch that may move (margin " +
                           mm(*setup.specification.patch_margin) +
                           ") is cut short by an open rim or a cap; the wall there is held");
}

/// What the bend does to the design, that no deployment can mend.
void warn_of_bent_design(Setup& setup) {
  if (!setup.design) return;
  const stents::PlacedStent struts = *stent_state(setup, 1).struts;
  if (!struts.overlapping_rings.empty()) {
    std::string pairs;
    for (const auto& [a, b] : struts.overlapping_rings)
      pairs += (pairs.empty() ? "" : ", ") + std::to_string(a) + " and " + std::to_string(b);
    setup.warnings.push_back("rings meet on the inside of the bend: " + pairs + " (from 0)");
  }
  const double width = setup.design_specification.section.width;
  if (struts.largest_gap > 0.5 * width) {
    setup.warnings.push_back(
        "welded rings stay rigid in the bend, where their joints open by up to " +
        mm(struts.largest_gap) + "; a real stent bends its struts");
  }
  constexpr double kNotable = 0.05;
  if (struts.largest_connector_strain > kNotable) {
    setup.warnings.push_back(
        "connectors reach from ring to ring in the bend only with their length changed by up to " +
        number(100 * struts.largest_connector_strain) + " %");
  }
}

void derive_solver(Setup& setup) {
  Case& c = setup.specification;
  if (!c.iterations) c.iterations = 4;
  // Over struts contacts between vertices come and go until the end.
  if (!c.tolerance) c.tolerance = setup.has_struts() ? 0.01 : 2e-4;
  if (!c.max_settling_steps) c.max_settling_steps = 20000;
}

void choose_levels(Setup& setup) {
  if (!grows_on_coarser_walls(setup.specification)) return;
  std::vector<double> spacings =
      level_spacings(setup.region.vertices.size(), setup.region.median_edge);
  if (*setup.specification.self_collision && !spacings.empty()) {
    const WallMesh patch = patch_of(setup);
    std::erase_if(spacings,
                  [&](double spacing) { return crosses_itself(coarsened(patch, spacing)); });
  }
  setup.level_spacings = std::move(spacings);
}

// Of the edges of the wall that grows.
constexpr double kContactDistance = 0.5;
constexpr double kGrowthPerStep = 0.15;

/// Of the smooth tube, or of the balloon that carries struts.
void derive_growth(Setup& setup) {
  Case& c = setup.specification;
  const double radius = 0.5 * *c.diameter;
  const double edge = setup.region.median_edge;
  const std::vector<double>& spacings = setup.level_spacings;
  const double growing_edge = spacings.empty() ? edge : spacings.front();
  // The balloon's edge leaves no trace under struts; a smooth stent's is as sharp as the mesh.
  const double touching_edge = setup.has_struts() ? growing_edge : edge;
  if (!c.contact_distance)
    c.contact_distance = std::min(kContactDistance * touching_edge, 0.1 * radius);
  if (!c.growth_per_step)
    c.growth_per_step = std::min(kGrowthPerStep * growing_edge, 0.5 * *c.contact_distance);
  if (*c.contact_distance >= 0.5 * radius) {
    throw Error(ExitCode::usage, c.surface.string() +
                                     ": /contact/distance: " + mm(*c.contact_distance) +
                                     " must be below half the stent's radius, " + mm(radius / 2));
  }
  if (setup.start_radius <= *c.contact_distance) {
    c.contact_distance = 0.5 * setup.start_radius;
    c.growth_per_step = std::min(*c.growth_per_step, 0.5 * *c.contact_distance);
  }
}

/// A strut of half thickness r: voxels of r/2, half of r for the field's curvature.
void derive_strut_voxels(Setup& setup) {
  Case& c = setup.specification;
  const double half = setup.strut.half();
  if (!c.voxel_size) c.voxel_size = 0.5 * half;
  if (*c.voxel_size > half) {
    throw Error(ExitCode::usage, c.surface.string() +
                                     ": /level_set/voxel_size: " + mm(*c.voxel_size) +
                                     " is coarser than half the thickness of a strut, " + mm(half));
  }
}

void derive_tube_voxels(Setup& setup) {
  Case& c = setup.specification;
  const double radius = 0.5 * *c.diameter;
  if (!c.voxel_size) c.voxel_size = std::min(radius / 25, *c.contact_distance);
  if (*c.voxel_size > radius / 4) {
    throw Error(ExitCode::usage,
                c.surface.string() + ": /level_set/voxel_size: " + mm(*c.voxel_size) +
                    " is coarser than a quarter of the stent's radius, " + mm(radius / 4));
  }
  const double edge = setup.region.median_edge;
  const double sag = edge * edge / (8 * radius);
  if (sag > 0.005 * radius) {
    setup.warnings.push_back("the surface is coarse for this stent: between vertices " + mm(edge) +
                             " apart the wall sags " + mm(sag) + " into a lumen of radius " +
                             mm(radius));
  }
}

}  // namespace

Setup prepare(Case specification) {
  Setup setup;
  setup.specification = std::move(specification);
  const Case& c = setup.specification;
  setup.surface = vessels::read_surface(c.surface, c.unit);
  setup.check = vessels::check(setup.surface);
  vessels::require_stentable(setup.surface, setup.check);
  if (c.centerline.empty()) {
    setup.centerline = vessels::extract_centerline(setup.surface);
  } else {
    setup.centerline = vessels::read_centerline(c.centerline, c.unit);
    vessels::fill_radii(setup.centerline, setup.surface);
  }
  choose_design(setup);
  derive_stiffness(setup);
  place_stent(setup);
  derive_wall(setup);
  if (setup.surface_design) judge_surface_design(setup);
  find_patch(setup);
  if (setup.has_struts()) refine_for_struts(setup);
  warn_of_cut_patch(setup);
  setup.material = wall_material(setup.surface, setup.region, c);
  choose_levels(setup);
  derive_growth(setup);
  if (setup.has_struts()) {
    derive_strut_voxels(setup);
  } else {
    derive_tube_voxels(setup);
  }
  derive_solver(setup);
  warn_of_bent_design(setup);
  return setup;
}

Setup on_patch_alone(Setup setup) {
  setup.level_spacings.clear();
  Case& c = setup.specification;
  const double edge = setup.region.median_edge;
  c.contact_distance = std::min(*c.contact_distance, kContactDistance * edge);
  c.growth_per_step =
      std::min({*c.growth_per_step, kGrowthPerStep * edge, 0.5 * *c.contact_distance});
  return setup;
}

}  // namespace vstent::deployment
