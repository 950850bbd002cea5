// Triangles of one length: an existing patch of them made nearly equilateral.
#pragma once

#include "meshing/edit_mesh.hpp"
#include "meshing/reference.hpp"

namespace vstent::meshing {

struct IsotropicOptions {
  int iterations = 6;
  /// Edges between faces may be cut and joined along their curve; otherwise they stay as they are.
  bool resample_curves = false;
};

/// Splits edges longer than 4/3 of the length wanted at their ends, collapses those shorter than
/// 4/5 of it, flips edges towards six triangles around each vertex, and moves vertices to the
/// middle of their neighbours, within the reference's face (Botsch and Kobbelt 2004); finally flips
/// and moves what enlarges the smallest angles. The border stays as it is. The link condition holds
/// throughout, and no triangle is turned over.
void make_isotropic(EditMesh& mesh, const Reference& reference, const IsotropicOptions& options);

}  // namespace vstent::meshing
