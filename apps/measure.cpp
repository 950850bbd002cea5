// vstent measure: what did a stent do, on two surfaces from any tool.
#include "measure/measure.hpp"

#include <iostream>
#include <memory>
#include <nlohmann/json.hpp>

#include "apps/commands.hpp"
#include "apps/terminal.hpp"
#include "measure/report_files.hpp"
#include "vessels/error.hpp"
#include "vessels/file_guard.hpp"

namespace vstent::apps {
namespace {

struct Arguments {
  std::string before, after, units, centerline, stent, diameter, out;
  std::string profiles, sections, surface;
  bool definitions = false;
  ThreadLimit threads;
};

measure::StentBody read_stent(const std::string& path) {
  try {
    return measure::StentBody(sdf::LevelSet::read(path));
  } catch (const std::runtime_error& fault) {
    throw Error(ExitCode::input_file, fault.what());
  }
}

vessels::Centerline centerline_of(const Arguments& a, const vessels::Surface& before) {
  if (a.centerline.empty()) return vessels::extract_centerline(before);
  vessels::Centerline centerline = vessels::read_centerline(a.centerline, before.unit);
  vessels::fill_radii(centerline, before);
  return centerline;
}

void require(const std::string& value, const char* what) {
  if (value.empty())
    throw Error(ExitCode::usage, std::string("command line: ") + what + " is missing");
}

void run(const Arguments& a) {
  if (a.definitions) {
    std::cout << measure::definitions_markdown();
    return;
  }
  require(a.before, "the surface before");
  require(a.after, "the surface after");
  require(a.units, "--units (mm, cm or m, of both surfaces)");
  a.threads.apply();
  const vessels::LengthUnit unit = vessels::parse_unit(a.units);
  const double nominal =
      a.diameter.empty() ? 0 : vessels::parse_length(a.diameter, unit, "--diameter");
  if (!a.diameter.empty() && !(nominal > 0))
    throw Error(ExitCode::usage, "command line: --diameter: must be positive");
  Progress progress;
  progress.show("reading ...");
  const vessels::Surface before = vessels::read_surface(a.before, unit);
  const vessels::Surface after = vessels::read_surface(a.after, unit);
  std::optional<measure::StentBody> stent;
  if (!a.stent.empty()) stent = read_stent(a.stent);
  progress.show("finding the centerline ...");
  const vessels::Centerline centerline = centerline_of(a, before);
  progress.show("measuring ...");
  measure::Comparison comparison{before, after, centerline, stent ? &*stent : nullptr};
  comparison.nominal_diameter = nominal;
  const measure::Measurement result = measure::measure(comparison);
  const nlohmann::ordered_json json = measure::to_json(result.metrics);
  if (!a.surface.empty()) {
    vessels::write_surface(after, after.mesh.points, std::vector<char>(after.mesh.points.size(), 0),
                           a.surface, result.vertex_fields, result.triangle_fields);
  }
  if (!a.sections.empty()) measure::write_sections(result.metrics, unit, a.sections);
  if (!a.profiles.empty()) vessels::write_whole(a.profiles, measure::profiles_csv(result.metrics));
  if (!a.out.empty()) vessels::write_whole(a.out, json.dump(2) + "\n");
  progress.clear();
  std::cout << measure::text_table(json) << kDisclaimer << '\n';
}

}  // namespace

void add_measure(CLI::App& app) {
  auto* command =
      app.add_subcommand("measure", std::string("Measure what a stent did. ") + kDisclaimer);
  auto a = std::make_shared<Arguments>();
  command->add_option("before", a->before, "Lumen surface before (.vtp .vtk .stl .obj)");
  command->add_option("after", a->after, "And after, by whatever tool, remeshed or not");
  command->add_option("--units,--unit", a->units, "Length unit of both surfaces: mm, cm or m");
  command->add_option("--centerline", a->centerline,
                      "Centerline of the surface before; default: extracted");
  command->add_option("--stent", a->stent, "The stent as a level set (.vdb, in mm)");
  command->add_option("--diameter", a->diameter, "Its nominal diameter with unit (11mm)");
  command->add_option("-o,--out", a->out, "metrics.json");
  command->add_option("--profiles", a->profiles, "profiles.csv: the lumen along the centerline");
  command->add_option("--sections", a->sections, "sections.vtp: the outlines of all sections");
  command->add_option("--surface", a->surface,
                      "The surface after (.vtp) with Displacement, StretchCircumferential, "
                      "StretchAxial, AreaRatio, StentDistance as far as they are known");
  command->add_flag("--definitions", a->definitions,
                    "Print what every figure means, as a Markdown table");
  a->threads.add_option(*command);
  command->footer(
      "Examples:\n"
      "  vstent measure wall.stl OUT/stented.vtp --units mm --stent OUT/stent.vdb -o metrics.json\n"
      "  vstent measure pre.vtp post.stl --units cm --centerline cl.vtp --profiles profiles.csv\n"
      "Where the surfaces do not have the same triangles, what needs corresponding places "
      "(stretch, "
      "displacement) is null in metrics.json, and `unmeasured` there says why.");
  command->callback([a] { run(*a); });
}

}  // namespace vstent::apps
