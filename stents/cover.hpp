// The sleeves of a stent graft.
#pragma once

#include <span>

#include "sdf/geometry.hpp"
#include "stents/specification.hpp"

namespace vstent::stents {

bool covered(const Cover& cover);

/// The sleeves as closed shells, outward oriented, from the axis's first point to its last: the
/// outer one lies on the struts' outer face (`outer_radii`, mm, one per axis point), the inner one
/// on their inner face, `strut_thickness` (mm) below. Facets of 64 to the turn. Empty without a
/// cover.
/// \throws std::invalid_argument an inner sleeve that is thicker than the lumen is wide
TriangleMesh cover_surface(const Cover& cover, const Polyline& axis,
                           std::span<const double> outer_radii, double strut_thickness);

}  // namespace vstent::stents
