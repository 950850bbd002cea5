// Does a surface pass through itself, and how is it led somewhere without doing so?
#pragma once

#include "xpbd/sheet.hpp"

namespace vstent::xpbd {

/// Edges through triangles that are not beside them on the surface (as SelfCollision has it).
std::size_t crossings(const SurfaceOfWall& surface, std::span<const Vec3> rest,
                      std::span<const Vec3> places);

/// Leads the sheet from rest towards `target`, as far as it goes without passing through itself:
/// all at the same pace while they can, then each as far as it comes. By vertex.
std::vector<Vec3> lead_apart(const Sheet& sheet, std::span<const Vec3> target);

}  // namespace vstent::xpbd
