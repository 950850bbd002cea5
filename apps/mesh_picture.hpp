// A picture of tetrahedra: what lies behind a cut through the middle.
#pragma once

#include <filesystem>

#include "meshing/model.hpp"
#include "meshing/tetrahedra.hpp"

namespace vstent::apps {

/// The whole mesh cut open along the plane in which it spreads widest, and a sixth of it enlarged,
/// as a PNG. Without a display it says so on standard error and draws nothing. \throws Error
/// (output)
void draw_mesh(const meshing::Model& model, const meshing::TetMesh& mesh,
               const std::filesystem::path& png);

}  // namespace vstent::apps
