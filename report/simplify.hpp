// Fewer triangles for a drawing, within a distance that is told.
#pragma once

#include "sdf/geometry.hpp"

namespace vstent::report {

struct Simplified {
  TriangleMesh mesh;
  std::size_t triangles_before = 0;
  double error = 0;  ///< mm, estimated from the planes of the removed triangles
};

/// Collapses edges onto vertices of the mesh while its surface moves by at most about `error` (mm).
Simplified simplify(const TriangleMesh& mesh, double error);

}  // namespace vstent::report
