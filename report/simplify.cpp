#include "report/simplify.hpp"

#include <meshoptimizer.h>

namespace vstent::report {

Simplified simplify(const TriangleMesh& mesh, double error) {
  std::vector<float> positions;
  std::vector<unsigned> corners;
  positions.reserve(3 * mesh.points.size());
  corners.reserve(3 * mesh.triangles.size());
  for (const Vec3& p : mesh.points) {
    for (int k = 0; k < 3; ++k) positions.push_back(static_cast<float>(p[k]));
  }
  for (const Triangle& t : mesh.triangles) {
    for (const int v : t) corners.push_back(static_cast<unsigned>(v));
  }
  Simplified result;
  result.triangles_before = mesh.triangles.size();
  if (corners.empty()) return result;
  constexpr std::size_t kStride = 3 * sizeof(float);
  const std::size_t points = mesh.points.size();
  const float extent = meshopt_simplifyScale(positions.data(), points, kStride);
  float reached = 0;
  std::vector<unsigned> kept(corners.size());
  kept.resize(meshopt_simplify(kept.data(), corners.data(), corners.size(), positions.data(),
                               points, kStride, 0, static_cast<float>(error) / extent, 0,
                               &reached));
  result.error = static_cast<double>(reached) * static_cast<double>(extent);

  // In the order of use neighbours stand together, which compresses better.
  meshopt_optimizeVertexCache(kept.data(), kept.data(), kept.size(), points);
  std::vector<int> new_id(points, -1);
  for (std::size_t c = 0; c < kept.size(); c += 3) {
    Triangle triangle{};
    for (std::size_t k = 0; k < 3; ++k) {
      int& id = new_id[kept[c + k]];
      if (id < 0) {
        id = static_cast<int>(result.mesh.points.size());
        result.mesh.points.push_back(mesh.points[kept[c + k]]);
      }
      triangle[k] = id;
    }
    result.mesh.triangles.push_back(triangle);
  }
  return result;
}

}  // namespace vstent::report
