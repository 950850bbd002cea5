#include "measure/triangle_tree.hpp"

#include "measure/corners.hpp"

namespace vstent::measure {

TriangleTree::TriangleTree(const TriangleMesh& mesh, std::span<const char> chosen) : mesh_(mesh) {
  std::vector<Box> boxes;
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    if (!chosen.empty() && !chosen[t]) continue;
    triangles_.push_back(static_cast<int>(t));
    Box box;
    for (const int v : mesh.triangles[t]) box.include(mesh.points[at(v)]);
    boxes.push_back(box);
  }
  tree_ = sdf::BoxTree(boxes);
}

double TriangleTree::ahead(const Vec3& x, const Vec3& direction, double limit) const {
  double nearest = std::numeric_limits<double>::infinity();
  Box way;
  way.include(x);
  way.include(Vec3(x + limit * direction));
  tree_.overlapping(way, [&](int item) {
    const auto [a, b, c] = corners(mesh_, at(triangles_[at(item)]));
    // Cramer's rule for x + s d = a + u (b - a) + v (c - a).
    const Vec3 ab = b - a, ac = c - a, ax = x - a;
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

}  // namespace vstent::measure
