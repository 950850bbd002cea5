#include "deployment/results.hpp"

#include <algorithm>
#include <nlohmann/json.hpp>
#include <sstream>

#include "deployment/surface_metrics.hpp"
#include "measure/report_files.hpp"
#include "stents/cover.hpp"
#include "stents/pattern_metrics.hpp"
#include "vessels/error.hpp"
#include "vessels/file_guard.hpp"
#include "vessels/text.hpp"

namespace vstent::deployment {
namespace fs = std::filesystem;
namespace {

using vessels::exact;

std::string history_csv(const std::vector<StepRecord>& history) {
  std::ostringstream csv;
  csv << "step,settling,expansion,radius_mm,straightening,contacts,largest_move_mm,relative_"
         "residual,contact_force_N,"
         "energy_N_mm,deepest_in_struts_mm,vertices,stent_shift_mm,stent_unbalanced,self_"
         "contacts\n";
  for (const StepRecord& r : history) {
    csv << r.step << ',' << r.settling << ',' << exact(r.expansion) << ',' << exact(r.radius) << ','
        << exact(r.straightening) << ',' << r.contacts << ',' << exact(r.largest_move) << ','
        << exact(r.residual) << ',' << exact(r.contact_force) << ',' << exact(r.energy) << ','
        << exact(r.deepest) << ',' << r.vertices << ',' << exact(r.stent_shift) << ','
        << exact(r.stent_unbalanced) << ',' << r.self_contacts << '\n';
  }
  return csv.str();
}

sdf::LevelSet stent_level_set(const Setup& setup, const StentShape& stent) {
  return voxelised(stent, {*setup.specification.voxel_size, 3});
}

/// In the unit of the vessel's file.
void write_mesh(const Setup& setup, TriangleMesh mesh, const fs::path& path) {
  for (Vec3& p : mesh.points) p /= vessels::millimetres_per(setup.surface.unit);
  const vessels::Surface surface = vessels::make_surface(std::move(mesh), "stent");
  vessels::write_surface(surface, surface.mesh.points,
                         std::vector<char>(surface.mesh.points.size(), 0), path);
}

void write_cover(const Setup& setup, const Outcome& outcome, const fs::path& path) {
  const stents::Specification& design = setup.design_specification;
  write_mesh(
      setup,
      stents::cover_surface(design.cover, outcome.axis, outcome.radii, design.section.thickness),
      path);
}

std::string step_name(const std::string& what, int step) {
  std::string digits = std::to_string(step);
  digits.insert(0, digits.size() < 5 ? 5 - digits.size() : 0, '0');
  return what + "_" + digits + ".vtp";
}

/// The result on the vertices it is handed on with: those of the simulation, or the input's own.
struct Handover {
  const vessels::Surface& surface;
  std::vector<Vec3> positions;
  std::vector<char> moved;
};

Handover handover(const Setup& setup, const Outcome& outcome) {
  if (!setup.unrefined || setup.specification.keep_refined)
    return {setup.surface, outcome.positions, outcome.moved};
  // Refining appends: the input's vertices come first.
  const auto count = static_cast<std::ptrdiff_t>(setup.unrefined->mesh.points.size());
  return {*setup.unrefined,
          {outcome.positions.begin(), outcome.positions.begin() + count},
          {outcome.moved.begin(), outcome.moved.begin() + count}};
}

measure::Comparison comparison_for(const Setup& setup, const Outcome& outcome,
                                   const Handover& result, const vessels::Surface& written,
                                   const measure::StentBody& stent) {
  measure::Comparison comparison{result.surface, written, setup.centerline, &stent};
  comparison.way = setup.placement.way;
  comparison.stent_axis_before = setup.placement.axis;
  comparison.stent_axis_after = outcome.axis;
  for (const double r : outcome.nominal_radii) comparison.target.push_back(2 * r);
  comparison.movable = result.moved;
  return comparison;
}

/// 1 for the triangles that may have moved.
std::vector<char> patch_triangles(const Handover& result) {
  std::vector<char> marks;
  for (const Triangle& t : result.surface.mesh.triangles) {
    marks.push_back(std::any_of(
        t.begin(), t.end(), [&](int v) { return result.moved[static_cast<std::size_t>(v)] != 0; }));
  }
  return marks;
}

void write_strut_lines(const Setup& setup, const stents::PlacedStent& struts,
                       const fs::path& path) {
  std::vector<Polyline> lines;
  std::vector<double> radii;
  std::map<std::string, std::vector<int>> arrays;
  for (const stents::PlacedMember& member : struts.members) {
    Polyline& line = lines.emplace_back(member.points);
    if (member.closed) line.push_back(line.front());
    radii.resize(radii.size() + line.size(), 0.5 * struts.section.width);
    arrays["Kind"].push_back(static_cast<int>(member.kind));
    arrays["Ring"].push_back(member.ring);
  }
  vessels::write_polylines(lines, {{"Radius", radii}}, arrays, path,
                           1 / vessels::millimetres_per(setup.surface.unit));
}

nlohmann::ordered_json design_json(const Setup& setup, const Outcome& outcome) {
  const stents::Specification& specification = setup.design_specification;
  const double crimped_length =
      setup.design->expanded(setup.design->limits().crimped_diameter).length;
  const double length = setup.placement.arc.back();
  const stents::PatternMetrics pattern =
      stents::measure(expanded_pattern(*setup.design, setup.stent, setup.start_radius, 1));
  nlohmann::ordered_json json;
  json["name"] = specification.name;
  json["family"] = stents::family(specification);
  json["length_mm"] = length;
  json["nominal_length_mm"] = setup.specification.length;
  json["crimped_length_mm"] = crimped_length;
  json["foreshortening_percent"] = 100 * (1 - length / crimped_length);
  json["percent_metal_to_artery"] = 100 * pattern.metal_to_artery;
  json["cells"] = pattern.cells.size();
  json["median_cell_mm2"] = pattern.median_cell;
  json["largest_cell_mm2"] = pattern.largest_cell;
  json["largest_inscribed_circle_mm"] = pattern.largest_circle;
  json["struts"] = pattern.struts;
  json["connectors"] = pattern.connectors;
  json["largest_diameter_mm"] = setup.design->limits().largest_diameter;
  json["balloon_diameter_for_recoil_mm"] =
      *setup.specification.diameter / (1 - specification.recoil);
  json["largest_strut_strain"] = outcome.struts->largest_strut_strain;
  json["largest_connector_strain"] = outcome.struts->largest_connector_strain;
  json["overlapping_rings"] = outcome.struts->overlapping_rings;
  return json;
}

nlohmann::ordered_json surface_design_json(const Setup& setup) {
  const SurfaceDesign& design = *setup.surface_design;
  const double radius = design.surface.outer_radius;
  nlohmann::ordered_json json;
  json["name"] = design.name;
  json["family"] = "surface";
  json["length_mm"] = design.surface.length;
  json["surface_outer_diameter_mm"] = 2 * radius;
  json["widened_by"] = 0.5 * *setup.specification.diameter / radius;
  json["thickness_mm"] = design.thickness;
  json["strut_width_mm"] = design.width;
  json["metal_mm3"] = design.surface.volume;
  return json;
}

/// Of the surface, then of the case, then of the run.
std::vector<std::string> all_warnings(const Setup& setup, const Outcome& outcome) {
  std::vector<std::string> warnings;
  for (const vessels::Finding& finding : setup.check.findings) {
    using Severity = vessels::Finding::Severity;
    if (finding.severity == Severity::note) continue;
    warnings.push_back((finding.severity == Severity::repaired ? "repaired: " : "") + finding.text);
  }
  warnings.insert(warnings.end(), setup.warnings.begin(), setup.warnings.end());
  const std::vector<std::string> of_contact = warnings_of(outcome.self_contact);
  warnings.insert(warnings.end(), of_contact.begin(), of_contact.end());
  if (outcome.given_way) {
    if (const auto narrowed = narrowed_warning(*outcome.given_way)) warnings.push_back(*narrowed);
  }
  return warnings;
}

}  // namespace

void StepSaver::save(const StepRecord& record, std::span<const Vec3> patch_positions) {
  if (steps_.empty()) fs::create_directory(stage_ / "steps");
  std::vector<Vec3> positions = setup_.surface.mesh.points;
  std::vector<char> moved(positions.size(), 0);
  for (std::size_t i = 0; i < patch_positions.size(); ++i) {
    const auto v = static_cast<std::size_t>(setup_.region.vertices[i]);
    positions[v] = patch_positions[i];
    moved[v] = !setup_.region.pinned[i];
  }
  vessels::write_surface(setup_.surface, positions, moved,
                         stage_ / "steps" / step_name("wall", record.step));
  const StentState state = stent_state(setup_, record.expansion);
  write_mesh(setup_, surface_of(shape_of(setup_, state), {*setup_.specification.voxel_size, 3}),
             stage_ / "steps" / step_name("stent", record.step));
  steps_.push_back(record.step);
}

void StepSaver::write_list() const {
  if (steps_.empty()) return;
  std::ostringstream list;
  list
      << "<?xml version=\"1.0\"?>\n<VTKFile type=\"Collection\" version=\"0.1\">\n  <Collection>\n";
  for (const int step : steps_) {
    list << "    <DataSet timestep=\"" << step << "\" part=\"0\" file=\"steps/"
         << step_name("wall", step) << "\"/>\n"
         << "    <DataSet timestep=\"" << step << "\" part=\"1\" file=\"steps/"
         << step_name("stent", step) << "\"/>\n";
  }
  list << "  </Collection>\n</VTKFile>\n";
  vessels::write_whole(stage_ / "steps.pvd", list.str());
}

Metrics write_results(const Setup& setup, const Outcome& outcome, const fs::path& stage) {
  const Handover result = handover(setup, outcome);
  const vessels::Surface& surface = result.surface;
  const sdf::LevelSet level_set = stent_level_set(setup, outcome.stent);
  try {
    level_set.write(stage / "stent.vdb", "stent");
  } catch (const std::runtime_error& error) {
    throw Error(ExitCode::output, std::string("stent.vdb: ") + error.what());
  }
  const measure::StentBody stent(level_set);
  const bool is_surface = std::holds_alternative<TriangleMesh>(outcome.stent);
  write_mesh(setup, is_surface ? std::get<TriangleMesh>(outcome.stent) : stent.surface(),
             stage / "stent.vtp");
  if (setup.design && stents::covered(setup.design_specification.cover))
    write_cover(setup, outcome, stage / "cover.vtp");
  if (outcome.struts) write_strut_lines(setup, *outcome.struts, stage / "struts.vtp");
  vessels::write_centerline(setup.centerline, surface.unit, stage / "centerline.vtp");
  vessels::write_whole(stage / "case.json", to_json(setup.specification).dump(2) + "\n");
  vessels::write_whole(stage / "history.csv", history_csv(outcome.history));

  // What is measured is what was written: first without the fields, which follow from it.
  const fs::path stented = stage / "stented.vtp";
  vessels::write_surface(surface, result.positions, result.moved, stented);
  const vessels::Surface written = vessels::read_surface(stented, surface.unit);
  measure::Measurement measurement =
      measure::measure(comparison_for(setup, outcome, result, written, stent));
  vessels::write_surface(surface, result.positions, result.moved, stented,
                         measurement.vertex_fields, measurement.triangle_fields);
  Metrics& metrics = measurement.metrics;
  if (outcome.struts) {
    metrics.struts =
        measure::measure_struts(written.mesh, patch_triangles(result), *outcome.struts,
                                std::get<sdf::Solid>(outcome.stent), {outcome.axis, outcome.radii});
    const double crimped = setup.design->expanded(setup.design->limits().crimped_diameter).length;
    metrics.stent.foreshortening = 100 * (1 - setup.placement.arc.back() / crimped);
    metrics.stent.recoil = 100 * setup.design_specification.recoil;
  }
  if (outcome.surface) {
    metrics.struts = measure_surface(written.mesh, patch_triangles(result), *setup.surface_design,
                                     *outcome.surface, {outcome.axis, outcome.radii});
  }
  vessels::write_whole(stage / "profiles.csv", measure::profiles_csv(metrics));
  measure::write_sections(metrics, surface.unit, stage / "sections.vtp");
  nlohmann::ordered_json json = measure::to_json(metrics);
  if (setup.design) json["design"] = design_json(setup, outcome);
  if (setup.surface_design) json["design"] = surface_design_json(setup);
  json["simulation"] = {
      {"converged", outcome.converged},
      {"steps", outcome.history.empty() ? 0 : outcome.history.back().step},
      {"relative_residual", outcome.history.empty() ? 0 : outcome.history.back().residual},
      {"contact_force_N", outcome.contact_force}};
  if (*setup.specification.self_collision) {
    const SelfContact& contact = outcome.self_contact;
    json["self_contact"] = {{"places", contact.places},
                            {"least_clearance_mm", contact.least_clearance},
                            {"force_N", contact.force},
                            {"pushed_aside_mm", contact.pushed_aside},
                            {"places_against_held_wall", contact.against_held}};
  }
  if (outcome.given_way) {
    const GivenWay& given = *outcome.given_way;
    json["simulation"]["stent_shift_mm"] = given.shift;
    json["simulation"]["stent_unbalanced"] = given.unbalanced;
    json["simulation"]["stent_smallest_diameter_mm"] = given.smallest_diameter;
    json["simulation"]["stent_looks"] = given.looks;
  }
  json["warnings"] = all_warnings(setup, outcome);
  vessels::write_whole(stage / "metrics.json", json.dump(2) + "\n");
  return metrics;
}

void require_sound(const Metrics& m, const fs::path& surface) {
  if (m.inverted_triangles == 0 && m.new_self_intersections == 0) return;
  throw Error(
      ExitCode::numerical,
      surface.string() + ": the stented surface is damaged (" +
          std::to_string(m.inverted_triangles) + " inverted triangles, " +
          std::to_string(m.new_self_intersections) + " new self-intersections, at " +
          vessels::place(*m.damaged_at) +
          " mm); try a smaller diameter or growth_per_step, /contact/friction where the wall "
          "slides along a smooth stent, or /wall/self_collision where walls meet");
}

}  // namespace vstent::deployment
