// vstent compare: one vessel, several designs, side by side.
#include <cstdio>
#include <fstream>
#include <iostream>
#include <memory>
#include <nlohmann/json.hpp>
#include <set>
#include <sstream>

#include "apps/commands.hpp"
#include "apps/pictures.hpp"
#include "apps/run_case.hpp"
#include "apps/terminal.hpp"
#include "deployment/design_file.hpp"
#include "deployment/result_folder.hpp"
#include "vessels/error.hpp"
#include "vessels/file_guard.hpp"

namespace vstent::apps {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;
using nlohmann::ordered_json;

constexpr const char* kSmooth = "smooth";

/// A row of the table: a value of metrics.json.
struct Row {
  const char *label, *unit, *pointer;
};
constexpr Row kRows[] = {
    {"narrowest lumen before", "mm", "/lumen/narrowest_before_mm"},
    {"narrowest lumen after", "mm", "/lumen/narrowest_after_mm"},
    {"stenosis before", "%", "/lumen/diameter_stenosis_before_percent"},
    {"stenosis after", "%", "/lumen/diameter_stenosis_after_percent"},
    {"mean diameter over target", "", "/lumen/opened_mean_diameter_over_target"},
    {"bend of the stented axis before", "deg", "/shape/stent_bend_before_deg"},
    {"bend of the stented axis after", "deg", "/shape/stent_bend_after_deg"},
    {"stent length", "mm", "/design/length_mm"},
    {"foreshortening", "%", "/design/foreshortening_percent"},
    {"metal to artery", "%", "/design/percent_metal_to_artery"},
    {"median cell", "mm2", "/design/median_cell_mm2"},
    {"largest circle in a cell", "mm", "/design/largest_inscribed_circle_mm"},
    {"struts", "", "/design/struts"},
    {"connectors", "", "/design/connectors"},
    {"largest connector strain", "", "/design/largest_connector_strain"},
    {"mean gap to the wall", "mm", "/struts/mean_gap_mm"},
    {"largest gap to the wall", "mm", "/struts/largest_gap_mm"},
    {"struts with a gap over 0.1 mm", "%", "/struts/malapposed/1/percent_of_struts"},
    {"struts over openings", "%", "/struts/percent_over_openings"},
    {"mean prolapse", "mm", "/struts/mean_prolapse_mm"},
    {"largest prolapse", "mm", "/struts/largest_prolapse_mm"},
    {"deepest penetration", "mm", "/apposition/deepest_penetration_mm"},
    {"contact force", "N", "/simulation/contact_force_N"},
};

struct Arguments {
  std::string case_file, out = "vstent-compare";
  std::vector<std::string> designs;
  RunOptions run;
  ThreadLimit threads;
};

/// One design's run: its metrics, or why there are none.
struct Entry {
  std::string design, folder;
  json metrics;
  std::string refusal;
  ExitCode code = ExitCode::ok;
};

/// Numbers that belong to a stent's struts are derived anew; what belongs to the vessel, the wall
/// and the place stays.
deployment::Case with_design(const deployment::Case& given, const std::string& design) {
  deployment::Case c = given;
  c.design = design == kSmooth ? "" : design;
  c.shape = deployment::Shape::tube;
  c.cell = stents::Cell::open;
  c.straightening.reset();
  c.contact_distance.reset();
  c.contact_stiffness.reset();
  c.patch_edge_length.reset();
  c.voxel_size.reset();
  c.growth_per_step.reset();
  c.tolerance.reset();
  c.save_steps = 0;
  if (fs::path(c.design).extension() != "") c.design = fs::absolute(c.design).string();
  return c;
}

/// "xience_s", or a file's name without its folder and extension; the second of a name gets a
/// number.
std::string folder_name(const std::string& design, std::set<std::string>& taken) {
  const std::string stem = fs::path(design).stem().string();
  std::string name = stem;
  for (int k = 2; !taken.insert(name).second; ++k) name = stem + "_" + std::to_string(k);
  return name;
}

/// A number, or null where the design has no such figure.
json value_of(const Entry& entry, const Row& row) {
  const json::json_pointer pointer(row.pointer);
  return entry.metrics.contains(pointer) ? entry.metrics[pointer] : json(nullptr);
}

std::string cell_text(const Entry& entry, const Row& row) {
  const json value = value_of(entry, row);
  if (value.is_null()) return "-";
  char text[40];
  std::snprintf(text, sizeof text, "%.4g", value.get<double>());
  return text;
}

void print_table(const std::vector<Entry>& entries) {
  std::size_t wide = 10;
  for (const Entry& e : entries) wide = std::max(wide, e.folder.size());
  const auto width = static_cast<int>(wide);
  std::printf("%-32s %-4s", "", "");
  for (const Entry& e : entries) std::printf("  %*s", width, e.folder.c_str());
  std::printf("\n");
  for (const Row& row : kRows) {
    std::printf("%-32s %-4s", row.label, row.unit);
    for (const Entry& e : entries) std::printf("  %*s", width, cell_text(e, row).c_str());
    std::printf("\n");
  }
}

std::string table_csv(const std::vector<Entry>& entries) {
  std::ostringstream csv;
  csv << "measure,unit,key";
  for (const Entry& e : entries) csv << ',' << e.folder;
  csv << '\n';
  for (const Row& row : kRows) {
    csv << row.label << ',' << row.unit << ',' << row.pointer;
    for (const Entry& e : entries) {
      const json value = value_of(e, row);
      csv << ',';
      if (!value.is_null()) csv << value;
    }
    csv << '\n';
  }
  return csv.str();
}

std::string table_json(const std::string& case_file, const std::vector<Entry>& entries) {
  ordered_json designs = ordered_json::array();
  for (const Entry& e : entries) {
    ordered_json row = {{"design", e.design}, {"folder", e.folder}};
    if (!e.refusal.empty()) {
      row["refused"] = e.refusal;
    } else {
      ordered_json values;
      for (const Row& r : kRows) values[r.pointer] = value_of(e, r);
      row["metrics"] = std::move(values);
    }
    designs.push_back(std::move(row));
  }
  return ordered_json{{"case", fs::absolute(case_file).string()}, {"designs", std::move(designs)}}
             .dump(2) +
         "\n";
}

void require_known(const std::vector<std::string>& designs) {
  for (const std::string& design : designs) {
    if (design != kSmooth) deployment::find_design(design);
  }
}

void run(Arguments a) {
  a.threads.apply();
  const deployment::Case given = deployment::read_case(a.case_file);
  require_known(a.designs);
  deployment::ResultFolder folder(a.out);
  std::vector<Entry> entries;
  std::vector<Panel> panels;
  std::optional<deployment::Setup> first;
  std::set<std::string> taken;
  for (const std::string& design : a.designs) {
    Entry entry{design, folder_name(design, taken), {}, {}, ExitCode::ok};
    RunOptions options = a.run;
    options.summary = false;
    options.label = entry.folder + " (" + std::to_string(entries.size() + 1) + " of " +
                    std::to_string(a.designs.size()) + "): ";
    try {
      CaseRun one = run_case(with_design(given, design), folder.stage() / entry.folder, options);
      std::ifstream(folder.stage() / entry.folder / "metrics.json") >> entry.metrics;
      if (!first) panels.push_back({"before", one.setup.surface.mesh, {}});
      TriangleMesh wall = one.setup.surface.mesh;
      wall.points = one.outcome.positions;
      panels.push_back(
          {entry.folder, std::move(wall), stent_surface(one.setup, one.outcome.stent)});
      if (!first) first = std::move(one.setup);
    } catch (const Error& error) {
      if (error.code() == ExitCode::interrupted || error.code() == ExitCode::output) throw;
      entry.refusal = error.what();
      entry.code = error.code();
      std::cerr << "warning: " << entry.folder << ": " << entry.refusal << '\n';
    }
    entries.push_back(std::move(entry));
  }
  std::string refused;
  ExitCode code = ExitCode::ok;
  for (const Entry& e : entries) {
    if (e.refusal.empty()) continue;
    refused += (refused.empty() ? "" : ", ") + e.folder;
    code = e.code;
  }
  if (!first)
    throw Error(code, a.case_file + ": no design could be deployed; " + entries[0].refusal);
  vessels::write_whole(folder.stage() / "compare.json", table_json(a.case_file, entries));
  vessels::write_whole(folder.stage() / "compare.csv", table_csv(entries));
  if (a.run.pictures) draw_panels(*first, panels, folder.stage() / "compare.png");
  folder.publish();
  print_table(entries);
  std::cout << "result " << folder.final_folder().string() << '\n' << kDisclaimer << '\n';
  if (code != ExitCode::ok) throw Error(code, "not deployed: " + refused + " (see the warnings)");
}

}  // namespace

void add_compare(CLI::App& app) {
  auto* command = app.add_subcommand(
      "compare", std::string("Deploy several designs in one vessel, side by side. ") + kDisclaimer);
  auto a = std::make_shared<Arguments>();
  command->add_option("case", a->case_file, "CASE.json: vessel, place, length, diameter, wall")
      ->required();
  command
      ->add_option("--designs", a->designs,
                   "Names from `vstent designs`, design files, or `smooth`, separated by commas")
      ->delimiter(',')
      ->required();
  command->add_option("-o,--out", a->out, "Folder for the results")->capture_default_str();
  command->add_flag("--allow-unconverged", a->run.allow_unconverged,
                    "Keep results whose forces do not balance");
  command->add_flag("!--no-pictures", a->run.pictures, "Draw neither compare.png nor stages.png");
  a->threads.add_option(*command);
  command->footer(
      "Example:\n"
      "  vstent compare coronary.json --designs xience_s,cypher,smooth -o OUT\n"
      "The case's own design, its shape, cell and straightening, and every number that follows\n"
      "from a stent's struts are left aside. OUT holds compare.csv, compare.json, compare.png and\n"
      "a folder of results for each design.");
  command->callback([a] { run(*a); });
}

}  // namespace vstent::apps
