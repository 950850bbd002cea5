#include "xpbd/proximity.hpp"

#include <algorithm>

namespace vstent::xpbd {
namespace {

Nearest to_place_on_triangle(const Vec3& x, const Vec3& a, const Vec3& b, const Vec3& c,
                             const Vec3& weights) {
  Nearest found;
  found.offset = x - (weights.x() * a + weights.y() * b + weights.z() * c);
  found.distance = found.offset.norm();
  found.weights = {1, -weights.x(), -weights.y(), -weights.z()};
  return found;
}

double share(double part, double whole) { return whole > 0 ? part / whole : 0; }

}  // namespace

Nearest point_triangle(const Vec3& x, const Vec3& a, const Vec3& b, const Vec3& c) {
  const auto at = [&](double wa, double wb, double wc) {
    return to_place_on_triangle(x, a, b, c, {wa, wb, wc});
  };
  const Vec3 ab = b - a, ac = c - a, ax = x - a, bx = x - b, cx = x - c;
  const double d1 = ab.dot(ax), d2 = ac.dot(ax);
  if (d1 <= 0 && d2 <= 0) return at(1, 0, 0);
  const double d3 = ab.dot(bx), d4 = ac.dot(bx);
  if (d3 >= 0 && d4 <= d3) return at(0, 1, 0);
  const double d5 = ab.dot(cx), d6 = ac.dot(cx);
  if (d6 >= 0 && d5 <= d6) return at(0, 0, 1);
  const double of_c = d1 * d4 - d3 * d2;
  if (of_c <= 0 && d1 >= 0 && d3 <= 0) {
    const double t = share(d1, d1 - d3);
    return at(1 - t, t, 0);
  }
  const double of_b = d5 * d2 - d1 * d6;
  if (of_b <= 0 && d2 >= 0 && d6 <= 0) {
    const double t = share(d2, d2 - d6);
    return at(1 - t, 0, t);
  }
  const double of_a = d3 * d6 - d5 * d4;
  if (of_a <= 0 && d4 >= d3 && d5 >= d6) {
    const double t = share(d4 - d3, (d4 - d3) + (d5 - d6));
    return at(0, 1 - t, t);
  }
  const double sum = of_a + of_b + of_c;
  if (!(sum > 0)) return at(1, 0, 0);
  return at(1 - of_b / sum - of_c / sum, of_b / sum, of_c / sum);
}

Nearest point_segment(const Vec3& x, const Vec3& a, const Vec3& b) {
  const Vec3 ab = b - a;
  const double t = std::clamp(share(ab.dot(x - a), ab.squaredNorm()), 0.0, 1.0);
  Nearest found;
  found.offset = x - (a + t * ab);
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
