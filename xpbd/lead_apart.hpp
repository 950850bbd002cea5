// How a surface is led somewhere without passing through itself.
#pragma once

#include "xpbd/sheet.hpp"

namespace vstent::xpbd {

/// Leads the sheet from rest towards `target`, as far as it goes without passing through itself:
/// all at the same pace while they can, then each as far as it comes. By vertex.
std::vector<Vec3> lead_apart(const Sheet& sheet, std::span<const Vec3> target);

}  // namespace vstent::xpbd
