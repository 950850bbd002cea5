// The walls of a model, and which way layers grow from them.
#pragma once

#include <map>

#include "meshing/model.hpp"
#include "vessels/units.hpp"

namespace vstent::meshing {

/// The walls as a surface of their own, open at the caps.
struct Wall {
  TriangleMesh mesh;
  std::vector<int> face;                     // per triangle
  std::vector<std::vector<int>> neighbours;  // per point, sorted
  std::vector<std::vector<int>> triangles;   // per point
  std::vector<int> cap;                      // per point: the face id of the cap at it, or -1
  std::map<int, Vec3> cap_normal;            // outward, by face id
};

/// \throws Error (geometry) where two caps touch
Wall wall_of(const Model& model, vessels::LengthUnit unit);

/// For each point a unit direction at less than a right angle to the inward normals of all
/// triangles around it, smoothed along the wall; rims go along their caps. \throws Error (geometry)
/// naming the place where the wall folds, so that there is none
std::vector<Vec3> inward_directions(const Wall& wall, vessels::LengthUnit unit);

}  // namespace vstent::meshing
