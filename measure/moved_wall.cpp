#include "measure/moved_wall.hpp"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>

#include "sdf/polyline.hpp"
#include "sdf/signed_mesh_distance.hpp"

namespace vstent::measure {

MovedWall::MovedWall(const TriangleMesh& mesh, std::span<const char> chosen) {
  mesh_.points = mesh.points;
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t)
    if (chosen[t]) mesh_.triangles.push_back(mesh.triangles[t]);
  tree_ = sdf::triangle_tree(mesh_);
}

double MovedWall::ahead(const Vec3& x, const Vec3& direction, double limit) const {
  return sdf::first_crossing(mesh_, tree_, x, direction, limit);
}

std::vector<Vec3> MovedWall::sampled(double spacing) const {
  std::vector<Vec3> points;
  const auto corner = [&](int v) { return mesh_.points[static_cast<std::size_t>(v)]; };
  for (const Triangle& t : mesh_.triangles) {
    const Vec3 a = corner(t[0]), b = corner(t[1]), c = corner(t[2]);
    const double size = std::max({(a - b).norm(), (b - c).norm(), (c - a).norm()});
    const int parts = std::max(1, static_cast<int>(std::ceil(size / spacing)));
    for (int i = 0; i <= parts; ++i) {
      for (int j = 0; i + j <= parts; ++j)
        points.push_back(a + (b - a) * i / parts + (c - a) * j / parts);
    }
  }
  return points;
}

std::vector<double> depths(std::span<const Vec3> points, const Polyline& axis,
                           std::span<const double> radii) {
  const std::vector<double> arc = arc_lengths(axis);
  std::vector<double> depth(points.size());
  tbb::parallel_for(std::size_t{0}, points.size(), [&](std::size_t i) {
    const PolylinePlace place = nearest_place(axis, arc, points[i]);
    depth[i] = value_at(radii, arc, place.arc_length) - std::sqrt(place.squared_distance);
    const bool beyond_end = place.arc_length <= 0 || place.arc_length >= arc.back();
    if (beyond_end) depth[i] = std::min(depth[i], 0.0);
  });
  return depth;
}

}  // namespace vstent::measure
