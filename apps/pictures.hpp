// Pictures of deployments, drawn off screen.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "deployment/deploy.hpp"

namespace vstent::apps {

struct Panel {
  std::string title;
  TriangleMesh wall, stent;  ///< stent: may be empty
};

/// Panels side by side, seen across the plane in which the way of the placed stent bends, as a PNG.
/// Without a display it says so on standard error and draws nothing. \throws Error (output)
void draw_panels(const deployment::Setup& placed, std::span<const Panel> panels,
                 const std::filesystem::path& png);

TriangleMesh stent_surface(const deployment::Setup& setup, const deployment::StentShape& stent);

/// A step about half way.
struct Midway {
  double expansion = 0.5;   ///< 0 start radius .. 1 nominal
  std::vector<Vec3> patch;  ///< its vertices then
};

/// Wall and stent before, midway and after.
void draw_stages(const deployment::Setup& setup, const deployment::Outcome& outcome,
                 const Midway& midway, const std::filesystem::path& png);

}  // namespace vstent::apps
