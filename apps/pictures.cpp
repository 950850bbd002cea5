#include "apps/pictures.hpp"

#include <iostream>

#include "apps/display.hpp"
#include "apps/drawing.hpp"
#include "deployment/stent_model.hpp"

namespace vstent::apps {

void draw_panels(const deployment::Setup& placed, std::span<const Panel> panels,
                 const std::filesystem::path& png) {
  const OffscreenDisplay display;
  if (!display.available()) {
    std::cerr << "warning: no picture: " << display.reason() << '\n';
    return;
  }
  std::vector<Vec3> patch;
  for (const int v : placed.region.vertices)
    patch.push_back(placed.surface.mesh.points[static_cast<std::size_t>(v)]);
  const View view = view_across(placed.placement.axis, placed.placement.way.points, patch);
  Panels drawn(static_cast<int>(panels.size()));
  for (const Panel& panel : panels) {
    vtkRenderer* renderer = drawn.add(panel.title, view);
    renderer->AddActor(actor_for(panel.wall, kWallLook));
    renderer->AddActor(actor_for(panel.stent, kStentLook));
  }
  drawn.write_png(png);
}

TriangleMesh stent_surface(const deployment::Setup& setup, const deployment::StentShape& stent) {
  return deployment::surface_of(stent, {*setup.specification.voxel_size, 3});
}

void draw_stages(const deployment::Setup& setup, const deployment::Outcome& outcome,
                 const Midway& midway, const std::filesystem::path& png) {
  const auto stent_at = [&](double expansion) {
    return stent_surface(setup,
                         deployment::shape_of(setup, deployment::stent_state(setup, expansion)));
  };
  const TriangleMesh& before = setup.surface.mesh;
  std::vector<Panel> panels{{"before", before, stent_at(0)},
                            {"midway", before, stent_at(midway.expansion)},
                            {"after", before, stent_surface(setup, outcome.stent)}};
  for (std::size_t i = 0; i < midway.patch.size(); ++i)
    panels[1].wall.points[static_cast<std::size_t>(setup.region.vertices[i])] = midway.patch[i];
  panels[2].wall.points = outcome.positions;
  draw_panels(setup, panels, png);
}

}  // namespace vstent::apps
