// vstent flow: pressure drop and FFR by a reduced model.
#include <iostream>
#include <memory>

#include "apps/commands.hpp"
#include "apps/flow_run.hpp"
#include "apps/terminal.hpp"
#include "deployment/result_folder.hpp"
#include "flow/report.hpp"
#include "vessels/error.hpp"

namespace vstent::apps {
namespace {

namespace fs = std::filesystem;

struct Arguments {
  std::string input, units, centerline, out;
  ConditionOptions conditions;
  bool list_faces = false, picture = false;
  ThreadLimit threads;
};

[[noreturn]] void refuse(const std::string& what) {
  throw Error(ExitCode::usage, "command line: " + what);
}

FlowInput read_input(const Arguments& a) {
  if (fs::is_directory(a.input)) {
    if (!a.units.empty() || !a.centerline.empty())
      refuse("--units and --centerline go with a surface; " + a.input + " has its own");
    return read_result(a.input);
  }
  if (a.units.empty()) refuse("--units is missing: the length unit of " + a.input + " (mm, cm, m)");
  return read_surface_alone(a.input, vessels::parse_unit(a.units), a.centerline);
}

void print_faces(const FlowInput& input) {
  const vessels::LumenEnds ends = vessels::find_lumen_ends(input.before);
  for (const flow::TreeEnd& end : flow::tree_ends(input.centerline, input.before, ends))
    std::cout << flow::describe(end) << '\n';
}

void run(const Arguments& a) {
  a.threads.apply();
  Progress progress;
  progress.show("reading ...");
  if (!a.list_faces) a.conditions.check();
  const FlowInput input = read_input(a);
  if (a.list_faces) {
    progress.clear();
    print_faces(input);
    return;
  }
  const flow::BoundaryConditions conditions = a.conditions.read(input);
  const fs::path out = !a.out.empty()              ? fs::path(a.out)
                       : fs::is_directory(a.input) ? fs::path(a.input) / "flow"
                                                   : fs::path("vstent-flow");
  deployment::ResultFolder folder(out);
  progress.show("cutting sections and solving ...");
  flow::Study study = flow::study(input.question(), conditions);
  study.notes.insert(study.notes.begin(), input.notes.begin(), input.notes.end());
  write_flow(study, conditions, input.before.unit, folder.stage(), a.picture);
  if (interrupted()) throw Error(ExitCode::interrupted, "stopped on request");
  folder.publish();
  progress.clear();
  std::cout << flow::text_table(study) << "result " << folder.final_folder().string() << '\n'
            << kDisclaimer << '\n';
}

}  // namespace

void add_flow(CLI::App& app) {
  auto* command = app.add_subcommand(
      "flow", std::string("Pressure drop and FFR by a reduced model. ") + kDisclaimer);
  auto a = std::make_shared<Arguments>();
  command->add_option("input", a->input, "A result folder of `vstent deploy`, or a lumen surface")
      ->required();
  a->conditions.add_options(*command, "--case");
  command->add_option("--units,--unit", a->units, "Length unit of a surface: mm, cm or m");
  command->add_option("--centerline", a->centerline, "Of a surface; default: extracted");
  command->add_option("-o,--out", a->out,
                      "Folder for the results; default: flow in the result folder, or vstent-flow");
  command->add_flag("--list-faces", a->list_faces,
                    "Only list the ends of the vessel with the names that faces have by default");
  command->add_flag("--picture", a->picture,
                    "Draw flow.svg as flow.png too, which takes longer than all the rest");
  a->threads.add_option(*command);
  command->footer(
      "Examples:\n"
      "  vstent flow OUT --inflow \"85 mL/s\"\n"
      "  vstent flow OUT --case bc.json -o OUT/rest\n"
      "  vstent flow graft.vtp --units cm --inflow inflow.flow --inflow-units mL/s\n"
      "  vstent flow OUT --list-faces\n"
      "Steady for a constant inflow, otherwise the beat that repeats itself. The result folder "
      "holds flow.json, flow.svg, flow.vtp (the centerline with pressures) and\n"
      "svzerod_before.json, svzerod_after.json for svZeroDSolver. Equations: docs/flow.md.");
  command->callback([a] { run(*a); });
}

}  // namespace vstent::apps
