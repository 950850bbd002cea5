#include "stents/surface_map.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "sdf/polyline.hpp"
#include "stents/bent_tube.hpp"

namespace vstent::stents {

SurfaceMap::SurfaceMap(AxisWithFrames axis, double start, std::vector<double> radii,
                       double straight_radius)
    : axis_(std::move(axis)),
      start_(start),
      radii_(std::move(radii)),
      straight_radius_(straight_radius) {}

double SurfaceMap::radius_at(double z) const { return value_at(radii_, axis_.arc, start_ + z); }

double SurfaceMap::largest_radius() const {
  return *std::max_element(radii_.begin(), radii_.end());
}

double SurfaceMap::smallest_radius() const {
  return *std::min_element(radii_.begin(), radii_.end());
}

Vec3 SurfaceMap::placed(const Vec3& straight) const {
  const double radius = std::hypot(straight.x(), straight.y());
  const BentTube::Place place = BentTube(axis_, start_).at(straight.z());
  if (!(radius > 0)) return place.centre;
  const Vec3 outward =
      (straight.x() * place.frame.normal + straight.y() * place.frame.binormal()) / radius;
  return place.centre + (radius - straight_radius_ + radius_at(straight.z())) * outward;
}

TriangleMesh SurfaceMap::placed(TriangleMesh straight) const {
  for (Vec3& p : straight.points) p = placed(p);
  return straight;
}

std::optional<SurfaceMap::WayOut> SurfaceMap::way_out(const Vec3& x, double nearby) const {
  const BentTube tube(axis_, start_);
  WayOut way;
  way.z = tube.foot(x, nearby);
  const BentTube::Place place = tube.at(way.z);
  const double along_normal = (x - place.centre).dot(place.frame.normal);
  const double along_binormal = (x - place.centre).dot(place.frame.binormal());
  way.radius = std::hypot(along_normal, along_binormal);
  if (!(way.radius > 0)) return std::nullopt;
  way.straight_radius = way.radius - radius_at(way.z) + straight_radius_;
  way.straight_outward = Vec3(along_normal, along_binormal, 0) / way.radius;
  way.outward = way.straight_outward.x() * place.frame.normal +
                way.straight_outward.y() * place.frame.binormal();
  return way;
}

double SurfaceMap::least_stretch() const {
  const double curvature = BentTube(axis_, 0).largest_curvature(0, axis_.arc.back());
  const double along = 1 - curvature * largest_radius();
  double slope = 0;
  for (std::size_t i = 0; i + 1 < radii_.size(); ++i)
    slope =
        std::max(slope, std::abs(radii_[i + 1] - radii_[i]) / (axis_.arc[i + 1] - axis_.arc[i]));
  // A slope shears the plane of r and z; this is the smaller singular value of that.
  const double sheared = std::sqrt(1 + 0.25 * slope * slope) - 0.5 * slope;
  return std::clamp(along, 0.0, 1.0) * sheared;
}

double SurfaceMap::largest_move(const SurfaceMap& other) const {
  if (radii_.size() != other.radii_.size()) return std::numeric_limits<double>::infinity();
  double largest = 0;
  for (std::size_t i = 0; i < radii_.size(); ++i) {
    const Frame &a = axis_.frames[i], &b = other.axis_.frames[i];
    // A point at radius r moves with its centre, outwards, and with both arms of its frame.
    const double turn =
        std::hypot((b.normal - a.normal).norm(), (b.binormal() - a.binormal()).norm());
    largest = std::max(largest, (other.axis_.points[i] - axis_.points[i]).norm() +
                                    std::abs(other.radii_[i] - radii_[i]) +
                                    std::max(radii_[i], other.radii_[i]) * turn);
  }
  return largest;
}

}  // namespace vstent::stents
