// vstent stent: a design at a diameter, straight or on a centerline, as a file.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <iostream>
#include <memory>

#include "apps/commands.hpp"
#include "apps/terminal.hpp"
#include "deployment/design_file.hpp"
#include "deployment/stent_shape.hpp"
#include "deployment/strut_solid.hpp"
#include "deployment/surface_design.hpp"
#include "sdf/level_set.hpp"
#include "sdf/polyline.hpp"
#include "stents/bent_tube.hpp"
#include "stents/cover.hpp"
#include "stents/expansion.hpp"
#include "stents/pattern_metrics.hpp"
#include "stents/surface_map.hpp"
#include "vessels/centerline.hpp"
#include "vessels/error.hpp"
#include "vessels/file_guard.hpp"
#include "vessels/text.hpp"

namespace vstent::apps {
namespace {

using stents::Pattern;
using stents::PlacedStent;
namespace fs = std::filesystem;

struct Arguments {
  std::string design, diameter, length, centerline, units, at, bending, voxel, out;
  ThreadLimit threads;
};

[[noreturn]] void refuse(const std::string& option, const std::string& what) {
  throw Error(ExitCode::usage, "command line: " + option + ": " + what);
}

double length_option(const std::string& text, const std::string& option) {
  if (text.empty() || !std::isalpha(static_cast<unsigned char>(text.back())))
    refuse(option, "needs a length with its unit, such as 3mm, is \"" + text + "\"");
  const double value =
      vessels::parse_length(text, vessels::LengthUnit::mm, "command line: " + option);
  if (!(value > 0)) refuse(option, "must be positive, is " + text);
  return value;
}

/// The stent's axis and the arc length (mm) on it where the stent begins.
struct Way {
  stents::AxisWithFrames axis;
  double start = 0;
};

Way straight_way(double length) {
  const Vec3 end = length * Vec3::UnitZ();
  return {stents::with_frames({Vec3::Zero(), end}, Vec3::UnitX()), 0};
}

/// "2:12mm": a branch and the arc length of the stent's middle along it.
std::pair<int, double> branch_and_arc(const std::string& at) {
  const std::size_t colon = at.find(':');
  try {
    std::size_t used = 0;
    const int branch = std::stoi(at.substr(0, colon), &used);
    if (colon != std::string::npos && used == colon)
      return {branch, vessels::parse_length(at.substr(colon + 1), vessels::LengthUnit::mm,
                                            "command line: --at")};
  } catch (const std::logic_error&) {
  }
  refuse("--at", "must be branch:arc length such as 2:12mm, is \"" + at + "\"");
}

Way centerline_way(const Arguments& a, double length, double outer_radius) {
  if (a.units.empty()) refuse("--units", "is missing: the centerline's length unit, mm, cm or m");
  const vessels::Centerline centerline =
      vessels::read_centerline(a.centerline, vessels::parse_unit(a.units));
  vessels::CenterlinePath path;
  double middle = 0;
  if (a.at.empty()) {
    path = vessels::paths(centerline).front();
    middle = 0.5 * path.arc_length.back();
  } else {
    const auto [branch, arc] = branch_and_arc(a.at);
    if (branch < 0 || branch >= static_cast<int>(centerline.branches.size())) {
      refuse("--at",
             "the centerline has branches 0 to " + std::to_string(centerline.branches.size() - 1));
    }
    const Polyline& line = centerline.branches[static_cast<std::size_t>(branch)].points;
    const std::vector<double> arcs = arc_lengths(line);
    if (arc < 0 || arc > arcs.back()) {
      refuse("--at", "branch " + std::to_string(branch) + " is " + vessels::number(arcs.back()) +
                         " mm long");
    }
    path = vessels::paths(centerline, branch).front();
    middle = nearest_place(path.points, path.arc_length, point_at(line, arcs, arc)).arc_length;
  }
  // Kinks that are finer than the stent is wide are the lumen's, not its axis's.
  const Vec3 centre = point_at(path.points, path.arc_length, middle);
  const Polyline axis = smooth_keeping_bends(
      resample(path.points, 0, path.arc_length.back(), outer_radius / 20), 0.75 * outer_radius);
  const Vec3 along = (axis[1] - axis[0]).normalized();
  int least = 0;
  along.cwiseAbs().minCoeff(&least);
  Way way{stents::with_frames(axis, Vec3::Unit(least)), 0};
  way.start = nearest_place(axis, way.axis.arc, centre).arc_length - 0.5 * length;
  const double end = way.start + length;
  if (way.start < 0 || end > way.axis.arc.back()) {
    std::cerr << "warning: the stent reaches "
              << vessels::number(std::max(-way.start, end - way.axis.arc.back()))
              << " mm over the end of the centerline, which is continued straight\n";
  }
  return way;
}

stents::Bending bending_of(const Arguments& a, const stents::Design& design) {
  if (a.bending == "rigid") return stents::Bending::rigid_rings;
  if (a.bending == "conforming") return stents::Bending::conforming;
  if (a.bending == "affine") return stents::Bending::affine;
  return design.cell() == stents::Cell::open ? stents::Bending::rigid_rings
                                             : stents::Bending::conforming;
}

/// Centre lines, closed ones ending where they began.
void write_lines(const PlacedStent& stent, double scale, const fs::path& path) {
  std::vector<Polyline> lines;
  std::map<std::string, std::vector<double>> per_point;
  std::map<std::string, std::vector<int>> per_line;
  for (const stents::PlacedMember& member : stent.members) {
    Polyline line = member.points;
    std::vector<Vec3> outward = member.outward;
    if (member.closed) {
      line.push_back(line.front());
      outward.push_back(outward.front());
    }
    for (const Vec3& n : outward) {
      per_point["Radius"].push_back(0.5 * stent.section.width);
      for (int k = 0; k < 3; ++k) per_point["Outward"].push_back(n[k]);
    }
    lines.push_back(std::move(line));
    per_line["Kind"].push_back(static_cast<int>(member.kind));
    per_line["Ring"].push_back(member.ring);
    per_line["NextRing"].push_back(member.next_ring);
  }
  vessels::write_polylines(lines, per_point, per_line, path, scale);
}

/// In the unit of the result; how many triangles there are.
std::string write_mesh(TriangleMesh mesh, double scale, const fs::path& path) {
  for (Vec3& p : mesh.points) p *= scale;
  const vessels::Surface surface = vessels::make_surface(std::move(mesh), "stent");
  vessels::write_surface(surface, surface.mesh.points,
                         std::vector<char>(surface.mesh.points.size(), 0), path);
  return vessels::counted(surface.mesh.triangles.size(), "triangle");
}

void append(TriangleMesh& mesh, const TriangleMesh& more) {
  const int first = static_cast<int>(mesh.points.size());
  mesh.points.insert(mesh.points.end(), more.points.begin(), more.points.end());
  for (const Triangle& t : more.triangles)
    mesh.triangles.push_back({t[0] + first, t[1] + first, t[2] + first});
}

/// The sleeves of a graft are part of its surface; a level set holds the metal only.
TriangleMesh cover_of(const stents::Specification& s, const Way& way, const Pattern& pattern,
                      double diameter) {
  const double spacing = 0.05 * diameter;
  const Polyline axis = resample(way.axis.points, way.start, way.start + pattern.length, spacing);
  try {
    return stents::cover_surface(s.cover, axis, std::vector<double>(axis.size(), 0.5 * diameter),
                                 s.section.thickness);
  } catch (const std::invalid_argument& error) {
    refuse("--diameter", error.what());
  }
}

void write_level_set(const deployment::StentShape& stent, double thinnest,
                     const TriangleMesh& cover, const Arguments& a, double scale) {
  const double voxel = a.voxel.empty() ? thinnest / 6 : length_option(a.voxel, "--voxel");
  Progress progress;
  progress.show("voxelising ...");
  const sdf::LevelSet level_set =
      deployment::voxelised(stent, {.voxel_size = voxel, .half_width = 3});
  std::string written = vessels::counted(level_set.active_voxels(), "voxel");
  if (vessels::extension(a.out) == ".vdb") {
    try {
      level_set.write(a.out, "stent");
    } catch (const std::runtime_error& error) {
      throw Error(ExitCode::output, a.out + ": " + error.what());
    }
  } else {
    TriangleMesh mesh = level_set.surface();
    append(mesh, cover);
    written += ", " + write_mesh(std::move(mesh), scale, a.out);
  }
  progress.clear();
  std::cout << "level set         voxels of " << vessels::number(voxel) << " mm, " << written
            << '\n';
}

void print_summary(const stents::Specification& s, const stents::Design& design,
                   const Pattern& pattern, double diameter) {
  const stents::Limits limits = design.limits();
  const double crimped = design.expanded(limits.crimped_diameter).length;
  const double nominal = design.expanded(limits.nominal_diameter).length;
  std::size_t connectors = 0, wires = 0;
  double metal = 0;
  for (const stents::Member& member : pattern.members) {
    connectors += member.kind == stents::Member::Kind::connector;
    wires += member.kind == stents::Member::Kind::wire;
    metal += arc_length(member);
  }
  std::printf("design            %s: %s\n", s.name.c_str(), s.description.c_str());
  std::printf("outer diameter    %.4g mm (crimped %.4g, nominal %.4g, limit %.4g)\n", diameter,
              limits.crimped_diameter, limits.nominal_diameter, limits.largest_diameter);
  std::printf("length            %.2f mm (nominal %.2f); %.1f %% shorter than crimped\n",
              pattern.length, nominal, 100 * (1 - pattern.length / crimped));
  std::string counts;
  if (!pattern.rings.empty()) counts += vessels::counted(pattern.rings.size(), "ring") + ", ";
  if (connectors > 0) counts += vessels::counted(connectors, "connector") + ", ";
  if (wires > 0) counts += vessels::counted(wires, "wire") + ", ";
  std::printf("metal             %s%.1f mm of strut\n", counts.c_str(), metal);
  const stents::PatternMetrics metrics = stents::measure(pattern);
  std::printf("metal to artery   %.1f %%\n", 100 * metrics.metal_to_artery);
  if (!metrics.cells.empty()) {
    std::printf("cells             %zu, of %.4g mm2 (median); a ball of %.3g mm fits through\n",
                metrics.cells.size(), metrics.median_cell, metrics.largest_circle);
  }
  if (s.recoil > 0) {
    std::printf("after deflation   %.4g mm (recoil %.1f %%)\n", diameter * (1 - s.recoil),
                100 * s.recoil);
  }
  if (stents::covered(s.cover)) {
    std::printf("cover             %.3g mm inside, %.3g mm outside; drawn in .stl only\n",
                s.cover.inner, s.cover.outer);
  }
}

/// On the way, a little longer than the surface at both ends.
stents::SurfaceMap map_onto(const Way& way, const stents::StraightSurface& surface, double radius) {
  const stents::BentTube tube(way.axis, way.start);
  const double over = 0.25 * radius;
  const double length = surface.length + 2 * over;
  const int pieces = std::max(1, static_cast<int>(std::ceil(20 * length / radius)));
  Polyline axis;
  for (int i = 0; i <= pieces; ++i) axis.push_back(tube.at(length * i / pieces - over).centre);
  std::vector<double> radii(axis.size(), radius);
  return {stents::with_frames(std::move(axis), tube.at(-over).frame.normal), over, std::move(radii),
          surface.outer_radius};
}

void draw_surface(const Arguments& a, double diameter, double scale) {
  if (!a.length.empty()) refuse("--length", "a surface has its own");
  if (!a.bending.empty()) refuse("--bending", "a surface has no struts that could stay rigid");
  if (!a.voxel.empty() && vessels::extension(a.out) != ".vdb")
    refuse("--voxel", "a surface stays one; only .vdb has voxels");
  const deployment::SurfaceDesign design = deployment::read_surface_design(a.design);
  deployment::require_reachable(design, diameter, diameter, "command line: --diameter");
  const stents::StraightSurface& surface = design.surface;
  const double radius = 0.5 * diameter;
  const Way way = a.centerline.empty() ? straight_way(surface.length)
                                       : centerline_way(a, surface.length, radius);
  const double tightest =
      1 / stents::BentTube(way.axis, way.start).largest_curvature(0, surface.length);
  if (tightest <= radius) {
    throw Error(ExitCode::geometry, a.centerline + ": its bend radius of " +
                                        vessels::number(tightest) + " mm is below the stent's own");
  }
  const stents::SurfaceMap map = map_onto(way, surface, radius);
  for (const std::string& finding : design.findings) std::cerr << "warning: " << finding << '\n';
  std::cerr << "warning: " << deployment::limits_of(design, diameter) << '\n';
  std::printf("design            %s: a surface of %zu triangles\n", design.name.c_str(),
              surface.mesh.triangles.size());
  std::printf("outer diameter    %.4g mm (the surface's %.4g)\n", diameter,
              2 * surface.outer_radius);
  std::printf("length            %.2f mm\n", surface.length);
  std::printf("metal             %.3g mm3, struts about %.3g mm wide and %.3g mm thick\n",
              surface.volume, design.width, design.thickness);
  TriangleMesh placed = map.placed(surface.mesh);
  if (vessels::extension(a.out) == ".vdb") {
    write_level_set(std::move(placed), std::min(design.width, design.thickness), {}, a, scale);
  } else {
    write_mesh(std::move(placed), scale, a.out);
  }
  std::cout << "result            " << a.out << '\n';
}

void run(const Arguments& a) {
  a.threads.apply();
  const std::string extension = vessels::extension(a.out);
  if (extension != ".stl" && extension != ".vtp" && extension != ".vdb")
    refuse("-o",
           "must end in .stl (surface), .vtp (centre lines) or .vdb (level set), is " + a.out);
  if (a.centerline.empty() && !(a.at + a.bending).empty())
    refuse(a.at.empty() ? "--bending" : "--at", "needs a --centerline");
  const double diameter = length_option(a.diameter, "--diameter");
  const double scale =
      a.units.empty() ? 1 : 1 / vessels::millimetres_per(vessels::parse_unit(a.units));
  if (deployment::is_surface_design(a.design)) return draw_surface(a, diameter, scale);
  if (extension == ".vtp" && !a.voxel.empty())
    refuse("--voxel", "centre lines have no voxels; use .stl or .vdb");
  const stents::Specification specification = deployment::find_design(a.design);
  std::optional<double> length;
  if (!a.length.empty()) length = length_option(a.length, "--length");
  std::unique_ptr<const stents::Design> design;
  try {
    design = stents::make_design(specification, length);
  } catch (const std::invalid_argument& error) {
    refuse("--length", error.what());
  }
  Pattern pattern;
  try {
    pattern = design->expanded(diameter);
  } catch (const std::invalid_argument& error) {
    refuse("--diameter", error.what());
  }
  const Way way = a.centerline.empty() ? straight_way(pattern.length)
                                       : centerline_way(a, pattern.length, 0.5 * diameter);
  PlacedStent stent;
  try {
    stent = stents::place(pattern, way.axis, way.start,
                          a.centerline.empty() ? stents::Bending::affine : bending_of(a, *design));
  } catch (const std::invalid_argument& error) {
    const bool conforming = bending_of(a, *design) == stents::Bending::conforming;
    throw Error(ExitCode::geometry,
                a.centerline + ": " + error.what() +
                    (conforming ? "; such a stent straightens its vessel (for a picture as it is: "
                                  "--bending affine)"
                                : ""));
  }
  print_summary(specification, *design, pattern, diameter);
  if (!stent.overlapping_rings.empty()) {
    std::cerr << "warning: " << vessels::counted(stent.overlapping_rings.size(), "pair")
              << " of rings touch on the inside of the bend\n";
  }
  if (extension == ".vtp") {
    write_lines(stent, scale, a.out);
  } else {
    write_level_set(deployment::strut_solid(stent),
                    std::min(stent.section.width, stent.section.thickness),
                    cover_of(specification, way, pattern, diameter), a, scale);
  }
  std::cout << "result            " << a.out << '\n';
}

}  // namespace

void add_stent(CLI::App& app) {
  auto* command = app.add_subcommand(
      "stent", std::string("Draw a stent design, straight or on a centerline. ") + kDisclaimer);
  auto a = std::make_shared<Arguments>();
  command
      ->add_option(
          "design", a->design,
          "A preset's name (see `vstent designs`), a design file (.json), or the surface of "
          "a straight stent (.stl .vtp .vtk .obj)")
      ->required();
  command->add_option("--diameter", a->diameter, "Outer diameter with unit (3mm)")->required();
  command->add_option("--length", a->length,
                      "Length with unit at nominal diameter (18mm); rings are counted out to come "
                      "nearest; default: the design's");
  command->add_option("--centerline", a->centerline,
                      "Centerline file (VMTK, SimVascular, polyline); default: straight along z");
  command->add_option("--units", a->units,
                      "Length unit of the centerline and of a .stl or .vtp result: mm, cm or m; "
                      ".vdb is in mm");
  command->add_option("--at", a->at,
                      "Branch and arc length of the stent's middle (2:12mm); default: middle of "
                      "the widest way");
  command
      ->add_option("--bending", a->bending,
                   "rigid (rings stay stiff; open cells), conforming (closed cells), affine "
                   "(struts stretch; for pictures)")
      ->check(CLI::IsMember({"rigid", "conforming", "affine"}));
  command->add_option("--voxel", a->voxel,
                      "Voxel size with unit; default: a sixth of the thinnest strut");
  command
      ->add_option("-o,--out", a->out,
                   ".stl (surface), .vtp (centre lines with radius; of a surface, the surface) or "
                   ".vdb (level set)")
      ->required();
  a->threads.add_option(*command);
  command->footer(
      "Examples:\n"
      "  vstent stent xience_s --diameter 3mm --length 18mm -o stent.stl\n"
      "  vstent stent cp8 --diameter 14mm --centerline cl.vtp --units mm --at 0:40mm -o stent.vtp\n"
      "  vstent stent mine.json --diameter 3mm --voxel 0.02mm -o stent.vdb\n"
      "  vstent stent my_stent.stl --diameter 3mm --centerline cl.vtp --units mm -o stent.stl");
  command->callback([a] { run(*a); });
}

}  // namespace vstent::apps
