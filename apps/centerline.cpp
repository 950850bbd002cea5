// vstent centerline: the lumen's centerlines with radii.
#include "vessels/centerline.hpp"

#include <iostream>
#include <memory>

#include "apps/commands.hpp"
#include "apps/terminal.hpp"
#include "sdf/polyline.hpp"
#include "vessels/check.hpp"
#include "vessels/text.hpp"

namespace vstent::apps {
namespace {

struct Arguments {
  std::string input, units, out;
  ThreadLimit threads;
};

void run(const Arguments& a) {
  a.threads.apply();
  const vessels::LengthUnit unit = vessels::parse_unit(a.units);
  Progress progress;
  progress.show("extracting centerlines ...");
  const vessels::Surface surface = vessels::read_surface(a.input, unit);
  vessels::require_stentable(surface, vessels::check(surface));
  const vessels::Centerline centerline = vessels::extract_centerline(surface);
  vessels::write_centerline(centerline, unit, a.out);
  progress.clear();
  for (const auto& branch : centerline.branches) {
    const auto [low, high] = std::minmax_element(branch.radii.begin(), branch.radii.end());
    std::cout << "branch " << branch.id << " (from "
              << (branch.parent < 0 ? std::string("the inlet")
                                    : "branch " + std::to_string(branch.parent))
              << "): " << vessels::number(length(branch.points)) << " mm long, inscribed radius "
              << vessels::number(*low) << " .. " << vessels::number(*high) << " mm, ends at "
              << vessels::place(branch.points.back()) << " mm\n";
  }
}

}  // namespace

void add_centerline(CLI::App& app) {
  auto* command =
      app.add_subcommand("centerline", "Extract lumen centerlines with radii and branch ids");
  auto a = std::make_shared<Arguments>();
  command->add_option("surface", a->input, "Lumen surface (.vtp .vtk .stl .obj)")->required();
  command->add_option("--units", a->units, "Length unit of the surface: mm, cm or m")->required();
  command->add_option("-o,--out", a->out, "The centerline file (.vtp), in the same unit")
      ->required();
  a->threads.add_option(*command);
  command->footer("Example:\n  vstent centerline wall.stl --units mm -o cl.vtp");
  command->callback([a] { run(*a); });
}

}  // namespace vstent::apps
