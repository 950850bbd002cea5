// Where the stent will be: its place on the centerline, its own axis, and whether it makes sense
// there.
#pragma once

#include "deployment/setup.hpp"

namespace vstent::deployment {

/// Fills in the setup's placement and the stent's final dimensions, from its surface, centerline
/// and design; of the case, the place and `diameter: auto`. \throws Error: geometry (over the
/// vessel's end, nothing to open, a bend tighter than the stent is wide) or usage (no such branch)
void place_stent(Setup& setup);

/// A stent that this surface has no room for. \throws Error: geometry
[[noreturn]] void infeasible(const Case& specification, const std::string& what);

}  // namespace vstent::deployment
