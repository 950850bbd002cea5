#include "deployment/place_stent.hpp"

#include <algorithm>
#include <cmath>
#include <optional>

#include "deployment/stent_model.hpp"
#include "sdf/mesh_distance.hpp"
#include "sdf/polyline.hpp"
#include "vessels/error.hpp"
#include "vessels/sections.hpp"
#include "vessels/text.hpp"

namespace vstent::deployment {
namespace {

using vessels::CenterlinePath;
using vessels::mm;
using vessels::number;

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

}  // namespace

void infeasible(const Case& c, const std::string& what) {
  throw Error(ExitCode::geometry, c.surface.string() + ": " + what);
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
  judge_target(setup);
}

}  // namespace vstent::deployment
