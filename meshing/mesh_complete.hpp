// A mesh as SimVascular hands it to its solvers: the folder mesh-complete.
#pragma once

#include <filesystem>

#include "meshing/model.hpp"
#include "meshing/tetrahedra.hpp"

namespace vstent::meshing {

/// Writes `folder`/mesh-complete.mesh.vtu (the tetrahedra: GlobalNodeID, GlobalElementID,
/// ModelRegionID), mesh-complete.exterior.vtp (the whole surface), walls_combined.vtp (all faces
/// that are no caps) and mesh-surfaces/<face>.vtp (GlobalNodeID, GlobalElementID of the tetrahedron
/// behind, ModelFaceID). Ids are Int32 and count from 1; coordinates are centimetres, the same bits
/// in every file; triangles are counter-clockwise seen from outside.
/// `mesh` shares the numbering of the model's points and is a partition of what the model encloses;
/// `behind` is the tetrahedron inside each of its triangles. The folder is made, its parent exists.
/// \throws Error (geometry) for face names that solvers cannot read or that repeat, for faces
/// without triangles; (numerical) when a tetrahedron does not survive the change of unit; (output)
void write_mesh_complete(const Model& model, const TetMesh& mesh, const std::vector<int>& behind,
                         const std::filesystem::path& folder);

/// Throws as write_mesh_complete does, before anything expensive is done.
void require_writable_faces(const Model& model);

}  // namespace vstent::meshing
