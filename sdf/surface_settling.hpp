// Moves a mesh of a level set's zero level onto it. Inside this folder only.
#pragma once

#include "sdf/leaf_field.hpp"

namespace vstent::sdf {

/// OpenVDB's points are means of the crossings around them and lie inside of convex surfaces, and
/// its facets farther inside. Puts the points onto the zero level, then as far outwards as their
/// facets lie inwards on the mean, so that the volume is kept.
void settle(TriangleMesh& mesh, const LeafField& field);

}  // namespace vstent::sdf
