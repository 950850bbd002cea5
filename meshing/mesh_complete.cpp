#include "meshing/mesh_complete.hpp"

#include <algorithm>
#include <limits>
#include <numeric>
#include <set>

#include "vessels/error.hpp"
#include "vessels/mesh_write.hpp"
#include "vessels/predicates.hpp"
#include "vessels/text.hpp"
#include "vessels/units.hpp"

namespace vstent::meshing {
namespace fs = std::filesystem;
namespace {

/// Millimetres to centimetres by division: what was read from a file in centimetres comes back.
std::vector<Vec3> in_centimetres(const std::vector<Vec3>& points) {
  std::vector<Vec3> result;
  result.reserve(points.size());
  for (const Vec3& x : points)
    result.push_back(x / vessels::millimetres_per(vessels::LengthUnit::cm));
  return result;
}

void require_positive(const TetMesh& mesh) {
  const auto at = [&](int i) -> const Vec3& { return mesh.points[static_cast<std::size_t>(i)]; };
  const auto spoilt =
      std::count_if(mesh.tetrahedra.begin(), mesh.tetrahedra.end(), [&](const Tetrahedron& t) {
        return vessels::orient3d(at(t[0]), at(t[1]), at(t[2]), at(t[3])) <= 0;
      });
  if (spoilt > 0)
    throw Error(ExitCode::numerical,
                std::to_string(spoilt) +
                    " of the tetrahedra are so thin that rounding to centimetres inverts them");
}

/// The triangles marked by `chosen` as a mesh of their own, with their ids.
void write_part(const Model& model, const std::vector<Vec3>& points, const std::vector<int>& behind,
                const std::vector<char>& chosen, const fs::path& path) {
  std::vector<int> number(model.mesh.points.size(), -1);
  for (std::size_t t = 0; t < chosen.size(); ++t) {
    if (chosen[t] == 0) continue;
    for (const int v : model.mesh.triangles[t]) number[static_cast<std::size_t>(v)] = 0;
  }
  TriangleMesh part;
  std::vector<int> nodes, elements, faces;
  for (std::size_t v = 0; v < number.size(); ++v) {
    if (number[v] < 0) continue;
    number[v] = static_cast<int>(part.points.size());
    part.points.push_back(points[v]);
    nodes.push_back(static_cast<int>(v) + 1);
  }
  for (std::size_t t = 0; t < chosen.size(); ++t) {
    if (chosen[t] == 0) continue;
    Triangle corners = model.mesh.triangles[t];
    for (int& v : corners) v = number[static_cast<std::size_t>(v)];
    part.triangles.push_back(corners);
    elements.push_back(behind[t] + 1);
    faces.push_back(model.face_of_triangle[t]);
  }
  vessels::write_triangles(part, {{"GlobalNodeID", nodes}},
                           {{"GlobalElementID", elements}, {"ModelFaceID", faces}}, path);
}

bool readable_name(const std::string& name) {
  return !name.empty() && name.front() != '.' && std::all_of(name.begin(), name.end(), [](char c) {
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '_' ||
           c == '-' || c == '+' || c == '.';
  });
}

void make_folder(const fs::path& folder) {
  std::error_code failed;
  fs::create_directory(folder, failed);
  if (failed)
    throw Error(ExitCode::output, folder.string() + ": cannot be made: " + failed.message());
}

}  // namespace

void require_writable_faces(const Model& model) {
  std::set<std::string> names;
  std::set<int> ids;
  for (const Face& face : model.faces) {
    if (!readable_name(face.name))
      throw Error(ExitCode::geometry, "face " + std::to_string(face.id) + " is called \"" +
                                          face.name +
                                          "\"; solvers want letters, digits, _ - + . in names");
    if (!names.insert(face.name).second)
      throw Error(ExitCode::geometry, "two faces are called " + face.name);
    if (face.id < 1)
      throw Error(ExitCode::geometry, "face " + face.name + " has the id " +
                                          std::to_string(face.id) + "; ids count from 1");
    if (!ids.insert(face.id).second)
      throw Error(ExitCode::geometry, "two faces have the id " + std::to_string(face.id));
    if (std::find(model.face_of_triangle.begin(), model.face_of_triangle.end(), face.id) ==
        model.face_of_triangle.end())
      throw Error(ExitCode::geometry, "face " + face.name +
                                          " has no triangles: no part of the surface belongs to "
                                          "it; leave its file or name out of the faces given");
  }
  for (const int id : model.face_of_triangle) {
    if (!ids.contains(id))
      throw Error(ExitCode::geometry,
                  "triangles have the face id " + std::to_string(id) + ", which no face has");
  }
}

void write_mesh_complete(const Model& model, const TetMesh& mesh, const std::vector<int>& behind,
                         const fs::path& folder) {
  require_writable_faces(model);
  if (mesh.points.size() > static_cast<std::size_t>(std::numeric_limits<int>::max()) ||
      mesh.tetrahedra.size() > static_cast<std::size_t>(std::numeric_limits<int>::max()))
    throw Error(ExitCode::resources,
                "the mesh has more nodes or elements than Int32 ids can count");
  const TetMesh centimetres{in_centimetres(mesh.points), mesh.tetrahedra};
  require_positive(centimetres);

  make_folder(folder);
  make_folder(folder / "mesh-surfaces");
  std::vector<int> nodes(mesh.points.size()), elements(mesh.tetrahedra.size());
  std::iota(nodes.begin(), nodes.end(), 1);
  std::iota(elements.begin(), elements.end(), 1);
  const std::vector<int> region(mesh.tetrahedra.size(), 1);
  vessels::write_tetrahedra(centimetres.points, centimetres.tetrahedra, {{"GlobalNodeID", nodes}},
                            {{"GlobalElementID", elements}, {"ModelRegionID", region}},
                            folder / "mesh-complete.mesh.vtu");
  const auto write = [&](auto&& belongs, const fs::path& path) {
    std::vector<char> chosen;
    for (const int id : model.face_of_triangle) chosen.push_back(belongs(id) ? 1 : 0);
    write_part(model, centimetres.points, behind, chosen, path);
  };
  write([](int) { return true; }, folder / "mesh-complete.exterior.vtp");
  write([&](int id) { return !face(model, id).cap; }, folder / "walls_combined.vtp");
  for (const Face& one : model.faces)
    write([&](int id) { return id == one.id; }, folder / "mesh-surfaces" / (one.name + ".vtp"));
}

}  // namespace vstent::meshing
