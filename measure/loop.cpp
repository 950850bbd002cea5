#include "measure/loop.hpp"

#include "measure/corners.hpp"

namespace vstent::measure {

Loop loop(std::span<const Vec3> points) {
  Loop result;
  Vec3 mean = Vec3::Zero();
  for (const Vec3& p : points) mean += p;
  mean /= static_cast<double>(points.size());
  const auto next = [&](std::size_t i) -> const Vec3& { return points[(i + 1) % points.size()]; };
  for (std::size_t i = 0; i < points.size(); ++i)
    result.area_vector += 0.5 * (points[i] - mean).cross(next(i) - mean);
  result.centroid = mean;
  const double area = result.area_vector.norm();
  if (!(area > 0)) return result;
  const Vec3 normal = result.area_vector / area;
  Vec3 moment = Vec3::Zero();
  for (std::size_t i = 0; i < points.size(); ++i) {
    const Vec3 p = points[i] - mean, q = next(i) - mean;
    moment += 0.5 * p.cross(q).dot(normal) * (p + q) / 3;
  }
  result.centroid += moment / area;
  return result;
}

std::vector<Vec3> carried(const vessels::Section& section, std::span<const Vec3> points) {
  std::vector<Vec3> result;
  result.reserve(section.crossings.size());
  for (const vessels::EdgeCrossing& c : section.crossings)
    result.push_back((1 - c.share) * points[at(c.from)] + c.share * points[at(c.to)]);
  return result;
}

}  // namespace vstent::measure
