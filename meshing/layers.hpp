// Boundary layers: thin elements along the walls, where the velocity changes fastest.
#pragma once

#include "meshing/model.hpp"
#include "meshing/tetrahedra.hpp"
#include "vessels/units.hpp"

namespace vstent::meshing {

/// Each layer is `growth` times as thick as its neighbour nearer the wall.
struct LayerOptions {
  int count = 0;
  double thickness = 0;  ///< mm, of all layers together; 0: the innermost is half the local edge
  double growth = 1.25;
};

/// Layers between a model's walls and `core`, its inside. The walls keep their points and
/// triangles; caps are drawn anew, in their plane, with the layers' rings at their rims.
struct Layers {
  Model model;                  ///< as the finished mesh shows it: walls first, then caps
  TriangleMesh core;            ///< closed and outward oriented: the rest to fill
  std::vector<int> core_point;  ///< for each point of `core`, its number in `mesh`
  TetMesh mesh;                 ///< the layers alone; its first points are those of `model`
  double smallest = 0, median = 0, largest = 0;  ///< mm, thickness of all layers over wall points
  std::size_t thinned = 0;  ///< wall points with less than 90 % of the thickness asked for
  std::vector<std::string> warnings;
};

/// Grows layers inward along smoothed normals, in the caps' planes at the rims; thinner where the
/// lumen is narrow (a quarter of the way to the opposite wall at most) or bends sharply, so that no
/// element is inverted and `core` does not cross itself.
/// \throws Error (geometry) naming the place where no layer fits; (usage) for figures out of range
Layers grow_layers(const Model& model, const LayerOptions& options, vessels::LengthUnit unit);

/// The layers and the tetrahedra that fill `core` (whose first points are those of `core`).
TetMesh joined(const Layers& layers, const TetMesh& filling);

}  // namespace vstent::meshing
