// Open ends of a wall, and the caps that close them with triangles like those at the rim.
#pragma once

#include "sdf/geometry.hpp"
#include "vessels/units.hpp"

namespace vstent::meshing {

/// A boundary loop of a wall. Lengths in mm.
struct Opening {
  std::vector<int> rim;          ///< points in the wall's own sense of rotation
  Vec3 centre = Vec3::Zero();    ///< of the rim, weighted by length
  Vec3 outward = Vec3::UnitX();  ///< unit normal of its mean plane, out of the vessel
  double radius = 0;             ///< of the circle of equal area
  double edge = 0;               ///< mean length of the rim's edges
  double unevenness = 0;         ///< largest distance of a rim point from the mean plane
};

/// Every boundary loop, the widest first.
std::vector<Opening> find_openings(const TriangleMesh& mesh);

/// Appends a cap over the opening: triangles as long as the rim's own edges, the rim's points
/// shared and unchanged. In the plane of an even rim; an uneven one is spanned smoothly. \throws
/// Error (geometry) naming places where the rim crosses itself, seen along its normal
void close(TriangleMesh& mesh, const Opening& opening, vessels::LengthUnit unit);

/// Moves the rim's points into their mean plane, along its normal.
void flatten(TriangleMesh& mesh, Opening& opening);

}  // namespace vstent::meshing
