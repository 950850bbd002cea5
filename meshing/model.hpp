// A vessel as flow solvers know it: a closed surface whose every triangle belongs to a named face.
#pragma once

#include <string>
#include <vector>

#include "sdf/geometry.hpp"

namespace vstent::meshing {

/// A wall, or a cap that blood flows through. Ids are SimVascular's ModelFaceID.
struct Face {
  int id = 0;
  std::string name;  ///< as boundary conditions call it
  bool cap = false;
};

/// Closed and outward oriented once its openings are capped; lengths in mm.
struct Model {
  TriangleMesh mesh;
  std::vector<int> face_of_triangle;  ///< a Face::id for each triangle
  std::vector<Face> faces;
};

/// The face of this id. \throws Error (geometry) when the model has none
const Face& face(const Model& model, int id);

/// The triangles of one face, still numbered by the whole model's points.
std::vector<Triangle> triangles_of(const Model& model, int id);

}  // namespace vstent::meshing
