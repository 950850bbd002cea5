#include "sdf/solid.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <stdexcept>
#include <string>

#include "sdf/prepared_solid.hpp"

namespace vstent::sdf {
namespace {

Sample from_foot(const Vec3& offset, double radius) {
  const double length = offset.norm();
  return {length - radius, length > 0 ? Vec3(offset / length) : Vec3(Vec3::Zero())};
}

Sample round_cone(const PreparedSegment& segment, const Vec3& x) {
  const Vec3 from_a = x - segment.a;
  const double t = from_a.dot(segment.axis);
  const double rho = (from_a - t * segment.axis).norm();
  const double s = std::clamp(t - rho * segment.tangent, 0.0, segment.length);
  return from_foot(from_a - s * segment.axis, segment.radius_at(s));
}

/// Eq. 18: with axial excess dz and radial excess dr, max(dr, dz) inside and |(max(dr, 0), max(dz,
/// 0))| outside.
Sample capped_cylinder(const PreparedSegment& segment, const Vec3& x) {
  const Vec3 from_centre = x - (segment.a + 0.5 * segment.length * segment.axis);
  const double t = from_centre.dot(segment.axis);
  const Vec3 across = from_centre - t * segment.axis;
  const double rho = across.norm();
  const Vec3 axial = t < 0 ? Vec3(-segment.axis) : segment.axis;
  const Vec3 radial = rho > 0 ? Vec3(across / rho) : Vec3(Vec3::Zero());
  const double dz = std::abs(t) - 0.5 * segment.length;
  const double dr = rho - segment.radius;
  if (dz <= 0 || dr <= 0) return dr > dz ? Sample{dr, radial} : Sample{dz, axial};
  const double distance = std::hypot(dr, dz);
  return {distance, (dr * radial + dz * axial) / distance};
}

/// Cuts a round cone by the plane of a cap. Beyond the plane the disc is the nearest surface,
/// unless x still projects onto the side of the cone behind the plane (narrowing tubes, the inner
/// side of a bend).
Sample cut(const Sample& uncut, const EndCap& cap, const Vec3& x) {
  const Vec3 from_centre = x - cap.centre;
  const double z = from_centre.dot(cap.outward);
  if (z <= 0) return uncut.distance >= z ? uncut : Sample{z, cap.outward};
  if (uncut.distance > 0 && z - uncut.distance * uncut.gradient.dot(cap.outward) <= 0) return uncut;
  const Vec3 across = from_centre - z * cap.outward;
  const double rho = across.norm();
  if (rho <= cap.radius) return {z, cap.outward};
  const double excess = rho - cap.radius;
  const double distance = std::hypot(excess, z);
  return {distance, (excess / rho * across + z * cap.outward) / distance};
}

/// How far (mm, along the axis from the end `front`) the cap's plane can cut: until the axis lies
/// its own radius behind the plane. A bend no tighter than the radius gets there within pi/2 radii.
template <class PointAt, class RadiusAt>
int segments_under_cap(int points, PointAt&& point, RadiusAt&& radius, const EndCap& cap) {
  double arc = 0;
  for (int i = 1; i < points; ++i) {
    arc += (point(i) - point(i - 1)).norm();
    if ((point(i) - cap.centre).dot(cap.outward) <= -radius(i)) return i;
    if (arc >= 0.5 * std::numbers::pi * std::max(radius(0), radius(i))) return i;
  }
  return points - 1;
}

/// The disc where the plane through the end ball's centre cuts the last cone: a narrowing cone is
/// wider there than the ball.
EndCap end_cap(const Vec3& end, const Vec3& before, double radius, double radius_before) {
  const double length = (end - before).norm();
  const double drop = radius_before - radius;
  double disc = radius;
  if (drop > 0) {
    const bool on_cone =
        length * length > radius_before * drop;  // else the plane cuts the larger ball itself
    disc = on_cone ? radius * length / std::sqrt((length - drop) * (length + drop))
                   : std::sqrt(std::max(0.0, (radius_before - length) * (radius_before + length)));
    disc = std::max(disc, radius);
  }
  return {end, (end - before) / length, disc};
}

}  // namespace

Sample uncut_distance_to(const PreparedSegment& segment, const Vec3& x) {
  return round_cone(segment, x);
}

Sample distance_to(const PreparedSegment& segment, std::span<const EndCap> caps, Joints joints,
                   const Vec3& x) {
  if (joints == Joints::flat) return capped_cylinder(segment, x);
  const Sample uncut = round_cone(segment, x);
  if (segment.start_cap < 0 && segment.end_cap < 0) return uncut;
  if (segment.end_cap < 0) return cut(uncut, caps[static_cast<std::size_t>(segment.start_cap)], x);
  const Sample end = cut(uncut, caps[static_cast<std::size_t>(segment.end_cap)], x);
  if (segment.start_cap < 0) return end;
  const Sample start = cut(uncut, caps[static_cast<std::size_t>(segment.start_cap)], x);
  return start.distance > end.distance ? start : end;
}

Sample distance_to(const PreparedStrut& strut, const Vec3& x) {
  const Vec3 from_a = x - strut.a;
  const double height = from_a.dot(strut.normal);
  const double s = std::clamp(from_a.dot(strut.axis), 0.0, strut.length);
  const Vec3 across = from_a - s * strut.axis - height * strut.normal;
  const double rho = across.norm();
  const Vec3 sideways = rho > 0 ? Vec3(across / rho) : Vec3(Vec3::Zero());
  const Vec3 upwards = height < 0 ? Vec3(-strut.normal) : strut.normal;
  const double side = rho - strut.half_width;
  const double face = std::abs(height) - strut.half_thickness;
  if (side <= 0 || face <= 0) {
    return side > face ? Sample{side - strut.edge_radius, sideways}
                       : Sample{face - strut.edge_radius, upwards};
  }
  const double from_core = std::hypot(side, face);
  return {from_core - strut.edge_radius, (side * sideways + face * upwards) / from_core};
}

Sample capsule(const Vec3& x, const Vec3& a, const Vec3& b, double radius) {
  return round_cone(x, a, b, radius, radius);
}

Sample capped_cylinder(const Vec3& x, const Vec3& a, const Vec3& b, double radius) {
  return capped_cylinder(
      prepare({.a = a, .b = b, .radius_a = radius, .radius_b = radius}, Joints::flat), x);
}

Sample round_cone(const Vec3& x, const Vec3& a, const Vec3& b, double radius_a, double radius_b) {
  return round_cone(
      prepare({.a = a, .b = b, .radius_a = radius_a, .radius_b = radius_b}, Joints::round), x);
}

Sample flat_strut(const Vec3& x, const Strut& strut) { return distance_to(prepare(strut), x); }

Solid make_tube(const Polyline& axis, const std::vector<double>& radii, bool round_ends) {
  const std::size_t points = axis.size();
  if (points < 2) throw std::invalid_argument("tube: the axis needs at least two points");
  if (radii.size() != points) {
    throw std::invalid_argument("tube: " + std::to_string(radii.size()) + " radii for " +
                                std::to_string(points) + " axis points");
  }
  for (std::size_t i = 0; i < points; ++i) {
    const std::string where = "tube: axis point " + std::to_string(i);
    if (!axis[i].allFinite()) throw std::invalid_argument(where + " is not finite");
    if (!(radii[i] > 0) || !std::isfinite(radii[i])) {
      throw std::invalid_argument(where + " has radius " + std::to_string(radii[i]) +
                                  " mm; it must be positive");
    }
    if (i > 0 && !((axis[i] - axis[i - 1]).norm() > 0))
      throw std::invalid_argument(where + " repeats the one before");
  }

  Solid tube;
  tube.segments.reserve(points - 1);
  for (std::size_t i = 1; i < points; ++i) {
    tube.segments.push_back(
        {.a = axis[i - 1], .b = axis[i], .radius_a = radii[i - 1], .radius_b = radii[i]});
  }
  if (round_ends) return tube;

  const std::size_t last = points - 1;
  tube.caps = {end_cap(axis[0], axis[1], radii[0], radii[1]),
               end_cap(axis[last], axis[last - 1], radii[last], radii[last - 1])};
  const auto from_start = [&](auto& values) {
    return [&](int i) { return values[static_cast<std::size_t>(i)]; };
  };
  const auto from_end = [&](auto& values) {
    return [&](int i) { return values[last - static_cast<std::size_t>(i)]; };
  };
  const int count = static_cast<int>(points);
  const auto near_start = static_cast<std::size_t>(
      segments_under_cap(count, from_start(axis), from_start(radii), tube.caps[0]));
  const auto near_end = static_cast<std::size_t>(
      segments_under_cap(count, from_end(axis), from_end(radii), tube.caps[1]));
  for (std::size_t i = 0; i < near_start; ++i) tube.segments[i].start_cap = 0;
  for (std::size_t i = 0; i < near_end; ++i) tube.segments[last - 1 - i].end_cap = 1;
  return tube;
}

Sample distance_brute_force(const Solid& solid, const Vec3& x) {
  Sample best{std::numeric_limits<double>::infinity(), Vec3::Zero()};
  for (const Segment& segment : solid.segments) {
    const Sample sample = distance_to(prepare(segment, solid.joints), solid.caps, solid.joints, x);
    if (sample.distance < best.distance) best = sample;
  }
  for (const Strut& strut : solid.struts) {
    const Sample sample = flat_strut(x, strut);
    if (sample.distance < best.distance) best = sample;
  }
  return best;
}

}  // namespace vstent::sdf
