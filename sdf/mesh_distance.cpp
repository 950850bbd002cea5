#include "sdf/mesh_distance.hpp"

#include <Eigen/Geometry>
#include <cmath>
#include <numbers>

namespace vstent::sdf {
namespace {

Vec3 closest_point_on_edge(const Vec3& x, const Vec3& a, const Vec3& b) {
  const Vec3 edge = b - a;
  const double squared_length = edge.squaredNorm();
  if (!(squared_length > 0)) return a;
  return a + std::clamp((x - a).dot(edge) / squared_length, 0.0, 1.0) * edge;
}

}  // namespace

Vec3 closest_point_on_triangle(const Vec3& x, const Vec3& a, const Vec3& b, const Vec3& c) {
  // With x projected to a + u (b - a) + v (c - a): which corner, edge or the inside it falls to
  // follows from signs of dot products along the two sides at each corner.
  const Vec3 ab = b - a;
  const Vec3 ac = c - a;
  const Vec3 ax = x - a;
  const double ab_a = ab.dot(ax);
  const double ac_a = ac.dot(ax);
  if (ab_a <= 0 && ac_a <= 0) return a;
  const double ab_ab = ab.squaredNorm();
  const double ac_ac = ac.squaredNorm();
  const double ab_ac = ab.dot(ac);
  const double ab_b = ab_a - ab_ab;  // the same products seen from b and from c
  const double ac_b = ac_a - ab_ac;
  if (ab_b >= 0 && ac_b <= ab_b) return b;
  const double ab_c = ab_a - ab_ac;
  const double ac_c = ac_a - ac_ac;
  if (ac_c >= 0 && ab_c <= ac_c) return c;

  const double doubled_area = ab_ab * ac_ac - ab_ac * ab_ac;
  const double u = ac_ac * ab_a - ab_ac * ac_a;
  const double v = ab_ab * ac_a - ab_ac * ab_a;
  if (doubled_area > 0 && u > 0 && v > 0 && u + v < doubled_area) {
    return a + (u / doubled_area) * ab + (v / doubled_area) * ac;
  }
  Vec3 closest = closest_point_on_edge(x, a, b);
  for (const Vec3& candidate : {closest_point_on_edge(x, b, c), closest_point_on_edge(x, c, a)}) {
    if ((x - candidate).squaredNorm() < (x - closest).squaredNorm()) closest = candidate;
  }
  return closest;
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
