#include "stents/surface_map.hpp"

#include <algorithm>
#include <cmath>

#include "sdf/polyline.hpp"
#include "stents/bent_tube.hpp"

namespace vstent::stents {

SurfaceMap::SurfaceMap(AxisWithFrames axis, double start, std::vector<double> radii,
                       double straight_radius)
    : axis_(std::move(axis)),
      start_(start),
      radii_(std::move(radii)),
      straight_radius_(straight_radius) {}

double SurfaceMap::largest_radius() const {
  return *std::max_element(radii_.begin(), radii_.end());
}

Vec3 SurfaceMap::placed(const Vec3& straight) const {
  const double radius = std::hypot(straight.x(), straight.y());
  const BentTube::Place place = BentTube(axis_, start_).at(straight.z());
  if (!(radius > 0)) return place.centre;
  const Vec3 outward =
      (straight.x() * place.frame.normal + straight.y() * place.frame.binormal()) / radius;
  const double outer = value_at(radii_, axis_.arc, start_ + straight.z());
  return place.centre + (radius - straight_radius_ + outer) * outward;
}

TriangleMesh SurfaceMap::placed(TriangleMesh straight) const {
  for (Vec3& p : straight.points) p = placed(p);
  return straight;
}

}  // namespace vstent::stents
