// No mesher fills a surface that crosses itself: where does it?
#pragma once

#include <span>
#include <string>

#include "sdf/geometry.hpp"
#include "vessels/units.hpp"

namespace vstent::meshing {

/// Middles between triangles that cross or overlap, of which at least one is marked (or any).
std::vector<Vec3> crossings(const TriangleMesh& mesh, std::span<const char> marked = {});

/// \throws Error (geometry) with their number and the first places, in mm and in `unit`; its line
/// begins with `what`
void require_no_crossings(const TriangleMesh& mesh, vessels::LengthUnit unit,
                          const std::string& what, std::span<const char> marked = {});

}  // namespace vstent::meshing
