// What a level set costs, before it is built.
#pragma once

#include "sdf/solid.hpp"

namespace vstent::sdf {

/// Bytes at the peak of building the level set of a solid: the leaves within the band of each
/// piece's side and of each loose end, as if none overlapped.
double estimated_bytes(const Solid& solid, double voxel_size, double half_width);

/// The same for a surface of this area (mm^2) with bands of different widths (voxels) inside and
/// outside.
double estimated_bytes(double area, double voxel_size, double outside_width, double inside_width);

}  // namespace vstent::sdf
