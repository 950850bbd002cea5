// vstent render: figures of a result folder for papers, off screen.
#include <algorithm>
#include <iostream>
#include <memory>

#include "apps/commands.hpp"
#include "apps/display.hpp"
#include "apps/drawing.hpp"
#include "apps/profile_figure.hpp"
#include "apps/result_view.hpp"
#include "apps/terminal.hpp"
#include "vessels/error.hpp"
#include "vessels/file_guard.hpp"

namespace vstent::apps {
namespace {

namespace fs = std::filesystem;

struct Arguments {
  std::string folder, figure, out;
  ThreadLimit threads;
};

void draw(vtkRenderer* renderer, const TriangleMesh& mesh, const Look& look) {
  if (!mesh.triangles.empty()) renderer->AddActor(actor_for(mesh, look));
}

/// Before, the saved step nearest to half the way where there are any, after.
void draw_stages(const report::ResultFiles& files, const fs::path& png) {
  const View view = view_of(files);
  const bool has_steps = !files.steps.empty();
  Panels panels(has_steps ? 3 : 2);
  draw(panels.add("before", view), {files.before, files.after.triangles}, kWallLook);
  if (has_steps) {
    const report::SavedStep& step = files.steps[(files.steps.size() - 1) / 2];
    vtkRenderer* renderer = panels.add("step " + std::to_string(step.step), view);
    draw(renderer, vessels::read_surface(step.wall, files.unit).mesh, kWallLook);
    draw(renderer, vessels::read_surface(step.stent, files.unit).mesh, kStentLook);
  }
  vtkRenderer* after = panels.add("after", view);
  draw(after, files.after, kWallLook);
  draw(after, files.stent, kStentLook);
  panels.write_png(png);
}

/// The wall before where it differs from the one after by more than is drawn apart.
TriangleMesh wall_that_moved(const report::ResultFiles& files) {
  constexpr double kApart = 0.02;  // of the largest displacement
  const auto displacement = [&](std::size_t v) {
    return (files.after.points[v] - files.before[v]).norm();
  };
  double largest = 0;
  for (std::size_t v = 0; v < files.before.size(); ++v)
    largest = std::max(largest, displacement(v));
  TriangleMesh moved{files.before, {}};
  for (const Triangle& t : files.after.triangles) {
    if (std::all_of(t.begin(), t.end(), [&](int v) {
          return displacement(static_cast<std::size_t>(v)) > kApart * largest;
        }))
      moved.triangles.push_back(t);
  }
  return moved;
}

/// The walls in one another, and the stent in its vessel.
void draw_comparison(const report::ResultFiles& files, const fs::path& png) {
  const View view = view_of(files);
  Panels panels(2);
  vtkRenderer* both = panels.add("before in after", view);
  draw(both, wall_that_moved(files), {0.25, 0.30, 0.36, 0.6});
  draw(both, files.after, {0.80, 0.36, 0.33, 0.25});
  vtkRenderer* after = panels.add("after", view);
  draw(after, files.after, kWallLook);
  draw(after, files.stent, kStentLook);
  panels.write_png(png);
}

void run(const Arguments& a) {
  a.threads.apply();
  const std::string extension = vessels::extension(a.out);
  const bool profile = a.figure == "profile";
  if (extension != ".png" && !(profile && extension == ".svg")) {
    throw Error(ExitCode::usage, "command line: -o: " + a.out +
                                     (profile ? ": must end in .png or .svg"
                                              : ": must end in .png; only --figure profile is "
                                                "drawn as .svg"));
  }
  if (extension == ".svg") {
    vessels::write_whole(a.out, svg(profile_figure(report::read_metrics(a.folder))));
  } else {
    const OffscreenDisplay display;
    if (!display.available())
      throw Error(ExitCode::output, a.out + ": cannot be drawn: " + display.reason());
    if (profile) {
      write_png(profile_figure(report::read_metrics(a.folder)), a.out);
    } else if (a.figure == "stages") {
      draw_stages(report::read_result(a.folder), a.out);
    } else {
      draw_comparison(report::read_result(a.folder), a.out);
    }
  }
  std::cout << "figure            " << a.out << '\n';
}

}  // namespace

void add_render(CLI::App& app) {
  auto* command = app.add_subcommand("render", "Figures of a result folder, as PNG or SVG");
  auto a = std::make_shared<Arguments>();
  command->add_option("folder", a->folder, "A folder that `vstent deploy` wrote")->required();
  command
      ->add_option("--figure", a->figure,
                   "stages (before, midway, after), compare (both walls in one view), profile "
                   "(diameters along the centerline)")
      ->required()
      ->check(CLI::IsMember({"stages", "compare", "profile"}));
  command->add_option("-o,--out", a->out, "The picture: .png, for the profile also .svg")
      ->required();
  a->threads.add_option(*command);
  command->footer("Example:\n  vstent render OUT --figure profile -o profile.svg");
  command->callback([a] { run(*a); });
}

}  // namespace vstent::apps
