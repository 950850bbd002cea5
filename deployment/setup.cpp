#include "deployment/setup.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

#include "deployment/design_file.hpp"
#include "deployment/stent_model.hpp"
#include "deployment/wall_levels.hpp"
#include "deployment/wall_material.hpp"
#include "sdf/mesh_distance.hpp"
#include "sdf/polyline.hpp"
#include "vessels/error.hpp"
#include "vessels/lumen_ends.hpp"
#include "vessels/refine.hpp"
#include "vessels/sections.hpp"
#include "vessels/text.hpp"

namespace vstent::deployment {
namespace {

using vessels::CenterlinePath;
using vessels::mm;
using vessels::number;

[[noreturn]] void infeasible(const Case& c, const std::string& what) {
  throw Error(ExitCode::geometry, c.surface.string() + ": " + what);
}

struct Narrowing {
  double ratio = 1;  // radius here over the smaller of the largest radii on either side
  std::size_t path = 0, point = 0;
};

/// The place whose radius is smallest against what lies within `window` on both sides of it; ends
/// do not count.
Narrowing tightest_narrowing(const std::vector<CenterlinePath>& ways, double window) {
  Narrowing best;
  for (std::size_t w = 0; w < ways.size(); ++w) {
    const CenterlinePath& way = ways[w];
    const std::size_t n = way.points.size();
    for (std::size_t i = 0; i < n; ++i) {
      const double s = way.arc_length[i];
      if (s < way.radii.front() || way.arc_length.back() - s < way.radii.back()) continue;
      double before = 0;
      double behind = 0;
      for (std::size_t j = i; j-- > 0 && s - way.arc_length[j] <= window;)
        before = std::max(before, way.radii[j]);
      for (std::size_t j = i + 1; j < n && way.arc_length[j] - s <= window; ++j)
        behind = std::max(behind, way.radii[j]);
      const double healthy = std::min(before, behind);
      if (healthy > 0 && way.radii[i] / healthy < best.ratio) best = {way.radii[i] / healthy, w, i};
    }
  }
  return best;
}

/// The stent's middle as a branch and an arc length on it.
AtArcLength locate(const Case& c, const vessels::Centerline& centerline) {
  if (const auto* given = std::get_if<AtArcLength>(&c.at)) {
    if (given->branch >= static_cast<int>(centerline.branches.size())) {
      throw Error(ExitCode::usage, c.surface.string() + ": /stent/at/branch: the centerline has " +
                                       std::to_string(centerline.branches.size()) +
                                       " branches (ids from 0), not one with id " +
                                       std::to_string(given->branch));
    }
    const double available =
        length(centerline.branches[static_cast<std::size_t>(given->branch)].points);
    if (given->arc_length > available) {
      throw Error(ExitCode::usage, c.surface.string() + ": /stent/at/arc_length: branch " +
                                       std::to_string(given->branch) + " is " + mm(available) +
                                       " long, shorter than " + mm(given->arc_length));
    }
    return *given;
  }
  Vec3 target;
  if (const auto* given = std::get_if<AtPoint>(&c.at)) {
    target = given->point * vessels::millimetres_per(c.unit);
  } else {
    const std::vector<CenterlinePath> ways = vessels::paths(centerline);
    const Narrowing found = tightest_narrowing(ways, c.length);
    constexpr double kNotable =
        0.85;  // a narrowing of 15 % in radius; less is the roughness of a healthy wall
    if (found.ratio > kNotable) {
      infeasible(c, "no lesion found: nowhere is the lumen narrower than " +
                        number(100 * kNotable) + " % of what lies within " + mm(c.length) +
                        " on both sides; give the place with --at");
    }
    target = ways[found.path].points[found.point];
  }
  const vessels::CenterlinePlace place = vessels::nearest_place(centerline, target);
  if (place.distance > 3 * place.radius) {
    infeasible(c, "the point " + vessels::place(target) + " mm lies " + mm(place.distance) +
                      " from the nearest centerline, whose lumen radius is " + mm(place.radius) +
                      " there; coordinates are those of the surface file");
  }
  return {place.branch, place.arc_length};
}

/// The widest way through the tree past the stent, or the one that ends in branch `towards`.
CenterlinePath choose_way(const Case& c, const vessels::Centerline& centerline, int branch) {
  const std::vector<CenterlinePath> ways = vessels::paths(centerline, branch);
  if (!c.towards) return ways.front();
  for (const CenterlinePath& way : ways) {
    if (way.branch_of_point.back() == *c.towards) return way;
  }
  throw Error(ExitCode::usage, c.surface.string() + ": /stent/towards: no way through branch " +
                                   std::to_string(branch) + " ends in branch " +
                                   std::to_string(*c.towards));
}

/// Largest equivalent diameter of a landing zone of the way; nothing where no section is closed and
/// free of branches.
std::optional<double> landing_diameter(const vessels::Sectioner& sections,
                                       const CenterlinePath& way, double from, double to) {
  std::optional<double> largest;
  constexpr int kSections = 13;
  for (int k = 0; k < kSections; ++k) {
    const double s = from + (to - from) * (k + 0.5) / kSections;
    if (s <= 0 || s >= way.arc_length.back()) continue;
    const double inscribed = 2 * value_at(way.radii, way.arc_length, s);
    const auto section = sections.cut(point_at(way.points, way.arc_length, s),
                                      tangent_at(way.points, way.arc_length, s), 3 * inscribed);
    // A section that runs into a branch is wider than the ball inscribed in the vessel asked for.
    if (!section || section->equivalent_diameter > 1.2 * inscribed) continue;
    largest = std::max(largest.value_or(0), section->equivalent_diameter);
  }
  return largest;
}

/// The smaller of the largest lumens within 5 mm, or a diameter, of the stent's two ends (paper,
/// section 3.1).
double reference_diameter(const vessels::Sectioner& sections, const CenterlinePath& way,
                          double from, double to) {
  const auto zone = [&](double s) {
    return std::max(5.0, 2 * value_at(way.radii, way.arc_length, s));
  };
  const auto before = landing_diameter(sections, way, from - zone(from), from);
  const auto behind = landing_diameter(sections, way, to, to + zone(to));
  if (before && behind) return std::min(*before, *behind);
  return before ? *before : behind.value_or(0);
}

stents::SmoothTube final_dimensions(const Case& c, double length) {
  return {length, *c.diameter, c.distal_diameter, c.flare_diameter, c.flare_length};
}

/// Length (mm) at the final diameter: a design's follows from it.
double deployed_length(const Setup& setup) {
  const Case& c = setup.specification;
  if (!setup.design) return c.length;
  return expanded_pattern(*setup.design, final_dimensions(c, c.length), 0, 1).length;
}

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

void place_stent(Setup& setup) {
  Case& c = setup.specification;
  Placement& p = setup.placement;
  const AtArcLength at = locate(c, setup.centerline);
  c.at = at;
  const vessels::CenterlineBranch& branch =
      setup.centerline.branches[static_cast<std::size_t>(at.branch)];
  const Vec3 centre = point_at(branch.points, arc_lengths(branch.points), at.arc_length);
  p.way = choose_way(c, setup.centerline, at.branch);
  c.towards = p.way.branch_of_point.back();
  p.centre = nearest_place(p.way.points, p.way.arc_length, centre).arc_length;
  const double total = p.way.arc_length.back();
  double length = c.diameter ? deployed_length(setup) : c.length;
  const double from = p.centre - 0.5 * length;
  const double to = p.centre + 0.5 * length;
  if (from < 0 || to > total) {
    const bool inlet = from < 0;
    infeasible(c, "the stent reaches " + mm(inlet ? -from : to - total) + " over the vessel's " +
                      (inlet ? "inlet" : "outlet") + ": its middle lies " +
                      mm(inlet ? p.centre : total - p.centre) + " from it, half its length is " +
                      mm(0.5 * length) + "; move it or take a shorter one");
  }
  // The rim beyond the stent is held, so the wall needs some length to come down from the stent to
  // it.
  const double free_length = std::min(from, total - to);
  const double needed =
      0.5 * (c.diameter ? 0.5 * *c.diameter : value_at(p.way.radii, p.way.arc_length, p.centre));
  if (free_length < needed) {
    infeasible(c, "the stent ends " + mm(free_length) + " from the vessel's " +
                      (from < total - to ? "inlet" : "outlet") + "; at least " + mm(needed) +
                      " of vessel must lie beyond it, half its radius");
  }

  const vessels::Sectioner sections(setup.surface.mesh);
  p.reference_diameter = reference_diameter(sections, p.way, from, to);
  if (!c.diameter) {
    if (p.reference_diameter <= 0) {
      infeasible(c,
                 "--diameter auto needs a landing zone with closed cross-sections beside the "
                 "stent; give the diameter");
    }
    c.diameter = p.reference_diameter;
  }
  length = deployed_length(setup);
  setup.stent = final_dimensions(c, length);

  const double radius = 0.5 * *c.diameter;
  const double crimped_length =
      setup.design ? setup.design->expanded(setup.design->limits().crimped_diameter).length
                   : length;
  // A surface keeps its length, but the bends of its axis are known best between points.
  const double overhang =
      setup.surface_design ? 0.5 * radius : std::max(0.0, 0.5 * (crimped_length - length));
  const double pad = 3 * radius + overhang;
  const double clip_from = std::max(0.0, from - pad);
  const double clip_to = std::min(total, to + pad);
  const Polyline raw = resample(p.way.points, clip_from, clip_to, radius / 20);
  const Polyline smoothed = smooth_keeping_bends(raw, 0.75 * radius);
  const std::vector<double> smoothed_arc = arc_lengths(smoothed);
  const double middle = nearest_place(smoothed, smoothed_arc, centre).arc_length;
  const double start =
      std::clamp(middle - 0.5 * length, 0.0, std::max(0.0, smoothed_arc.back() - length));
  const double curvature = stents::largest_curvature(smoothed);
  // Chords of a curve of curvature k stray s^2 k / 8 from it; a thousandth of the radius is not
  // felt by the wall.
  const double spacing =
      std::min(radius / 10, curvature > 0 ? std::sqrt(8 * 1e-3 * radius / curvature) : radius);
  p.axis = resample(smoothed, start, start + length, spacing);
  p.arc = arc_lengths(p.axis);
  const double long_start = std::max(0.0, start - overhang);
  const double long_end = std::min(smoothed_arc.back(), start + length + overhang);
  p.long_axis = resample(smoothed, long_start, long_end, spacing);
  p.long_middle = start + 0.5 * length - long_start;
  const double widest = std::max({*c.diameter, c.distal_diameter, c.flare_diameter}) / 2;
  if (curvature * widest >= 1) {
    infeasible(
        c, "the axis bends with a radius of " + mm(1 / curvature) +
               ", tighter than the stent's own radius of " + mm(widest) +
               "; take a smaller or shorter stent, or closed cells, which straighten the vessel");
  }
  if (curvature * widest > 0.7) {
    setup.warnings.push_back("the axis bends with a radius of " + mm(1 / curvature) +
                             ", close to the stent's radius of " + mm(widest));
  }
}

/// Equivalent diameters (mm) of the sections of `mesh` normal to `axis` at its points; nothing
/// where the vessel is not closed around the axis.
std::vector<std::optional<double>> equivalent_diameters(const TriangleMesh& mesh,
                                                        const Polyline& axis, double reach) {
  const vessels::Sectioner sections(mesh);
  const std::vector<Vec3> normals = tangents(axis);
  std::vector<std::optional<double>> result(axis.size());
  for (std::size_t i = 0; i < axis.size(); ++i) {
    if (const auto section = sections.cut(axis[i], normals[i], reach))
      result[i] = section->equivalent_diameter;
  }
  return result;
}

/// Lumen in the stented length: how far the wall is, how narrow it gets, and whether the target
/// makes sense there.
void judge_target(Setup& setup) {
  const Case& c = setup.specification;
  Placement& p = setup.placement;
  const sdf::MeshDistance wall(setup.surface.mesh);
  for (const Vec3& x : p.axis) p.wall_distance.push_back(wall.closest(x).distance);
  double widest_diameter = *c.diameter;
  for (const auto& d : equivalent_diameters(setup.surface.mesh, p.axis, 2 * widest_diameter)) {
    if (d)
      p.narrowest_diameter = p.narrowest_diameter > 0 ? std::min(p.narrowest_diameter, *d) : *d;
  }
  const double target = std::max({*c.diameter, c.distal_diameter, c.flare_diameter});
  if (p.narrowest_diameter >= target) {
    infeasible(c, "nothing to open: the lumen is nowhere narrower than " +
                      mm(p.narrowest_diameter) +
                      " in the stented length, and the stent's diameter is " + mm(target));
  }
  constexpr double kTooMuch = 2.5;  // over-expansion beyond what any published series attempts
  if (p.reference_diameter > 0 && target > kTooMuch * p.reference_diameter) {
    infeasible(c, "a diameter of " + mm(target) + " is more than " + number(kTooMuch) +
                      " times the reference lumen of " + mm(p.reference_diameter) +
                      "; are the units right?");
  }
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

void find_patch(Setup& setup) {
  const Case& c = setup.specification;
  const Placement& p = setup.placement;
  const vessels::LumenEnds ends = vessels::find_lumen_ends(setup.surface);
  std::vector<double> reach(p.axis.size());
  for (std::size_t i = 0; i < reach.size(); ++i) {
    reach[i] =
        std::max(p.wall_distance[i], stents::outer_radius(setup.stent, p.arc[i])) + *c.patch_margin;
  }
  try {
    setup.region = vessels::find_region(setup.surface.mesh, ends.is_cap, p.axis, reach);
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

/// Of the smooth tube, or of the balloon that carries struts.
void derive_growth(Setup& setup) {
  Case& c = setup.specification;
  const double radius = 0.5 * *c.diameter;
  const double edge = setup.region.median_edge;
  const std::vector<double> spacings = grows_on_coarser_walls(c)
                                           ? level_spacings(setup.region.vertices.size(), edge)
                                           : std::vector<double>();
  const double growing_edge = spacings.empty() ? edge : spacings.front();
  // The balloon's edge leaves no trace under struts; a smooth stent's is as sharp as the mesh.
  const double touching_edge = setup.has_struts() ? growing_edge : edge;
  if (!c.contact_distance) c.contact_distance = std::min(0.5 * touching_edge, 0.1 * radius);
  if (!c.growth_per_step)
    c.growth_per_step = std::min(0.15 * growing_edge, 0.5 * *c.contact_distance);
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
  judge_target(setup);
  derive_wall(setup);
  if (setup.surface_design) judge_surface_design(setup);
  find_patch(setup);
  if (setup.has_struts()) refine_for_struts(setup);
  warn_of_cut_patch(setup);
  derive_growth(setup);
  if (setup.has_struts()) {
    derive_strut_voxels(setup);
  } else {
    derive_tube_voxels(setup);
  }
  setup.material = wall_material(setup.surface, setup.region, c);
  derive_solver(setup);
  warn_of_bent_design(setup);
  return setup;
}

}  // namespace vstent::deployment
