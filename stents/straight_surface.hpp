// A straight stent given as a surface: where its axis is, and how large it is.
#pragma once

#include <optional>
#include <vector>

#include "sdf/geometry.hpp"

namespace vstent::stents {

/// Lengths in mm.
struct StraightSurface {
  TriangleMesh mesh;        ///< about the z axis, its proximal end at z = 0
  double outer_radius = 0;  ///< of the point farthest from the axis
  double inner_radius = 0;  ///< of the one nearest to it
  double length = 0;
  double area = 0, volume = 0;  ///< mm^2, mm^3
  /// Of the outer surface, in slices of equal height from the proximal end on; between them where
  /// there is no metal. Below `outer_radius` in a waist, or beside a flare.
  std::vector<double> outer_radii;
};

/// Radius (mm) of the outer surface at z: from the middle of a slice to that of the next.
double outer_radius_at(const StraightSurface& surface, double z);

/// The surface moved rigidly onto the z axis. Its axis is the one principal axis whose second
/// moment of area differs from the two others, which are equal for a tube of any length; from there
/// the line is found that all of the outer surface is equally far from, by least squares.
/// The stent begins at its lower end along the largest component of the axis; x stays x as far as
/// it can.
/// \param axis from proximal to distal, where it is known; only its position is then searched for
/// \throws std::invalid_argument a surface that is no hollow, straight tube: what it is, in numbers
StraightSurface on_its_axis(const TriangleMesh& surface,
                            const std::optional<Vec3>& axis = std::nullopt);

/// The same with its ends exchanged: half a turn about x.
StraightSurface turned_around(StraightSurface surface);

}  // namespace vstent::stents
