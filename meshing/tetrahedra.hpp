// Tetrahedra that fill a closed surface: may they be handed to a solver, and how good are they?
#pragma once

#include <array>
#include <string>
#include <vector>

#include "sdf/geometry.hpp"

namespace vstent::meshing {

/// Corners a, b, c, d: a, b, c turn counter-clockwise seen from d, as in VTK.
using Tetrahedron = std::array<int, 4>;

struct TetMesh {
  std::vector<Vec3> points;
  std::vector<Tetrahedron> tetrahedra;
};

/// The outward triangle of a tetrahedron that faces away from its corner 3, 2, 0, 1.
Triangle facet(const Tetrahedron& tetrahedron, int k);

double signed_volume(const TetMesh& mesh, const Tetrahedron& tetrahedron);

/// Whether tetrahedra are a partition of what `surface` encloses, decided with exact signs: all are
/// right way round, every facet is shared by two of them or is one of the surface's triangles, all
/// of those occur, all hang together over facets, no point is unused.
struct Partition {
  std::string fault;  ///< empty, or what is wrong, with counts
  std::vector<int>
      behind;  ///< for each triangle of the surface, the tetrahedron inside; whole when no fault
};

/// `mesh` and `surface` share the numbering of points.
Partition check_partition(const TetMesh& mesh, const std::vector<Triangle>& surface);

/// Angles in degrees, lengths and volume in the unit of the points.
struct TetQuality {
  double smallest_dihedral = 180;  ///< between two facets of one tetrahedron
  double largest_dihedral = 0;
  double dihedral_p1 = 0;      ///< 1 % of the tetrahedra have a smallest dihedral below
  double dihedral_median = 0;  ///< of each tetrahedron's smallest
  std::size_t below_10 = 0;    ///< tetrahedra with a dihedral angle below 10 degrees
  int worst = -1;              ///< the tetrahedron of `smallest_dihedral`
  double smallest_edge = 0, mean_edge = 0, largest_edge = 0;  ///< mean over tetrahedra's edges
  double volume = 0;
};
TetQuality quality(const TetMesh& mesh);

/// The smallest and the largest of the six dihedral angles, deg; 0 and 180 when it is flat.
std::array<double, 2> dihedral_range(const Vec3& a, const Vec3& b, const Vec3& c, const Vec3& d);

}  // namespace vstent::meshing
