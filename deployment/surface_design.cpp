#include "deployment/surface_design.hpp"

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <numbers>
#include <optional>

#include "sdf/signed_mesh_distance.hpp"
#include "vessels/check.hpp"
#include "vessels/error.hpp"
#include "vessels/file_guard.hpp"
#include "vessels/json_object.hpp"
#include "vessels/refine.hpp"
#include "vessels/surface.hpp"
#include "vessels/text.hpp"

namespace vstent::deployment {
namespace {

using vessels::mm;
using vessels::number;

/// What a design file says about its surface.
struct Description {
  std::string name;
  std::filesystem::path file;
  std::optional<vessels::LengthUnit> unit;
  std::optional<Vec3> axis;
  bool flip = false;
  stents::Cell cell = stents::Cell::open;
  double crimped_diameter = 0, largest_diameter = 0;
};

std::optional<Vec3> direction(vessels::ObjectReader& root) {
  const nlohmann::json* axis = root.find("axis");
  if (!axis) return std::nullopt;
  Vec3 result = Vec3::Zero();
  bool good = axis->is_array() && axis->size() == 3;
  for (std::size_t k = 0; good && k < 3; ++k) {
    good = (*axis)[k].is_number();
    if (good) result[static_cast<Eigen::Index>(k)] = (*axis)[k].get<double>();
  }
  if (!good || !result.allFinite() || !(result.norm() > 0))
    root.refuse("axis", "must be a direction [x, y, z], proximal to distal, is " + axis->dump());
  return result.normalized();
}

Description read_description(const std::filesystem::path& path) {
  const nlohmann::json json = vessels::read_json(path);
  vessels::ObjectReader root(json, path.string(), "");
  Description d;
  const auto surface = root.text("surface");
  root.require(surface.has_value(), "surface", "the file of the straight stent's surface");
  d.file =
      std::filesystem::weakly_canonical(std::filesystem::absolute(path).parent_path() / *surface);
  d.name = root.text("name").value_or(d.file.stem().string());
  d.unit = root.choice<vessels::LengthUnit>("unit", {{"mm", vessels::LengthUnit::mm},
                                                     {"cm", vessels::LengthUnit::cm},
                                                     {"m", vessels::LengthUnit::m}});
  root.require(d.unit.has_value(), "unit", "the surface's length unit: mm, cm or m");
  d.cell = root.choice<stents::Cell>(
                   "cell", {{"open", stents::Cell::open}, {"closed", stents::Cell::closed}})
               .value_or(stents::Cell::open);
  d.axis = direction(root);
  d.flip = root.boolean("flip").value_or(false);
  d.crimped_diameter = root.length("crimped_diameter").value_or(0);
  d.largest_diameter = root.length("largest_diameter").value_or(0);
  if (d.largest_diameter > 0 && d.largest_diameter <= d.crimped_diameter)
    root.refuse("largest_diameter", "must be above the crimped one, " + mm(d.crimped_diameter));
  root.finish();
  return d;
}

/// \throws Error (geometry) what no solid has for its surface
void require_closed(const vessels::Surface& surface) {
  const vessels::Topology facts = vessels::topology(surface.mesh);
  std::string faults;
  const auto add = [&](std::size_t count, const std::string& noun, const std::string& what) {
    if (count > 0)
      faults += (faults.empty() ? "" : ", ") + vessels::counted(count, noun) + " " + what;
  };
  add(facts.boundary_loops.size(), "open rim", "(a stent's surface is closed)");
  add(facts.non_manifold_edges.size(), "edge", "of more than two triangles");
  add(facts.inconsistent_edges.size(), "edge", "between triangles that face opposite ways");
  if (!faults.empty())
    throw Error(ExitCode::geometry, surface.path + ": is no solid's surface: " + faults);
}

void list_findings(const vessels::Surface& surface, SurfaceDesign& design) {
  for (const vessels::Finding& finding : surface.findings) {
    if (finding.severity == vessels::Finding::Severity::note) continue;
    design.findings.push_back(surface.path + ": " + finding.text);
  }
  const std::size_t crossings = vessels::self_intersections(surface.mesh).size();
  if (crossings > 0) {
    design.findings.push_back(
        surface.path + ": " + vessels::counted(crossings, "pair") +
        " of triangles cross; the metal is the union of what they enclose, and the depth of a wall "
        "that sinks into it may be read too small there");
  }
}

/// Median radial thickness over the outer surface, by area; that of the whole wall where no ray
/// finds it.
double radial_thickness(const stents::StraightSurface& s) {
  const sdf::BoxTree tree = sdf::triangle_tree(s.mesh);
  std::vector<std::pair<double, double>> found;  // thickness, area
  double total = 0;
  const double skip = 1e-6 * s.outer_radius;  // past the facet that the ray leaves
  for (const Triangle& t : s.mesh.triangles) {
    const Vec3& a = s.mesh.points[static_cast<std::size_t>(t[0])];
    const Vec3& b = s.mesh.points[static_cast<std::size_t>(t[1])];
    const Vec3& c = s.mesh.points[static_cast<std::size_t>(t[2])];
    const Vec3 centre = (a + b + c) / 3, area = 0.5 * (b - a).cross(c - a);
    const Vec3 outward = Vec3(centre.x(), centre.y(), 0).normalized();
    const double share = area.dot(outward);
    if (!(share > kOuterFacet * area.norm())) continue;
    const double thickness =
        skip + sdf::first_crossing(s.mesh, tree, centre - skip * outward, -outward, s.outer_radius);
    if (!std::isfinite(thickness)) continue;
    found.emplace_back(thickness, share);
    total += share;
  }
  std::sort(found.begin(), found.end());
  double sum = 0;
  for (const auto& [thickness, share] : found) {
    sum += share;
    if (sum >= 0.5 * total) return thickness;
  }
  return s.outer_radius - s.inner_radius;
}

void measure_struts(SurfaceDesign& design) {
  const stents::StraightSurface& s = design.surface;
  design.thickness = radial_thickness(s);
  // A long rectangle w by t has volume over area w t / (2 (w + t)).
  const double mean = 4 * s.volume / s.area;
  const double excess = 2 * design.thickness - mean;
  const double whole_way_round = 2 * std::numbers::pi * s.outer_radius;
  design.width =
      excess > 0 ? std::min(mean * design.thickness / excess, whole_way_round) : whole_way_round;
}

/// Only corners are placed on a bend: facets are cut until they follow one as tight as the stent is
/// wide to a twentieth of the metal's thickness; a chord of length e sags by e^2 / (8 R).
void cut_long_facets(SurfaceDesign& design) {
  const double longest = std::sqrt(8 * design.surface.outer_radius * 0.05 * design.thickness);
  constexpr std::size_t kVertexLimit = 5'000'000;
  design.surface.mesh =
      vessels::refine(
          design.surface.mesh, [&](int, const Vec3&) { return longest; }, kVertexLimit)
          .mesh;
}

}  // namespace

bool is_surface_design(const std::string& design) {
  const std::string extension = vessels::extension(design);
  if (extension == ".stl" || extension == ".vtp" || extension == ".vtk" || extension == ".obj")
    return true;
  if (extension != ".json") return false;
  const nlohmann::json json = vessels::read_json(design);
  return json.is_object() && json.contains("surface");
}

SurfaceDesign read_surface_design(const std::string& path) {
  Description d;
  if (vessels::extension(path) == ".json") {
    d = read_description(path);
  } else {
    d.file = path;
    d.name = d.file.stem().string();
  }
  const vessels::Surface surface =
      vessels::read_surface(d.file, d.unit.value_or(vessels::LengthUnit::mm));
  require_closed(surface);
  SurfaceDesign design;
  design.name = d.name;
  design.cell = d.cell;
  design.crimped_diameter = d.crimped_diameter;
  design.largest_diameter = d.largest_diameter;
  try {
    design.surface = stents::on_its_axis(surface.mesh, d.axis);
  } catch (const std::invalid_argument& no_stent) {
    throw Error(ExitCode::geometry, surface.path + ": " + no_stent.what());
  }
  if (d.flip) design.surface = stents::turned_around(std::move(design.surface));
  list_findings(surface, design);
  measure_struts(design);
  cut_long_facets(design);
  // No stent is finer than a neurovascular flow diverter's delivery wire or wider than an aorta.
  constexpr double kSmallest = 0.3, kLargest = 60;
  const double diameter = 2 * design.surface.outer_radius;
  if (diameter < kSmallest || diameter > kLargest) {
    throw Error(ExitCode::usage, path + ": an outer diameter of " + mm(diameter) +
                                     " is no stent's (" + mm(kSmallest) + " to " + mm(kLargest) +
                                     "); give the surface's unit in a " +
                                     "design file, {\"surface\": \"" + d.file.filename().string() +
                                     "\", \"unit\": \"cm\"}");
  }
  if (!d.unit) design.findings.push_back(path + ": its coordinates are taken for millimetres");
  return design;
}

void require_reachable(const SurfaceDesign& design, double smallest, double largest,
                       const std::string& key) {
  const double wall = design.surface.outer_radius - design.surface.inner_radius;
  if (smallest <= 2 * wall) {
    throw Error(ExitCode::usage, key + ": the surface's wall is " + mm(wall) +
                                     " thick and fills a diameter of " + mm(2 * wall) + "; " +
                                     mm(smallest) + " is too small");
  }
  if (design.crimped_diameter > 0 && smallest < design.crimped_diameter) {
    throw Error(ExitCode::usage, key + ": " + mm(smallest) + " is below the crimped diameter of " +
                                     mm(design.crimped_diameter));
  }
  if (design.largest_diameter > 0 && largest > design.largest_diameter) {
    throw Error(ExitCode::usage, key + ": " + mm(largest) + " is beyond the largest diameter of " +
                                     mm(design.largest_diameter));
  }
}

std::string limits_of(const SurfaceDesign& design, double diameter) {
  const double ratio = 0.5 * diameter / design.surface.outer_radius;
  return design.name + ": a surface without a mechanism: from " +
         mm(2 * design.surface.outer_radius) + " to " + mm(diameter) +
         " it keeps its thickness of " + mm(design.thickness) + " and its length of " +
         mm(design.surface.length) + ", and everything around it is " + number(ratio) +
         " times as wide, struts too";
}

}  // namespace vstent::deployment
