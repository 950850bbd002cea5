#include "meshing/face_files.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>

#include "meshing/faces.hpp"
#include "sdf/mesh_distance.hpp"
#include "vessels/error.hpp"
#include "vessels/file_guard.hpp"
#include "vessels/surface_part.hpp"
#include "vessels/text.hpp"

namespace vstent::meshing {
namespace fs = std::filesystem;
namespace {

constexpr double kMajority = 0.8;  // of a file's area that must lie on its face
constexpr double kNear = 0.25;     // radii of the circle of equal area; files lie no farther off
constexpr double kLikeArea = 2.0;  // a cap and its file differ by less than this factor

double area_of(const TriangleMesh& mesh, const Triangle& t, Vec3* centroid = nullptr) {
  const Vec3& a = mesh.points[static_cast<std::size_t>(t[0])];
  const Vec3& b = mesh.points[static_cast<std::size_t>(t[1])];
  const Vec3& c = mesh.points[static_cast<std::size_t>(t[2])];
  if (centroid != nullptr) *centroid = (a + b + c) / 3;
  return 0.5 * (b - a).cross(c - a).norm();
}

struct Match {
  int face = 0;
  fs::path file;
  TriangleMesh mesh;
};

Match match(const Model& model, const sdf::MeshDistance& distance, const fs::path& file,
            vessels::LengthUnit unit) {
  vessels::Surface part = vessels::read_surface_part(file, unit);
  std::map<int, double> votes;
  double area = 0, offset = 0;
  Vec3 moment = Vec3::Zero();
  for (const Triangle& t : part.mesh.triangles) {
    Vec3 centroid;
    const double weight = area_of(part.mesh, t, &centroid);
    const auto closest = distance.closest(centroid);
    votes[model.face_of_triangle[static_cast<std::size_t>(closest.triangle)]] += weight;
    area += weight;
    offset += weight * closest.distance;
    moment += weight * centroid;
  }
  const auto best = std::max_element(
      votes.begin(), votes.end(), [](const auto& a, const auto& b) { return a.second < b.second; });
  const auto refuse = [&](const std::string& why) {
    return Error(ExitCode::geometry, file.string() + ": " + why);
  };
  if (!(area > 0)) throw refuse("its triangles have no area");
  const double radius = std::sqrt(area / std::numbers::pi);
  if (offset > kNear * radius * area) {
    throw refuse("it lies " + vessels::number(offset / area) +
                 " mm away from the model, on average; its centre is at " +
                 vessels::place(moment / area, unit) + ": does it belong to this vessel, in " +
                 std::string(vessels::name(unit)) + "?");
  }
  if (best->second < kMajority * area) {
    throw refuse("it lies on " + vessels::counted(votes.size(), "face") +
                 " of the model, give files of one face each");
  }
  Match result{best->first, file, std::move(part.mesh)};
  if (face(model, result.face).cap) {
    double face_area = 0;
    for (const Triangle& t : triangles_of(model, result.face)) face_area += area_of(model.mesh, t);
    if (face_area > kLikeArea * area || area > kLikeArea * face_area) {
      throw refuse("its area is " + vessels::number(area) + " mm2, that of the cap where it lies " +
                   vessels::number(face_area) + " mm2");
    }
  }
  return result;
}

/// Gives each triangle of a wall the face of the nearest of `files`; returns their faces' ids.
std::vector<int> divide(Model& model, int wall, const std::vector<const Match*>& files) {
  std::vector<int> ids = {wall};
  int next = 0;
  for (const Face& one : model.faces) next = std::max(next, one.id);
  std::vector<sdf::MeshDistance> distances;
  for (const Match* file : files) distances.emplace_back(file->mesh);
  while (ids.size() < files.size()) {
    ids.push_back(++next);
    model.faces.push_back({next, "", false});
  }
  for (std::size_t t = 0; t < model.mesh.triangles.size(); ++t) {
    if (model.face_of_triangle[t] != wall) continue;
    Vec3 centroid;
    area_of(model.mesh, model.mesh.triangles[t], &centroid);
    std::size_t nearest = 0;
    double least = std::numeric_limits<double>::infinity();
    for (std::size_t i = 0; i < distances.size(); ++i) {
      const double d = distances[i].closest(centroid).distance;
      if (d < least) {
        least = d;
        nearest = i;
      }
    }
    model.face_of_triangle[t] = ids[nearest];
  }
  return ids;
}

}  // namespace

std::vector<fs::path> face_files(const fs::path& folder) {
  std::vector<fs::path> files;
  std::error_code failed;
  for (const auto& entry : fs::directory_iterator(folder, failed)) {
    const std::string kind = vessels::extension(entry.path());
    if (kind == ".vtp" || kind == ".vtk" || kind == ".stl" || kind == ".obj")
      files.push_back(entry.path());
  }
  if (failed) throw Error(ExitCode::input_file, folder.string() + ": " + failed.message());
  if (files.empty())
    throw Error(ExitCode::input_file,
                folder.string() + ": no .vtp, .vtk, .stl or .obj files in it");
  std::sort(files.begin(), files.end());
  return files;
}

std::map<int, std::string> names_from_files(Model& model, const std::vector<fs::path>& files,
                                            vessels::LengthUnit unit) {
  const sdf::MeshDistance distance(model.mesh);
  std::map<int, std::vector<Match>> matches;
  for (const fs::path& file : files) {
    Match found = match(model, distance, file, unit);
    matches[found.face].push_back(std::move(found));
  }
  std::map<int, std::string> names;
  for (const auto& [id, on_face] : matches) {
    if (on_face.size() > 1 && face(model, id).cap) {
      throw Error(ExitCode::geometry, on_face[1].file.string() + ": it lies on the same cap as " +
                                          on_face[0].file.string() + ", give one of them");
    }
    std::vector<const Match*> parts;
    for (const Match& one : on_face) parts.push_back(&one);
    const std::vector<int> ids = parts.size() > 1 ? divide(model, id, parts) : std::vector<int>{id};
    for (std::size_t i = 0; i < parts.size(); ++i) names[ids[i]] = parts[i]->file.stem().string();
  }
  return names;
}

}  // namespace vstent::meshing
