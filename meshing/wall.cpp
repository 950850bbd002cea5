#include "meshing/wall.hpp"

#include <algorithm>
#include <cmath>

#include "vessels/error.hpp"
#include "vessels/text.hpp"

namespace vstent::meshing {
namespace {

constexpr int kSweeps = 15;
constexpr double kWide = 0.3;    // least cosine to a triangle's normal that smoothing may leave
constexpr double kPoor = 0.2;    // below this a better direction is searched
constexpr double kLeast = 0.02;  // below this nothing grows

std::size_t index(int i) { return static_cast<std::size_t>(i); }

std::vector<Vec3> inward_normals(const TriangleMesh& mesh) {
  std::vector<Vec3> normals;
  normals.reserve(mesh.triangles.size());
  for (const Triangle& t : mesh.triangles) {
    const Vec3& a = mesh.points[index(t[0])];
    normals.push_back(
        (mesh.points[index(t[2])] - a).cross(mesh.points[index(t[1])] - a).normalized());
  }
  return normals;
}

/// Unit directions, each at less than a right angle to the inward normals of all triangles around
/// its point; rims go along their caps.
class Directions {
 public:
  Directions(const Wall& wall, vessels::LengthUnit unit)
      : wall_(wall), unit_(unit), normals_(inward_normals(wall.mesh)) {}

  std::vector<Vec3> find() {
    std::vector<Vec3> direction(wall_.mesh.points.size());
    for (std::size_t v = 0; v < direction.size(); ++v) direction[v] = in_cap(v, mean_normal(v));
    for (int sweep = 0; sweep < kSweeps; ++sweep) {
      std::vector<Vec3> smooth = direction;
      for (std::size_t v = 0; v < direction.size(); ++v) {
        Vec3 sum = direction[v];
        for (const int n : wall_.neighbours[v]) sum += direction[index(n)];
        const Vec3 candidate = in_cap(v, sum);
        if (least_cosine(v, candidate) > std::min(kWide, least_cosine(v, direction[v])))
          smooth[v] = candidate;
      }
      direction = std::move(smooth);
    }
    for (std::size_t v = 0; v < direction.size(); ++v) {
      if (least_cosine(v, direction[v]) < kPoor) direction[v] = most_normal(v, direction[v]);
      if (!(least_cosine(v, direction[v]) > kLeast))
        throw Error(ExitCode::geometry, "boundary layers cannot grow at " +
                                            vessels::place(wall_.mesh.points[v], unit_) +
                                            ": the wall folds there; smooth or remesh it");
    }
    return direction;
  }

 private:
  /// The part of `direction` along the point's cap, as a unit vector.
  Vec3 in_cap(std::size_t v, Vec3 direction) const {
    if (wall_.cap[v] >= 0) {
      const Vec3& normal = wall_.cap_normal.at(wall_.cap[v]);
      direction -= direction.dot(normal) * normal;
    }
    const double length = direction.norm();
    return length > 0 ? Vec3(direction / length) : direction;
  }
  Vec3 mean_normal(std::size_t v) const {
    Vec3 sum = Vec3::Zero();
    for (const int t : wall_.triangles[v]) {
      const Triangle& corners = wall_.mesh.triangles[index(t)];
      std::size_t k = 0;
      while (corners[k] != static_cast<int>(v)) ++k;
      const Vec3 a = wall_.mesh.points[index(corners[(k + 1) % 3])] - wall_.mesh.points[v];
      const Vec3 b = wall_.mesh.points[index(corners[(k + 2) % 3])] - wall_.mesh.points[v];
      sum += std::atan2(a.cross(b).norm(), a.dot(b)) * normals_[index(t)];
    }
    return sum;
  }
  double least_cosine(std::size_t v, const Vec3& direction) const {
    double least = 1;
    for (const int t : wall_.triangles[v])
      least = std::min(least, direction.dot(normals_[index(t)]));
    return least;
  }
  /// Turned towards the normal it is farthest from, again and again.
  Vec3 most_normal(std::size_t v, Vec3 direction) const {
    Vec3 best = direction;
    for (int turn = 0; turn < 200; ++turn) {
      const auto farthest = *std::min_element(
          wall_.triangles[v].begin(), wall_.triangles[v].end(), [&](int a, int b) {
            return direction.dot(normals_[index(a)]) < direction.dot(normals_[index(b)]);
          });
      direction = in_cap(v, direction + normals_[index(farthest)] / (turn + 2.0));
      if (least_cosine(v, direction) > least_cosine(v, best)) best = direction;
    }
    return best;
  }

  const Wall& wall_;
  vessels::LengthUnit unit_;
  std::vector<Vec3> normals_;
};

}  // namespace

Wall wall_of(const Model& model, vessels::LengthUnit unit) {
  std::map<int, bool> is_cap;
  for (const Face& face : model.faces) is_cap[face.id] = face.cap;
  Wall wall;
  std::vector<int> number(model.mesh.points.size(), -1);
  for (std::size_t t = 0; t < model.mesh.triangles.size(); ++t) {
    if (is_cap.at(model.face_of_triangle[t])) continue;
    for (const int v : model.mesh.triangles[t]) number[index(v)] = 0;
  }
  for (std::size_t v = 0; v < number.size(); ++v) {
    if (number[v] < 0) continue;
    number[v] = static_cast<int>(wall.mesh.points.size());
    wall.mesh.points.push_back(model.mesh.points[v]);
  }
  const std::size_t points = wall.mesh.points.size();
  wall.cap.assign(points, -1);
  wall.neighbours.resize(points);
  wall.triangles.resize(points);
  for (std::size_t t = 0; t < model.mesh.triangles.size(); ++t) {
    Triangle corners = model.mesh.triangles[t];
    const int id = model.face_of_triangle[t];
    if (is_cap.at(id)) {
      const auto at = [&](std::size_t k) { return model.mesh.points[index(corners[k])]; };
      const Vec3 area = (at(1) - at(0)).cross(at(2) - at(0));
      wall.cap_normal.try_emplace(id, Vec3::Zero()).first->second += area;
      for (const int v : corners) {
        if (number[index(v)] < 0) continue;
        int& cap = wall.cap[index(number[index(v)])];
        if (cap >= 0 && cap != id)
          throw Error(ExitCode::geometry, "boundary layers cannot grow: the caps " +
                                              face(model, cap).name + " and " +
                                              face(model, id).name + " touch at " +
                                              vessels::place(model.mesh.points[index(v)], unit));
        cap = id;
      }
      continue;
    }
    for (int& v : corners) v = number[index(v)];
    for (std::size_t k = 0; k < 3; ++k) {
      wall.triangles[index(corners[k])].push_back(static_cast<int>(wall.mesh.triangles.size()));
      wall.neighbours[index(corners[k])].push_back(corners[(k + 1) % 3]);
      wall.neighbours[index(corners[k])].push_back(corners[(k + 2) % 3]);
    }
    wall.mesh.triangles.push_back(corners);
    wall.face.push_back(id);
  }
  for (std::vector<int>& around : wall.neighbours) {
    std::sort(around.begin(), around.end());
    around.erase(std::unique(around.begin(), around.end()), around.end());
  }
  for (auto& [id, normal] : wall.cap_normal) normal.normalize();
  return wall;
}

std::vector<Vec3> inward_directions(const Wall& wall, vessels::LengthUnit unit) {
  return Directions(wall, unit).find();
}

}  // namespace vstent::meshing
