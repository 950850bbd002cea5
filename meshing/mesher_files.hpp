// What Gmsh and TetGen read and write.
#pragma once

#include <filesystem>

#include "meshing/tetrahedra.hpp"

namespace vstent::meshing {

/// The surface as one discrete entity of a Gmsh mesh (MSH 2.2), numbers that read back bit for bit.
std::string msh_text(const TriangleMesh& surface);

/// The tetrahedra of a binary MSH 2.2 file. Points are renumbered: first those of `surface`, which
/// must all be in the file bit for bit, then the others in the file's order.
/// \throws Error (numerical) naming the file and what is wrong with it
TetMesh read_msh(const std::filesystem::path& path, const TriangleMesh& surface);

/// The surface as a piecewise linear complex for TetGen.
std::string smesh_text(const TriangleMesh& surface);

/// The tetrahedra of <stem>.node and <stem>.ele, whose first points are those of `surface`.
/// \throws Error (numerical) naming the file and what is wrong with it
TetMesh read_tetgen(const std::filesystem::path& stem, const TriangleMesh& surface);

}  // namespace vstent::meshing
