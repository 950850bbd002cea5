// vstent deploy: a stent into a vessel, from a case file or from the command line.
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>

#include "apps/commands.hpp"
#include "apps/run_case.hpp"
#include "apps/terminal.hpp"
#include "vessels/error.hpp"
#include "vessels/json_object.hpp"

namespace vstent::apps {
namespace {

using nlohmann::json;

struct Arguments {
  std::string input, out = "vstent-out";
  std::string units, at, length, diameter, design, cell, centerline, shape, wall;
  double straightening = -1;
  bool gives_way = false;
  std::optional<double> bending_stiffness, radial_stiffness;
  int save_steps = -1;
  RunOptions run;
  ThreadLimit threads;
};

std::string fail_text(const std::string& option, const std::string& what) {
  return "command line: " + option + ": " + what;
}

/// "x,y,z", "lesion", or "branch:arc length" such as 2:12mm.
json location(const std::string& at) {
  if (at == "lesion") return at;
  if (const std::size_t colon = at.find(':'); colon != std::string::npos) {
    try {
      std::size_t used = 0;
      const int branch = std::stoi(at.substr(0, colon), &used);
      if (used == colon) return {{"branch", branch}, {"arc_length", at.substr(colon + 1)}};
    } catch (const std::logic_error&) {
    }
  }
  json point = json::array();
  std::size_t begin = 0;
  while (begin <= at.size()) {
    const std::size_t comma = std::min(at.find(',', begin), at.size());
    const std::string piece = at.substr(begin, comma - begin);
    try {
      std::size_t used = 0;
      point.push_back(std::stod(piece, &used));
      if (used != piece.size()) point.clear();
    } catch (const std::logic_error&) {
      point.clear();
    }
    if (point.empty()) break;
    begin = comma + 1;
  }
  if (point.size() != 3) {
    throw Error(ExitCode::usage,
                fail_text("--at",
                          "must be x,y,z in the surface's unit, `lesion`, or branch:arc length "
                          "such as 2:12mm, is \"" +
                              at + "\""));
  }
  return point;
}

deployment::Case case_from_options(const Arguments& a) {
  const auto require = [](const std::string& value, const char* option, const char* what) {
    if (value.empty())
      throw Error(ExitCode::usage, fail_text(option, std::string("is missing: ") + what));
  };
  require(a.units, "--units", "the surface's length unit, mm, cm or m");
  if (a.design.empty()) require(a.length, "--length", "the stent's length, such as 30mm");
  require(a.diameter, "--diameter", "the lumen diameter to reach, such as 11mm, or auto");
  json specification;
  specification["vessel"] = {{"surface", a.input}, {"units", a.units}};
  if (!a.centerline.empty()) specification["vessel"]["centerline"] = a.centerline;
  specification["stent"] = {{"at", location(a.at.empty() ? "lesion" : a.at)},
                            {"diameter", a.diameter}};
  if (!a.design.empty()) specification["stent"]["design"] = a.design;
  if (!a.length.empty()) specification["stent"]["length"] = a.length;
  if (!a.cell.empty()) specification["stent"]["cell"] = a.cell;
  if (!a.shape.empty()) specification["stent"]["shape"] = a.shape;
  if (a.straightening >= 0) specification["stent"]["straightening"] = a.straightening;
  if (a.gives_way) specification["stent"]["gives_way"] = true;
  if (a.bending_stiffness) specification["stent"]["bending_stiffness_N_mm2"] = *a.bending_stiffness;
  if (a.radial_stiffness)
    specification["stent"]["radial_stiffness_N_per_mm2"] = *a.radial_stiffness;
  if (!a.wall.empty()) specification["wall"]["preset"] = a.wall;
  return deployment::parse_case(specification, vessels::kCommandLine,
                                std::filesystem::current_path());
}

void run(const Arguments& a) {
  a.threads.apply();
  const bool case_file = std::filesystem::path(a.input).extension() == ".json";
  if (case_file && (!(a.units + a.at + a.length + a.diameter + a.design + a.cell + a.centerline +
                      a.shape + a.wall)
                         .empty() ||
                    a.gives_way || a.bending_stiffness || a.radial_stiffness)) {
    throw Error(
        ExitCode::usage,
        fail_text(a.input, "a case file says everything itself; leave the stent's options out"));
  }
  deployment::Case specification =
      case_file ? deployment::read_case(a.input) : case_from_options(a);
  if (a.save_steps >= 0) specification.save_steps = a.save_steps;
  run_case(specification, a.out, a.run);
}

}  // namespace

void add_deploy(CLI::App& app) {
  auto* command = app.add_subcommand(
      "deploy", std::string("Deploy a stent in a lumen surface. ") + kDisclaimer);
  auto a = std::make_shared<Arguments>();
  command->add_option("input", a->input, "CASE.json, or the lumen surface (.vtp .vtk .stl .obj)")
      ->required();
  command->add_option("-o,--out", a->out, "Folder for the results")->capture_default_str();
  command->add_option("--units", a->units, "Length unit of the surface: mm, cm or m");
  command->add_option(
      "--at", a->at,
      "x,y,z in the surface's unit | lesion | branch:arc-length (2:12mm); default lesion");
  command->add_option(
      "--design", a->design,
      "A stent of struts: a name from `vstent designs`, a design file (.json), or the "
      "surface of a straight stent (.stl .vtp .vtk .obj, mm); default: a smooth "
      "tube");
  command->add_option(
      "--length", a->length,
      "Stent length with unit (30mm); with --design, at nominal diameter, rounded to "
      "whole rings");
  command->add_option("--diameter", a->diameter,
                      "Lumen diameter to reach with unit (11mm), or auto");
  command->add_option("--cell", a->cell,
                      "open (follows the vessel, default) or closed (straightens it)");
  command->add_option("--straightening", a->straightening,
                      "Closed cells: 0 follows .. 1 straight (default)");
  command->add_flag("--gives-way", a->gives_way,
                    "The wall may shift the stent's axis, bend it and narrow it");
  command->add_option("--bending-stiffness", a->bending_stiffness,
                      "With --gives-way, N mm2; default: the design's, or no bending");
  command->add_option("--radial-stiffness", a->radial_stiffness,
                      "With --gives-way, N per mm of length and mm of diameter; default: the "
                      "design's, or the diameter as prescribed");
  command->add_option("--centerline", a->centerline,
                      "Centerline file (VMTK, SimVascular, polyline); default: extracted");
  command->add_option("--shape", a->shape,
                      "tube (default), capsule (round ends), paper (union of cylinders)");
  command->add_option(
      "--wall", a->wall,
      "elastic (default); aorta, pulmonary, coronary, carotid, iliofemoral; or paper "
      "(its constants per edge and hinge)");
  command
      ->add_option("--save-steps", a->save_steps, "Save every N-th step for ParaView (steps.pvd)")
      ->check(CLI::NonNegativeNumber);
  command->add_flag("--allow-unconverged", a->run.allow_unconverged,
                    "Keep a result whose forces do not balance");
  command->add_flag("!--no-pictures", a->run.pictures, "Do not draw stages.png");
  command->add_flag("!--no-report", a->run.report, "Do not write report.html");
  a->threads.add_option(*command);
  command->footer(
      "Examples:\n"
      "  vstent deploy wall.stl --units mm --at 0.36,0.16,-3.78 --length 30mm --diameter 11mm -o "
      "OUT\n"
      "  vstent deploy graft.vtp --units cm --at lesion --length 3cm --diameter auto --cell closed "
      "-o OUT\n"
      "  vstent deploy coronary.stl --units mm --at lesion --design element --diameter 3mm -o OUT\n"
      "  vstent deploy OUT/case.json -o AGAIN        the same bytes again\n"
      "OUT holds stented.vtp, stent.vtp, stent.vdb, struts.vtp (with --design), centerline.vtp, "
      "case.json, metrics.json, profiles.csv, sections.vtp, history.csv, stages.png, report.html.");
  command->callback([a] { run(*a); });
}

}  // namespace vstent::apps
