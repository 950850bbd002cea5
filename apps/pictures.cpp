#include "apps/pictures.hpp"

#include <iostream>

#include "apps/display.hpp"
#include "apps/drawing.hpp"

namespace vstent::apps {
namespace {

constexpr int kPanels = 3;

TriangleMesh stent_surface(const deployment::Setup& setup, const deployment::StentState& state) {
  return sdf::voxelise(deployment::solid_of(setup, state), {*setup.specification.voxel_size, 3})
      .surface();
}

}  // namespace

void draw_stages(const deployment::Setup& setup, const deployment::Outcome& outcome,
                 std::span<const Vec3> midway, const std::filesystem::path& png) {
  const OffscreenDisplay display;
  if (!display.available()) {
    std::cerr << "warning: no picture: " << display.reason() << '\n';
    return;
  }
  TriangleMesh wall[kPanels] = {setup.surface.mesh, setup.surface.mesh, setup.surface.mesh};
  for (std::size_t i = 0; i < midway.size(); ++i) {
    wall[1].points[static_cast<std::size_t>(setup.region.vertices[i])] = midway[i];
  }
  wall[2].points = outcome.positions;
  const deployment::StentState stent[kPanels] = {deployment::stent_state(setup, 0),
                                                 deployment::stent_state(setup, 0.5),
                                                 deployment::stent_state(setup, 1)};
  const char* const titles[kPanels] = {"before", "midway", "after"};

  std::vector<Vec3> patch;
  for (const int v : setup.region.vertices)
    patch.push_back(setup.surface.mesh.points[static_cast<std::size_t>(v)]);
  const View view = view_across(setup.placement.axis, setup.placement.way.points, patch);
  Panels panels(kPanels);
  for (int k = 0; k < kPanels; ++k) {
    vtkRenderer* renderer = panels.add(titles[k], view);
    renderer->AddActor(actor_for(wall[k], kWallLook));
    renderer->AddActor(actor_for(stent_surface(setup, stent[k]), kStentLook));
  }
  panels.write_png(png);
}

}  // namespace vstent::apps
