#include "stents/link_curve.hpp"

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <stdexcept>
#include <string>

namespace vstent::stents {
namespace {

using Eigen::Vector2d;
using std::numbers::pi;

/// Unrolled curves from (0, 0) to (0, span); `width` is how far they swing aside.
using Curve = std::vector<Vector2d>;

/// A half circle in the middle on short legs, which grow once its radius is a quarter of the span.
Curve u_curve(double span, double width, int chords) {
  const double radius = std::min(0.95 * width, 0.25 * span);
  const int bend = std::max(6, chords / 2);
  Curve line{{0, 0}, {0, 0.5 * span - radius}};
  for (int i = 0; i <= bend; ++i) {
    const double turned = pi * i / bend;
    line.emplace_back(width - radius + radius * std::sin(turned),
                      0.5 * span - radius * std::cos(turned));
  }
  line.emplace_back(0, 0.5 * span + radius);
  line.emplace_back(0, span);
  return line;
}

/// Three limbs with round corners.
Curve n_curve(double span, double width, int chords) {
  const Curve corners{{0, 0}, {width, 0.25 * span}, {-width, 0.75 * span}, {0, span}};
  const int bend = std::max(4, chords / 4);
  Curve line{corners[0]};
  for (std::size_t c = 1; c < 3; ++c) {
    const Vector2d in = (corners[c] - corners[c - 1]).normalized();
    const Vector2d out = (corners[c + 1] - corners[c]).normalized();
    const double turn = std::acos(std::clamp(in.dot(out), -1.0, 1.0));
    const double limb = (corners[1] - corners[0]).norm();
    const double radius = std::min(0.25 * span, 0.45 * limb / std::tan(0.5 * turn + 1e-9));
    const double side = c == 1 ? 1 : -1;  // it turns left first, then right
    const Vector2d towards_centre = side * Vector2d(-in.y(), in.x());
    const Vector2d start = corners[c] - in * radius * std::tan(turn / 2);
    for (int i = 0; i <= bend; ++i) {
      const double a = turn * i / bend;
      line.push_back(start + radius * (1 - std::cos(a)) * towards_centre +
                     radius * std::sin(a) * in);
    }
  }
  line.push_back(corners[3]);
  return line;
}

Curve s_curve(double span, double width, int chords) {
  Curve line;
  for (int i = 0; i <= chords; ++i) {
    const double t = static_cast<double>(i) / chords, s = 1 - t;
    line.emplace_back(3 * s * s * t * width - 3 * s * t * t * width,
                      span * (3 * s * t * t + t * t * t));
  }
  return line;
}

/// The curve's z is measured along the straight line from `from` to `to`, its x around the
/// circumference.
std::vector<PatternPoint> wrapped(const Curve& curve, const PatternPoint& from,
                                  const PatternPoint& to, double distance) {
  std::vector<PatternPoint> points;
  for (const Vector2d& p : curve) {
    const double share = p.y() / distance;
    const double radius = from.radius + share * (to.radius - from.radius);
    points.push_back({radius, from.angle + share * (to.angle - from.angle) + p.x() / radius,
                      from.z + share * (to.z - from.z)});
  }
  points.front() = from;
  points.back() = to;
  return points;
}

double line_length(const std::vector<PatternPoint>& points) {
  return arc_length({.points = points});
}

}  // namespace

double cone_length(const PatternPoint& a, const PatternPoint& b) {
  const double dr = b.radius - a.radius, turn = b.angle - a.angle, dz = b.z - a.z;
  if (dr == 0) return std::hypot(a.radius * turn, dz);
  constexpr std::array<std::array<double, 2>, 5> kGauss = {
      {{0, 128.0 / 225},
       {-0.538469310105683, 0.478628670499366},
       {0.538469310105683, 0.478628670499366},
       {-0.906179845938664, 0.236926885056189},
       {0.906179845938664, 0.236926885056189}}};
  double sum = 0;
  for (const auto& [node, weight] : kGauss) {
    const double radius = a.radius + 0.5 * (1 + node) * dr;
    sum += 0.5 * weight * std::hypot(std::hypot(dr, dz), radius * turn);
  }
  return sum;
}

std::vector<PatternPoint> link_curve(Link shape, const PatternPoint& from, const PatternPoint& to,
                                     double length, int chords) {
  const double distance = cone_length(from, to);
  if (shape == Link::straight || distance == 0) {
    Curve line;
    for (int i = 0; i <= chords; ++i) line.emplace_back(0, distance * i / chords);
    return wrapped(line, from, to, distance > 0 ? distance : 1);
  }
  if (length < distance * (1 - 1e-9)) {
    throw std::invalid_argument("connectors of " + std::to_string(length) + " mm cannot span the " +
                                std::to_string(distance) + " mm between their rings");
  }
  const auto curve = [&](double width) {
    const Curve line = shape == Link::u ? u_curve(distance, width, chords)
                       : shape == Link::n
                           ? n_curve(distance, std::max(width, 1e-6 * distance), chords)
                           : s_curve(distance, width, chords);
    return wrapped(line, from, to, distance);
  };
  if (length <= distance) return curve(0);
  double low = 0, high = length;
  while (line_length(curve(high)) < length) high *= 2;
  while (true) {
    const double middle = 0.5 * (low + high);
    if (middle <= low || middle >= high) return curve(middle);
    (line_length(curve(middle)) < length ? low : high) = middle;
  }
}

}  // namespace vstent::stents
