#include "xpbd/proximity.hpp"

#include <algorithm>

#include "sdf/nearest.hpp"

namespace vstent::xpbd {
namespace {

double share(double part, double whole) { return whole > 0 ? part / whole : 0; }

}  // namespace

Nearest point_triangle(const Vec3& x, const Vec3& a, const Vec3& b, const Vec3& c) {
  const Vec3 weights = nearest_on_triangle(x, a, b, c);
  Nearest found;
  found.offset = x - (weights.x() * a + weights.y() * b + weights.z() * c);
  found.distance = found.offset.norm();
  found.weights = {1, -weights.x(), -weights.y(), -weights.z()};
  return found;
}

Nearest point_segment(const Vec3& x, const Vec3& a, const Vec3& b) {
  const double t = nearest_on_edge(x, a, b);
  Nearest found;
  found.offset = x - (a + t * (b - a));
  found.distance = found.offset.norm();
  found.weights = {1, t - 1, -t, 0};
  return found;
}

Nearest segment_segment(const Vec3& p, const Vec3& q, const Vec3& r, const Vec3& s) {
  const Vec3 u = q - p, v = s - r, w = p - r;
  const double uu = u.squaredNorm(), vv = v.squaredNorm(), uv = u.dot(v);
  const double uw = u.dot(w), vw = v.dot(w);
  const double cross = uu * vv - uv * uv;
  double along_u = cross > 0 ? std::clamp((uv * vw - uw * vv) / cross, 0.0, 1.0) : 0;
  double along_v = share(uv * along_u + vw, vv);
  if (along_v < 0) {
    along_v = 0;
    along_u = std::clamp(share(-uw, uu), 0.0, 1.0);
  } else if (along_v > 1) {
    along_v = 1;
    along_u = std::clamp(share(uv - uw, uu), 0.0, 1.0);
  }
  Nearest found;
  found.offset = w + along_u * u - along_v * v;
  found.distance = found.offset.norm();
  found.weights = {1 - along_u, along_u, along_v - 1, -along_v};
  return found;
}

}  // namespace vstent::xpbd
