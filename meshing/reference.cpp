#include "meshing/reference.hpp"

#include <Eigen/Geometry>
#include <algorithm>

#include "sdf/mesh_distance.hpp"
#include "vessels/half_edges.hpp"

namespace vstent::meshing {
namespace {

std::array<int, 2> sorted(int a, int b) { return {std::min(a, b), std::max(a, b)}; }

double share_along(const Vec3& x, const Vec3& a, const Vec3& b) {
  const double squared = (b - a).squaredNorm();
  return squared > 0 ? std::clamp((x - a).dot(b - a) / squared, 0.0, 1.0) : 0.0;
}

}  // namespace

Reference::Reference(TriangleMesh mesh, std::span<const int> face_of_triangle, LengthField lengths)
    : mesh_(std::move(mesh)), lengths_(std::move(lengths)) {
  for (std::size_t t = 0; t < mesh_.triangles.size(); ++t)
    faces_[face_of_triangle[t]].triangles.push_back(static_cast<int>(t));
  const auto edges = vessels::sorted_half_edges(mesh_);
  vessels::for_each_edge(edges, [&](std::size_t begin, std::size_t end) {
    for (std::size_t e = begin + 1; e < end; ++e) {
      const int a = face_of_triangle[static_cast<std::size_t>(edges[begin].triangle)];
      const int b = face_of_triangle[static_cast<std::size_t>(edges[e].triangle)];
      if (a != b) curves_[sorted(a, b)].edges.push_back({edges[begin].low, edges[begin].high});
    }
  });
  const auto at = [&](int p) -> const Vec3& { return mesh_.points[static_cast<std::size_t>(p)]; };
  std::vector<Box> boxes;
  for (auto& [id, items] : faces_) {
    boxes.clear();
    for (const int t : items.triangles) {
      Box& box = boxes.emplace_back();
      for (const int p : mesh_.triangles[static_cast<std::size_t>(t)]) box.include(at(p));
    }
    items.tree = sdf::BoxTree(boxes);
  }
  for (auto& [ids, items] : curves_) {
    boxes.clear();
    for (const auto& [a, b] : items.edges) {
      Box& box = boxes.emplace_back();
      box.include(at(a));
      box.include(at(b));
    }
    items.tree = sdf::BoxTree(boxes);
  }
}

Vec3 Reference::closest(int triangle, const Vec3& x) const {
  const auto& [a, b, c] = mesh_.triangles[static_cast<std::size_t>(triangle)];
  return sdf::closest_point_on_triangle(x, mesh_.points[static_cast<std::size_t>(a)],
                                        mesh_.points[static_cast<std::size_t>(b)],
                                        mesh_.points[static_cast<std::size_t>(c)]);
}

double Reference::size_at(int triangle, const Vec3& x) const {
  const auto& corners = mesh_.triangles[static_cast<std::size_t>(triangle)];
  if (lengths_.uniform()) return lengths_.of_point(corners[0]);
  double wish = 0, total = 0;
  for (std::size_t k = 0; k < 3; ++k) {
    const Vec3& u = mesh_.points[static_cast<std::size_t>(corners[(k + 1) % 3])];
    const Vec3& v = mesh_.points[static_cast<std::size_t>(corners[(k + 2) % 3])];
    const double weight = (u - x).cross(v - x).norm();
    wish += weight * lengths_.of_point(corners[k]);
    total += weight;
  }
  return lengths_.at(x, total > 0 ? wish / total : lengths_.of_point(corners[0]));
}

Reference::Place Reference::on_face(int face, const Vec3& x, int near) const {
  const Items& items = faces_.at(face);
  const auto squared_distance = [&](int item) {
    return (x - closest(items.triangles[static_cast<std::size_t>(item)], x)).squaredNorm();
  };
  double limit = std::numeric_limits<double>::infinity();
  if (near >= 0) {  // what is found must be nearer, and the triangle itself must still be found
    const double known = (x - closest(near, x)).squaredNorm();
    limit = known * (1 + 1e-9) + std::numeric_limits<double>::min();
  }
  auto nearest = items.tree.nearest(x, squared_distance, limit);
  if (nearest.item < 0) nearest = items.tree.nearest(x, squared_distance);
  Place place;
  place.triangle = items.triangles[static_cast<std::size_t>(nearest.item)];
  place.point = closest(place.triangle, x);
  place.size = size_at(place.triangle, place.point);
  return place;
}

Reference::Place Reference::on_curve(int face, int other_face, const Vec3& x) const {
  const Items& items = curves_.at(sorted(face, other_face));
  const auto on_edge = [&](int item) {
    const auto& [a, b] = items.edges[static_cast<std::size_t>(item)];
    const Vec3& p = mesh_.points[static_cast<std::size_t>(a)];
    const Vec3& q = mesh_.points[static_cast<std::size_t>(b)];
    const double share = share_along(x, p, q);
    return std::pair(share, Vec3(share == 0 ? p : share == 1 ? q : Vec3(p + share * (q - p))));
  };
  const auto nearest =
      items.tree.nearest(x, [&](int item) { return (x - on_edge(item).second).squaredNorm(); });
  const auto& [a, b] = items.edges[static_cast<std::size_t>(nearest.item)];
  const auto [share, point] = on_edge(nearest.item);
  const double wish = (1 - share) * lengths_.of_point(a) + share * lengths_.of_point(b);
  return {point, lengths_.at(point, wish), -1};
}

}  // namespace vstent::meshing
