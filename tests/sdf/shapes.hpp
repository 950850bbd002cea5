// Random points and test solids, the same in every run.
#pragma once

#include <Eigen/Geometry>
#include <cmath>
#include <cstdint>
#include <numbers>

#include "sdf/solid.hpp"

namespace vstent::tests {

/// splitmix64: unlike the standard distributions, the same numbers from every standard library.
class Random {
 public:
  explicit Random(std::uint64_t seed) : state_(seed) {}
  double operator()(double from, double to) {
    state_ += 0x9E3779B97F4A7C15u;
    std::uint64_t z = state_;
    z = (z ^ (z >> 30)) * 0xBF58476D1CE4E5B9u;
    z = (z ^ (z >> 27)) * 0x94D049BB133111EBu;
    z ^= z >> 31;
    return from + (to - from) * static_cast<double>(z >> 11) * 0x1p-53;
  }
  Vec3 in_box(const Vec3& lower, const Vec3& upper) {
    const double x = (*this)(lower.x(), upper.x());
    const double y = (*this)(lower.y(), upper.y());
    return {x, y, (*this)(lower.z(), upper.z())};
  }
  Vec3 in_cube(double half_side) {
    return in_box(Vec3::Constant(-half_side), Vec3::Constant(half_side));
  }
  Vec3 direction() {
    for (;;) {
      const Vec3 v = in_cube(1);
      const double n = v.norm();
      if (n > 0.1 && n < 1) return v / n;
    }
  }
  Eigen::Quaterniond rotation() {
    return Eigen::Quaterniond(Eigen::AngleAxisd((*this)(0, 2 * std::numbers::pi), direction()));
  }

 private:
  std::uint64_t state_;
};

inline Polyline straight_axis(const Vec3& from, const Vec3& to, int segments) {
  Polyline axis;
  for (int i = 0; i <= segments; ++i) axis.push_back(from + (to - from) * i / segments);
  return axis;
}

/// Circular arc of radius `bend` about the z axis, from angle 0.
inline Polyline arc_axis(double bend, double angle, int segments) {
  Polyline axis;
  for (int i = 0; i <= segments; ++i) {
    const double t = angle * i / segments;
    axis.emplace_back(bend * std::cos(t), bend * std::sin(t), 0);
  }
  return axis;
}

inline sdf::Solid uniform_tube(const Polyline& axis, double radius, bool round_ends = false) {
  return sdf::make_tube(axis, std::vector<double>(axis.size(), radius), round_ends);
}

inline sdf::Solid tapered_tube(const Polyline& axis, double first, double last,
                               bool round_ends = false) {
  std::vector<double> radii;
  for (std::size_t i = 0; i < axis.size(); ++i) {
    radii.push_back(first +
                    (last - first) * static_cast<double>(i) / static_cast<double>(axis.size() - 1));
  }
  return sdf::make_tube(axis, radii, round_ends);
}

inline sdf::Solid solid_of(const sdf::Segment& segment) {
  sdf::Solid solid;
  solid.segments = {segment};
  return solid;
}

inline sdf::Solid solid_of(const sdf::Strut& strut) {
  sdf::Solid solid;
  solid.struts = {strut};
  return solid;
}

/// The paper's union of flat-capped cylinders.
inline sdf::Solid paper_tube(const Polyline& axis, double radius) {
  sdf::Solid solid = uniform_tube(axis, radius, true);
  solid.joints = sdf::Joints::flat;
  return solid;
}

/// Short segments scattered in a cube: capsules, cones, single balls.
inline sdf::Solid scattered_struts(int count, double half_side, std::uint64_t seed) {
  Random random(seed);
  sdf::Solid solid;
  for (int i = 0; i < count; ++i) {
    const Vec3 a = random.in_cube(half_side);
    const Vec3 b = i % 17 == 0 ? a : Vec3(a + random(0.05, 0.8) * random.direction());
    const double radius = random(0.05, 0.25);
    solid.segments.push_back(
        {.a = a, .b = b, .radius_a = radius, .radius_b = i % 3 == 0 ? random(0.05, 0.25) : radius});
  }
  return solid;
}

/// 0.16 x 0.1 mm, askew.
inline sdf::Strut slanted_strut(double edge_radius, double length = 0.7) {
  const Vec3 along = Vec3(2, -1, 3).normalized();
  return {.a = {0.1, 0.2, 0.3},
          .b = Vec3(0.1, 0.2, 0.3) + length * along,
          .normal = along.cross(Vec3(1, 1, 0)).normalized(),
          .width = 0.16,
          .thickness = 0.1,
          .edge_radius = edge_radius};
}

/// Flat struts scattered in a cube: sharp, rounded and fully round edges, wide and high, plates.
inline sdf::Solid scattered_flat_struts(int count, double half_side, std::uint64_t seed) {
  Random random(seed);
  sdf::Solid solid;
  for (int i = 0; i < count; ++i) {
    const Vec3 a = random.in_cube(half_side);
    const Vec3 along = random.direction();
    const double length = i % 19 == 0 ? 0 : random(0.05, 0.6);
    const double width = random(0.06, 0.25), thickness = random(0.06, 0.25);
    solid.struts.push_back({.a = a,
                            .b = a + length * along,
                            .normal = along.cross(random.direction()).normalized(),
                            .width = width,
                            .thickness = thickness,
                            .edge_radius = 0.25 * (i % 3) * std::min(width, thickness)});
  }
  return solid;
}

inline Box bounds(const sdf::Solid& solid) {
  Box box;
  for (const sdf::Segment& s : solid.segments) {
    for (const auto& [centre, radius] : {std::pair(s.a, s.radius_a), std::pair(s.b, s.radius_b)}) {
      Box ball;
      ball.include(centre);
      ball.pad(radius);
      box.include(ball);
    }
  }
  for (const sdf::Strut& s : solid.struts) {
    for (const Vec3& centre : {s.a, s.b}) {
      Box ball;
      ball.include(centre);
      ball.pad(std::hypot(s.width, s.thickness) / 2);
      box.include(ball);
    }
  }
  return box;
}

}  // namespace vstent::tests
