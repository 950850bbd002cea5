// A placed stent as the solid that is voxelised.
#pragma once

#include "sdf/solid.hpp"
#include "stents/place.hpp"

namespace vstent::deployment {

/// Every piece of every member between its points: capsules for round wire, rounded rectangles for
/// laser-cut struts, whose flat side faces away from the axis. Pieces of no length are left out.
sdf::Solid strut_solid(const stents::PlacedStent& stent);

}  // namespace vstent::deployment
