// vstent demo: the paper's two idealised vessels (Figure 4), generated and stented.
#include <iostream>
#include <memory>
#include <nlohmann/json.hpp>
#include <numbers>

#include "apps/commands.hpp"
#include "apps/run_case.hpp"
#include "apps/terminal.hpp"
#include "vessels/idealised.hpp"
#include "vessels/surface.hpp"

namespace vstent::apps {
namespace {

namespace fs = std::filesystem;

struct Example {
  std::string name, cell, title;
  vessels::IdealisedVessel vessel;
};

std::vector<Example> examples() {
  vessels::IdealisedVessel straight;
  straight.stenosis = 0.6;
  vessels::IdealisedVessel curved = straight;
  curved.bend_angle = std::numbers::pi / 3;
  return {{"straight", "closed", "closed-cell stent in a straight stenosed vessel", straight},
          {"curved", "open", "open-cell stent in a curved stenosed vessel", curved}};
}

struct Arguments {
  std::string out = "demo";
  RunOptions run;
  ThreadLimit threads;
};

void run(const Arguments& a) {
  a.threads.apply();
  for (const Example& example : examples()) {
    const fs::path folder = fs::path(a.out) / example.name;
    fs::create_directories(folder);
    const fs::path wall = folder / "vessel.vtp";
    const vessels::Surface surface =
        vessels::make_surface(vessels::idealised_vessel(example.vessel), example.name);
    vessels::write_surface(surface, surface.mesh.points,
                           std::vector<char>(surface.mesh.points.size(), 0), wall);
    const nlohmann::json specification = {
        {"vessel", {{"surface", wall.string()}, {"units", "mm"}}},
        {"stent",
         {{"at", "lesion"}, {"length", "24mm"}, {"diameter", "10mm"}, {"cell", example.cell}}}};
    std::cout << "== " << example.title << '\n';
    run_case(deployment::parse_case(specification, "demo", fs::current_path()), folder / "result",
             a.run);
  }
}

}  // namespace

void add_demo(CLI::App& app) {
  auto* command = app.add_subcommand(
      "demo", std::string("Stent two idealised vessels (nothing is downloaded). ") + kDisclaimer);
  auto a = std::make_shared<Arguments>();
  command->add_option("-o,--out", a->out, "Folder for vessels and results")->capture_default_str();
  a->threads.add_option(*command);
  command->footer("Example:\n  vstent demo -o demo");
  command->callback([a] { run(*a); });
}

}  // namespace vstent::apps
