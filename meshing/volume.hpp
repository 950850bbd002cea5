// Tetrahedra from a closed surface, by a mesher of others that runs beside us and is not trusted.
#pragma once

#include <filesystem>
#include <functional>
#include <string>

#include "meshing/tetrahedra.hpp"

namespace vstent::meshing {

enum class Mesher { gmsh, tetgen };
std::string name(Mesher mesher);

struct VolumeOptions {
  Mesher mesher = Mesher::gmsh;
  std::string program;  ///< the executable; empty: VSTENT_GMSH or VSTENT_TETGEN, or from PATH
  /// mm; mean edge to aim at inside, not below 3/4 of that of the surface; 0: that of the surface,
  /// by area. Near the surface elements are as large as its triangles.
  double edge = 0;
  double time_limit = 1800;      ///< s
  std::filesystem::path folder;  ///< to work in, an existing one; emptied of what is put there
  std::function<bool(double seconds)>
      keep_going;  ///< called while the mesher works; false stops it
};

/// The executable that fill would run. \throws Error (usage) when it is not installed
std::filesystem::path mesher_program(const VolumeOptions& options);

struct Volume {
  TetMesh mesh;             ///< its first points are the surface's, bit for bit and in order
  std::vector<int> behind;  ///< the tetrahedron inside each triangle of the surface
  std::string mesher;       ///< the program's path
  double seconds = 0;       ///< of the mesher alone
  double peak_megabytes = 0;
};

/// Fills a closed, outward oriented surface (mm); every triangle of it becomes a facet. The result
/// is a partition of what the surface encloses (check_partition), whatever the mesher's exit code.
/// \throws Error (usage) when the mesher is not installed; (geometry) when the surface is not
/// closed; (resources) when the mesher takes too long or is killed; (numerical) when its mesh is no
/// such partition; (interrupted)
Volume fill(const TriangleMesh& surface, const VolumeOptions& options);

}  // namespace vstent::meshing
