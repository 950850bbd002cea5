// Which end of the lumen is which face of the boundary conditions?
#pragma once

#include "flow/boundary_conditions.hpp"
#include "vessels/centerline.hpp"
#include "vessels/lumen_ends.hpp"

namespace vstent::flow {

/// Where the centerline begins or ends. Lengths in mm.
struct TreeEnd {
  int branch = 0;     ///< that ends there
  bool root = false;  ///< the tree begins there instead
  Vec3 point = Vec3::Zero();
  double radius = 0;           ///< of the opening or cap there, of equal area
  std::optional<int> face_id;  ///< of its cap, where the surface has face ids
  std::string name;            ///< of its face; by default inlet, outlet1, outlet2, ...
};

/// The root first, then the leaves in the order of their branches, with their default names.
std::vector<TreeEnd> tree_ends(const vessels::Centerline& centerline,
                               const vessels::Surface& surface, const vessels::LumenEnds& ends);

/// A centre per face that says where it is: by `near`, its file in the folder of caps, or its
/// face_id. \throws Error for files and ids that do not exist
std::map<std::string, Vec3> face_centres(const BoundaryConditions& conditions,
                                         const vessels::Surface& surface);

/// Gives every end the name of the face that lies there; faces that do not say where they are go by
/// the default names. \throws Error (usage) unless faces and ends are the same, and the inflow is
/// the root's alone
void name_ends(std::vector<TreeEnd>& ends, const BoundaryConditions& conditions,
               const std::map<std::string, Vec3>& centres, const std::string& model);

/// "inlet at (1, 2, 3) mm, diameter 12 mm", for messages and lists.
std::string describe(const TreeEnd& end);

}  // namespace vstent::flow
