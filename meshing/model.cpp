#include "meshing/model.hpp"

#include <algorithm>

#include "vessels/error.hpp"

namespace vstent::meshing {

const Face& face(const Model& model, int id) {
  const auto found = std::find_if(model.faces.begin(), model.faces.end(),
                                  [&](const Face& one) { return one.id == id; });
  if (found == model.faces.end())
    throw Error(ExitCode::geometry, "the model has no face " + std::to_string(id));
  return *found;
}

std::vector<Triangle> triangles_of(const Model& model, int id) {
  std::vector<Triangle> triangles;
  for (std::size_t t = 0; t < model.mesh.triangles.size(); ++t)
    if (model.face_of_triangle[t] == id) triangles.push_back(model.mesh.triangles[t]);
  return triangles;
}

}  // namespace vstent::meshing
