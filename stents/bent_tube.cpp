#include "stents/bent_tube.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace vstent::stents {

std::size_t BentTube::segment_at(double s) const {
  const std::vector<double>& arc = axis_.arc;
  const auto upper = std::upper_bound(arc.begin() + 1, arc.end() - 1, s);
  return static_cast<std::size_t>(upper - arc.begin()) - 1;
}

BentTube::Place BentTube::at(double z) const {
  const double s = start_ + z;
  const std::vector<double>& arc = axis_.arc;
  if (s <= 0)
    return {axis_.points.front() + s * axis_.frames.front().tangent, axis_.frames.front()};
  if (s >= arc.back()) {
    const Frame& last = axis_.frames.back();
    return {axis_.points.back() + (s - arc.back()) * last.tangent, last};
  }
  const std::size_t i = segment_at(s);
  const double span = arc[i + 1] - arc[i];
  const double u = (s - arc[i]) / span;
  const Frame& a = axis_.frames[i];
  const Frame& b = axis_.frames[i + 1];
  const Vec3 chord = axis_.points[i + 1] - axis_.points[i];
  // Measured from the chord, so that a straight axis gives exactly its own points.
  const Vec3 leave = span * a.tangent - chord;
  const Vec3 arrive = span * b.tangent - chord;
  const double v = 1 - u;
  const Vec3 centre = axis_.points[i] + u * chord + u * v * (v * leave - u * arrive);
  const Vec3 velocity = chord + v * (1 - 3 * u) * leave + u * (3 * u - 2) * arrive;
  Place place;
  place.centre = centre;
  place.frame.tangent = velocity.normalized();
  const Vec3 normal = v * a.normal + u * b.normal;
  place.frame.normal =
      (normal - normal.dot(place.frame.tangent) * place.frame.tangent).normalized();
  return place;
}

Vec3 BentTube::point(const PatternPoint& p) const {
  const Place place = at(p.z);
  return place.centre + p.radius * place.outward(p.angle);
}

PatternPoint BentTube::coordinates(const Vec3& x, const PatternPoint& nearby) const {
  PatternPoint result = nearby;
  Place place = at(result.z);
  // The step that would be right on a straight axis leaves kappa r of the error: it converges
  // wherever the tube does not fold.
  for (int i = 0; i < 100; ++i) {
    const double step = (x - place.centre).dot(place.frame.tangent);
    result.z += step;
    place = at(result.z);
    if (std::abs(step) < 1e-14 * (1 + std::abs(result.z))) break;
  }
  const Vec3 from_centre = x - place.centre;
  result.radius = from_centre.norm();
  const double angle =
      std::atan2(from_centre.dot(place.frame.binormal()), from_centre.dot(place.frame.normal));
  result.angle = nearby.angle + std::remainder(angle - nearby.angle, 2 * std::numbers::pi);
  return result;
}

double BentTube::foot(const Vec3& x, double nearby) const {
  const std::vector<double>& arc = axis_.arc;
  const double smallest_step = 1e-14 * (1 + arc.back() + x.cwiseAbs().maxCoeff());
  double s = start_ + nearby;
  for (int i = 0; i < 100; ++i) {
    double step = 0;
    if (s <= 0 || s >= arc.back()) {
      const bool before = s <= 0;
      const Vec3& end = before ? axis_.points.front() : axis_.points.back();
      const Frame& frame = before ? axis_.frames.front() : axis_.frames.back();
      step = (x - end).dot(frame.tangent) - (before ? s : s - arc.back());
    } else {
      const std::size_t k = segment_at(s);
      const double span = arc[k + 1] - arc[k];
      const double u = (s - arc[k]) / span, v = 1 - u;
      const Vec3 chord = axis_.points[k + 1] - axis_.points[k];
      const Vec3 leave = span * axis_.frames[k].tangent - chord;
      const Vec3 arrive = span * axis_.frames[k + 1].tangent - chord;
      const Vec3 away = x - axis_.points[k] - u * chord - u * v * (v * leave - u * arrive);
      const Vec3 velocity = chord + v * (1 - 3 * u) * leave + u * (3 * u - 2) * arrive;
      const Vec3 acceleration = (6 * u - 4) * leave + (6 * u - 2) * arrive;
      const double speed2 = velocity.squaredNorm();
      // Beyond the centre of curvature Newton's step would lead away.
      const double slope = std::max(speed2 - away.dot(acceleration), 0.1 * speed2);
      step = span * away.dot(velocity) / slope;
    }
    s += step;
    if (std::abs(step) < smallest_step) break;
  }
  return s - start_;
}

double BentTube::largest_curvature(double z0, double z1) const {
  double largest = 0;
  for (std::size_t i = 0; i + 1 < axis_.arc.size(); ++i) {
    if (axis_.arc[i + 1] <= start_ + z0 || axis_.arc[i] >= start_ + z1) continue;
    const double turn = (axis_.frames[i + 1].tangent - axis_.frames[i].tangent).norm();
    largest = std::max(largest, turn / (axis_.arc[i + 1] - axis_.arc[i]));
  }
  return largest;
}

Vec3 straight_point(const PatternPoint& p) {
  return {p.radius * std::cos(p.angle), p.radius * std::sin(p.angle), p.z};
}

}  // namespace vstent::stents
