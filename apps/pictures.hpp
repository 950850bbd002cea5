// Pictures of a deployment, drawn off screen.
#pragma once

#include <filesystem>

#include "deployment/deploy.hpp"

namespace vstent::apps {

/// Looking along `direction` with `up` upwards at `centre`; `height` (mm) fits into a panel.
struct View {
  Vec3 centre, direction, up;
  double height = 0;
};

/// Across the plane in which the way of the stent bends most, with the stent's axis upright.
View view_of(const deployment::Setup& setup);

struct Panel {
  std::string title;
  TriangleMesh wall, stent;  ///< stent: may be empty
};

/// Panels side by side, four to a row, as a PNG. Without a display it says so on standard error and
/// draws nothing. \throws Error (output)
void draw_panels(const View& view, std::span<const Panel> panels, const std::filesystem::path& png);

TriangleMesh stent_surface(const deployment::Setup& setup, const deployment::Outcome& outcome);

/// Wall and stent before, midway and after, side by side, seen across the plane in which the stent
/// bends, as a PNG. `midway` holds the patch's vertices at half expansion. Without a display it
/// says so on standard error and draws nothing. \throws Error (output)
void draw_stages(const deployment::Setup& setup, const deployment::Outcome& outcome,
                 std::span<const Vec3> midway, const std::filesystem::path& png);

}  // namespace vstent::apps
