// Which face of a model does a boundary condition speak of?
#pragma once

#include "flow/boundary_conditions.hpp"
#include "meshing/faces.hpp"

namespace vstent::meshing {

/// Names that conditions give to ModelFaceIDs, and the files that say where faces are; what `names`
/// has already stays.
void add_names(FaceNames& names, const flow::BoundaryConditions& conditions);

/// Conditions with a point (in `unit`) name the cap that is nearest to it. \throws Error (usage)
/// where two lie nearest to the same
void name_by_place(Model& model, const flow::BoundaryConditions& conditions,
                   vessels::LengthUnit unit);

}  // namespace vstent::meshing
