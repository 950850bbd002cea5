#include "sdf/mesh_distance.hpp"

#include <Eigen/Geometry>
#include <cmath>
#include <numbers>

#include "sdf/nearest.hpp"

namespace vstent::sdf {

Vec3 closest_point_on_triangle(const Vec3& x, const Vec3& a, const Vec3& b, const Vec3& c) {
  const Vec3 weights = nearest_on_triangle(x, a, b, c);
  return weights.x() * a + weights.y() * b + weights.z() * c;
}

MeshDistance::MeshDistance(const TriangleMesh& mesh) : mesh_(mesh) {
  std::vector<Box> boxes;
  boxes.reserve(mesh_.triangles.size());
  for (const Triangle& triangle : mesh_.triangles) {
    Box box;
    for (const int point : triangle) box.include(mesh_.points[static_cast<std::size_t>(point)]);
    boxes.push_back(box);
  }
  tree_ = BoxTree(boxes);
}

MeshDistance::Closest MeshDistance::closest(const Vec3& x, double limit) const {
  const auto closest_on = [&](int item) {
    const auto& [a, b, c] = mesh_.triangles[static_cast<std::size_t>(item)];
    return closest_point_on_triangle(x, mesh_.points[static_cast<std::size_t>(a)],
                                     mesh_.points[static_cast<std::size_t>(b)],
                                     mesh_.points[static_cast<std::size_t>(c)]);
  };
  const auto nearest = tree_.nearest(
      x, [&](int item) { return (x - closest_on(item)).squaredNorm(); }, limit * limit);
  Closest closest;
  if (nearest.item < 0) return closest;
  closest.triangle = nearest.item;
  closest.point = closest_on(nearest.item);
  closest.distance = std::sqrt(nearest.squared_distance);
  return closest;
}

double MeshDistance::winding_number(const Vec3& x) const {
  double solid_angle = 0;
  for (const auto& [i, j, k] : mesh_.triangles) {
    const Vec3 a = mesh_.points[static_cast<std::size_t>(i)] - x;
    const Vec3 b = mesh_.points[static_cast<std::size_t>(j)] - x;
    const Vec3 c = mesh_.points[static_cast<std::size_t>(k)] - x;
    const double la = a.norm();
    const double lb = b.norm();
    const double lc = c.norm();
    // tan(omega / 2) of Van Oosterom and Strackee; atan2 keeps the sign.
    const double numerator = a.dot(b.cross(c));
    const double denominator = la * lb * lc + a.dot(b) * lc + b.dot(c) * la + c.dot(a) * lb;
    solid_angle += 2 * std::atan2(numerator, denominator);
  }
  return solid_angle / (4 * std::numbers::pi);
}

}  // namespace vstent::sdf
