#include "vessels/triangulate.hpp"

#include <Eigen/Geometry>

namespace vstent::vessels {

std::vector<Triangle> triangulate(std::span<const int> polygon, std::span<const Vec3> points,
                                  bool& simple) {
  std::vector<int> rest(polygon.begin(), polygon.end());
  const auto at = [&](int vertex) -> const Vec3& {
    return points[static_cast<std::size_t>(vertex)];
  };
  Vec3 normal = Vec3::Zero();  // Newell: twice the vector area
  for (std::size_t k = 0; k < rest.size(); ++k) {
    normal += (at(rest[k]) - at(rest[0])).cross(at(rest[(k + 1) % rest.size()]) - at(rest[0]));
  }
  const auto side = [&](const Vec3& a, const Vec3& b, const Vec3& c) {
    return normal.dot((b - a).cross(c - a));
  };

  std::vector<Triangle> triangles;
  while (rest.size() > 3) {
    const std::size_t n = rest.size();
    std::size_t best = n;
    double best_quality = -1;
    for (std::size_t k = 0; k < n; ++k) {
      const int a = rest[(k + n - 1) % n], b = rest[k], c = rest[(k + 1) % n];
      const double area = side(at(a), at(b), at(c));
      if (area <= 0) continue;
      bool empty = true;
      for (const int v : rest) {
        if (v == a || v == b || v == c) continue;
        const Vec3& x = at(v);
        if (side(at(a), at(b), x) >= 0 && side(at(b), at(c), x) >= 0 && side(at(c), at(a), x) >= 0)
          empty = false;
      }
      const double edges = (at(b) - at(a)).squaredNorm() + (at(c) - at(b)).squaredNorm() +
                           (at(a) - at(c)).squaredNorm();
      if (empty && area / edges > best_quality) {
        best = k;
        best_quality = area / edges;
      }
    }
    if (best == n) {
      simple = false;
      break;
    }
    triangles.push_back({rest[(best + n - 1) % n], rest[best], rest[(best + 1) % n]});
    rest.erase(rest.begin() + static_cast<std::ptrdiff_t>(best));
  }
  for (std::size_t k = 2; k < rest.size(); ++k)
    triangles.push_back({rest[0], rest[k - 1], rest[k]});
  return triangles;
}

}  // namespace vstent::vessels
