#include "sdf/signed_mesh_distance.hpp"

#include <tbb/parallel_for.h>

#include <Eigen/Geometry>
#include <cmath>
#include <map>

namespace vstent::sdf {
namespace {

std::size_t at(int index) { return static_cast<std::size_t>(index); }

double angle_between(const Vec3& a, const Vec3& b) {
  return std::atan2(a.cross(b).norm(), a.dot(b));
}

}  // namespace

SignedMeshDistance::SignedMeshDistance(TriangleMesh mesh)
    : mesh_(std::move(mesh)), unsigned_(mesh_), corner_(mesh_.points.size(), Vec3::Zero()) {
  std::map<std::pair<int, int>, Vec3> of_edge;
  const auto key = [](const Triangle& t, std::size_t k) {
    return std::minmax(t[k], t[(k + 1) % 3]);
  };
  for (const Triangle& t : mesh_.triangles) {
    const Vec3 &a = mesh_.points[at(t[0])], &b = mesh_.points[at(t[1])],
               &c = mesh_.points[at(t[2])];
    const Vec3 normal = (b - a).cross(c - a).normalized();
    face_.push_back(normal);
    corner_[at(t[0])] += angle_between(b - a, c - a) * normal;
    corner_[at(t[1])] += angle_between(c - b, a - b) * normal;
    corner_[at(t[2])] += angle_between(a - c, b - c) * normal;
    for (std::size_t k = 0; k < 3; ++k)
      of_edge.try_emplace(key(t, k), Vec3::Zero()).first->second += normal;
  }
  for (const Triangle& t : mesh_.triangles)
    edge_.push_back({of_edge[key(t, 0)], of_edge[key(t, 1)], of_edge[key(t, 2)]});
}

Vec3 SignedMeshDistance::pseudo_normal(int triangle, const Vec3& on_it) const {
  const Triangle& t = mesh_.triangles[at(triangle)];
  const std::array<Vec3, 3> corners = {mesh_.points[at(t[0])], mesh_.points[at(t[1])],
                                       mesh_.points[at(t[2])]};
  double size = 0;
  for (std::size_t k = 0; k < 3; ++k)
    size = std::max(size, (corners[(k + 1) % 3] - corners[k]).norm());
  const double close = 1e-9 * size;
  for (std::size_t k = 0; k < 3; ++k)
    if ((on_it - corners[k]).norm() <= close) return corner_[at(t[k])];
  for (std::size_t k = 0; k < 3; ++k) {
    const Vec3 along = (corners[(k + 1) % 3] - corners[k]).normalized();
    if (along.cross(on_it - corners[k]).norm() <= close) return edge_[at(triangle)][k];
  }
  return face_[at(triangle)];
}

double SignedMeshDistance::distance(const Vec3& x) const {
  const MeshDistance::Closest closest = unsigned_.closest(x);
  const bool inside = (x - closest.point).dot(pseudo_normal(closest.triangle, closest.point)) < 0;
  return inside ? -closest.distance : closest.distance;
}

void SignedMeshDistance::distances(std::span<const Vec3> points,
                                   std::span<double> distances) const {
  tbb::parallel_for(std::size_t{0}, points.size(),
                    [&](std::size_t i) { distances[i] = distance(points[i]); });
}

double first_crossing(const TriangleMesh& mesh, const BoxTree& tree, const Vec3& x,
                      const Vec3& direction, double limit) {
  double nearest = std::numeric_limits<double>::infinity();
  Box way;
  way.include(x);
  way.include(Vec3(x + limit * direction));
  tree.overlapping(way, [&](int item) {
    const Triangle& t = mesh.triangles[at(item)];
    const Vec3& a = mesh.points[at(t[0])];
    // Cramer's rule for x + s d = a + u (b - a) + v (c - a).
    const Vec3 ab = mesh.points[at(t[1])] - a, ac = mesh.points[at(t[2])] - a, ax = x - a;
    const Vec3 across = direction.cross(ac);
    const double determinant = ab.dot(across);
    if (determinant == 0) return;
    const double u = ax.dot(across) / determinant;
    const Vec3 turned = ax.cross(ab);
    const double v = direction.dot(turned) / determinant;
    constexpr double kSlack = 1e-9;  // rays through an edge must not slip between its triangles
    if (u < -kSlack || v < -kSlack || u + v > 1 + kSlack) return;
    const double s = ac.dot(turned) / determinant;
    if (s >= 0 && s <= limit) nearest = std::min(nearest, s);
  });
  return nearest;
}

BoxTree triangle_tree(const TriangleMesh& mesh) {
  std::vector<Box> boxes;
  boxes.reserve(mesh.triangles.size());
  for (const Triangle& t : mesh.triangles) {
    Box box;
    for (const int v : t) box.include(mesh.points[at(v)]);
    boxes.push_back(box);
  }
  return BoxTree(boxes);
}

}  // namespace vstent::sdf
