#include "apps/flow_run.hpp"

#include <algorithm>
#include <iostream>
#include <nlohmann/json.hpp>

#include "apps/display.hpp"
#include "apps/plot.hpp"
#include "deployment/case.hpp"
#include "flow/report.hpp"
#include "sdf/polyline.hpp"
#include "vessels/error.hpp"
#include "vessels/file_guard.hpp"
#include "vessels/json_object.hpp"

namespace vstent::apps {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

double lumen_figure(const json& metrics, const std::string& file, const char* key) {
  const json::json_pointer pointer(std::string("/lumen/") + key);
  if (!metrics.contains(pointer) || !metrics[pointer].is_number())
    throw Error(ExitCode::input_file, file + ": has no number at /lumen/" + key);
  return metrics[pointer].get<double>();
}

/// The stented stretch, on the way that the stent was placed on.
flow::Stretch treated_stretch(const fs::path& out, const vessels::Centerline& centerline,
                              const deployment::Case& given) {
  const fs::path file = out / "metrics.json";
  const json metrics = vessels::read_json(file);
  const int towards = given.towards.value_or(-1);
  if (towards >= static_cast<int>(centerline.branches.size())) {
    throw Error(ExitCode::input_file, (out / "case.json").string() +
                                          ": /stent/towards: centerline.vtp has no branch " +
                                          std::to_string(towards));
  }
  const vessels::CenterlinePath way = vessels::paths(centerline, towards).front();
  const auto place = [&](const char* key) {
    return point_at(way.points, way.arc_length, lumen_figure(metrics, file.string(), key));
  };
  flow::Stretch stretch{place("treated_from_mm"), place("treated_to_mm"), given.diameter.value_or(0)};
  for (const char* reference : {"reference_proximal_mm", "reference_distal_mm"}) {
    const json::json_pointer pointer(std::string("/lumen/") + reference);
    if (metrics.contains(pointer) && metrics[pointer].is_number())
      stretch.diameter = std::max(stretch.diameter, metrics[pointer].get<double>());
  }
  return stretch;
}

std::vector<PlotPoint> pressure_line(const flow::Study& study, const flow::Answer& answer) {
  std::vector<PlotPoint> line;
  for (std::size_t k = 0; k < study.path.branches.size(); ++k) {
    const auto b = static_cast<std::size_t>(study.path.branches[k]);
    const std::vector<double>& arc = study.tree.branches[b].arc;
    for (std::size_t i = 0; i < arc.size(); ++i)
      line.push_back(
          {study.path.start[k] + arc[i], answer.mean_pressure[b][i] / flow::kDynPerCm2PerMmHg});
  }
  return line;
}

}  // namespace

FlowInput read_result(const fs::path& out) {
  for (const char* name : {"case.json", "centerline.vtp", "stented.vtp", "metrics.json"}) {
    if (!fs::exists(out / name))
      throw Error(ExitCode::input_file,
                  out.string() + ": has no " + name + "; give a result folder of `vstent deploy`");
  }
  const deployment::Case given = deployment::read_case(out / "case.json");
  FlowInput input;
  vessels::Surface stented = vessels::read_surface(out / "stented.vtp", given.unit);
  input.centerline = vessels::read_centerline(out / "centerline.vtp", given.unit);
  input.stretch = treated_stretch(out, input.centerline, given);
  if (fs::exists(given.surface)) {
    input.before = vessels::read_surface(given.surface, given.unit);
    input.after = std::move(stented);
  } else {
    input.notes.push_back(given.surface.string() +
                          " is not there any more: only the stented surface is looked at");
    input.before = std::move(stented);
  }
  return input;
}

FlowInput read_surface_alone(const fs::path& surface, vessels::LengthUnit unit,
                             const fs::path& centerline) {
  FlowInput input;
  input.before = vessels::read_surface(surface, unit);
  if (centerline.empty()) {
    input.centerline = vessels::extract_centerline(input.before);
  } else {
    input.centerline = vessels::read_centerline(centerline, unit);
    vessels::fill_radii(input.centerline, input.before);
  }
  return input;
}

void ConditionOptions::add_options(CLI::App& command, const std::string& name) {
  name_ = name;
  command.add_option(name + ",--boundary-conditions", file,
                     "Boundary conditions (bc.json; docs/boundary-conditions.md)");
  command.add_option("--inflow", inflow,
                     "Instead: flow into the inlet with unit (\"85 mL/s\"), or a .flow or .csv "
                     "file; outlets are then assumed");
  command.add_option("--inflow-units", inflow_units, "Unit of that file's values (mL/s, m/s)");
  command.add_option("--pressure", pressure, "With --inflow: mean pressure at the outlets")
      ->capture_default_str();
}

