// Which part of a surface did a deployment change?
#pragma once

#include "meshing/model.hpp"
#include "vessels/surface.hpp"

namespace vstent::meshing {

/// Marks for `model`'s triangles, which begin with those of `stented` (see model_of): those with a
/// point that moved, by the Displacement that `vstent deploy` writes, or that is within `margin`
/// (mm, along edges) of one. \throws Error (input_file) without that array; (geometry) when nothing
/// moved
std::vector<char> edited_region(const vessels::Surface& stented, const Model& model, double margin);

}  // namespace vstent::meshing
