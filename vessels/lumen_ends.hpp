// Where does a lumen end? Openings, caps, and the closed and wall-only meshes that follow from
// them.
#pragma once

#include <memory>
#include <vector>

#include "sdf/mesh_distance.hpp"
#include "vessels/surface.hpp"

namespace vstent::vessels {

/// An opening or a cap that blood flows through. Lengths in mm.
struct LumenEnd {
  Vec3 centre = Vec3::Zero();
  Vec3 outward = Vec3::UnitX();  ///< unit, out of the lumen
  double radius = 0;             ///< of the circle of equal area
  bool open = true;              ///< false: covered by a cap
};

struct LumenEnds {
  std::vector<LumenEnd> ends;  ///< openings first, then caps
  TriangleMesh closed;         ///< the surface, with a fan over every boundary loop
  std::shared_ptr<const sdf::MeshDistance>
      wall;                  ///< the surface without its caps: radii are measured to it
  std::vector<char> is_cap;  ///< per triangle of the surface
};

/// Openings are boundary loops; loops too small for the lumen behind them are holes, closed but no
/// ends. Caps are planar discs with a sharp rim: faces of face_of_triangle, or where it is empty,
/// patches grown over flat edges.
LumenEnds find_lumen_ends(const Surface& surface);

}  // namespace vstent::vessels