void ConditionOptions::check() const {
  if (file.empty() == inflow.empty()) {
    throw Error(ExitCode::usage, "command line: give either " + name_ +
                                     " bc.json or --inflow (\"85 mL/s\", or a .flow or .csv file)");
  }
  if (!file.empty()) {
    flow::read_boundary_conditions(file);
    return;
  }
  std::vector<std::string> notes;
  read_inflow(notes);
  const std::string key = "command line: --pressure";
  if (!(flow::parse_quantity(pressure, flow::Dimension::pressure, key) > 0))
    throw Error(ExitCode::usage, key + ": must be positive, is " + pressure);
}

flow::BoundaryConditions ConditionOptions::read(const FlowInput& input) const {
  if (!file.empty()) return flow::read_boundary_conditions(file);
  std::vector<std::string> notes;
  const flow::Inflow into = read_inflow(notes);
  flow::BoundaryConditions result = flow::assumed_conditions(
      input.question(), into, flow::parse_quantity(pressure, flow::Dimension::pressure, ""), {});
  result.notes.insert(result.notes.begin(), notes.begin(), notes.end());
  return result;
}

flow::Inflow ConditionOptions::read_inflow(std::vector<std::string>& notes) const {
  const std::string key = "command line: --inflow";
  const std::string extension = vessels::extension(inflow);
  if (extension != ".flow" && extension != ".csv") {
    const double value = flow::parse_quantity(inflow, flow::Dimension::flow, key);
    if (!(value > 0)) throw Error(ExitCode::usage, key + ": must be positive, is " + inflow);
    return {flow::constant(value), false};
  }
  flow::WaveformFile waves = flow::read_waveform(inflow, inflow_units, key + "-units");
  notes.insert(notes.end(), waves.notes.begin(), waves.notes.end());
  return flow::inflow_of(std::move(waves), std::nullopt, inflow, key, notes);
}

Figure pressure_figure(const flow::Study& study) {
  const std::vector<PlotPoint> after = pressure_line(study, study.after);
  const std::vector<PlotPoint> before =
      study.before ? pressure_line(study, *study.before) : std::vector<PlotPoint>{};
  Range x, y;
  for (const auto* line : {&before, &after}) {
    for (const PlotPoint& point : *line) {
      x.include(point.x);
      y.include(*point.y);
    }
  }
  const double margin = std::max(0.06 * (y.high - y.low), 0.1);
  y = {y.low - margin, y.high + margin};
  Plot plot(x, y);
  plot.shade(study.stretch_from, study.stretch_to, {63, 111, 159, 0.09});
  plot.axes("along the vessel (mm)", "mean pressure (mmHg)");
  for (const double place : {study.proximal.along, study.distal.along})
    plot.mark(place, kTargetColour);
  const Stroke grey{{}, kBeforeColour, 2.4}, red{{}, kAfterColour, 2.6},
      blue{{}, kTargetColour, 1.2};
  std::vector<Plot::Entry> entries;
  if (study.before) {
    plot.line(before, grey, false);
    entries.push_back({"before", grey});
  }
  plot.line(after, red, false);
  entries.push_back({study.before ? "after" : "now", red});
  entries.push_back({"drop taken between", blue, true});
  plot.legend(entries);
  return plot.take();
}

void draw(const Figure& figure, const fs::path& png) {
  const OffscreenDisplay display;
  if (display.available()) {
    write_png(figure, png);
  } else {
    std::cerr << "warning: no picture: " << display.reason() << '\n';
  }
}

void write_flow(const flow::Study& study, const flow::BoundaryConditions& conditions,
                vessels::LengthUnit unit, const fs::path& folder, bool pictures) {
  vessels::write_whole(folder / "flow.json", flow::to_json(study, conditions).dump(2) + "\n");
  const Figure figure = pressure_figure(study);
  vessels::write_whole(folder / "flow.svg", svg(figure));
  if (pictures) draw(figure, folder / "flow.png");
  flow::write_lines(study, unit, folder / "flow.vtp");
  const auto write_zero_d = [&](const flow::Answer& answer, const char* name) {
    vessels::write_whole(folder / name,
                         flow::zero_d_case(answer, study, conditions).dump(2) + "\n");
  };
  write_zero_d(study.after, "svzerod_after.json");
  if (study.before) write_zero_d(*study.before, "svzerod_before.json");
}

}  // namespace vstent::apps
