// Pictures of a deployment, drawn off screen.
#pragma once

#include <filesystem>

#include "deployment/deploy.hpp"

namespace vstent::apps {

/// Wall and stent before, midway and after, side by side, seen across the plane in which the stent
/// bends, as a PNG. `midway` holds the patch's vertices at half expansion. Without a display it
/// says so on standard error and draws nothing. \throws Error (output)
void draw_stages(const deployment::Setup& setup, const deployment::Outcome& outcome,
                 std::span<const Vec3> midway, const std::filesystem::path& png);

}  // namespace vstent::apps
