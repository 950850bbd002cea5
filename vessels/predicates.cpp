#include "vessels/predicates.hpp"

#include <cmath>

namespace vstent::vessels {
namespace {

int sign(double x) { return (x > 0) - (x < 0); }

// A number as the exact sum of doubles that do not overlap, smallest first (Priest, Shewchuk).
// Large enough for a 3 x 3 determinant of differences: 3 * 2 * (2 * 8) * 2 products at most.
struct Expansion {
  std::array<double, 192> terms;
  std::size_t size = 0;

  void add(double value) {
    std::size_t kept = 0;
    double carry = value;
    for (std::size_t i = 0; i < size; ++i) {
      const double sum = carry + terms[i];
      const double of_term = sum - carry;
      const double error = (carry - (sum - of_term)) + (terms[i] - of_term);
      carry = sum;
      if (error != 0) terms[kept++] = error;
    }
    if (carry != 0) terms[kept++] = carry;
    size = kept;
  }
  void add_product(double x, double y) {
    const double product = x * y;
    add(std::fma(x, y, -product));
    add(product);
  }
  int sign_of_sum() const { return size == 0 ? 0 : sign(terms[size - 1]); }
};

Expansion difference(double x, double y) {
  const double rounded = x - y;
  const double of_y = x - rounded;
  const double of_x = rounded + of_y;
  Expansion result;
  result.add((x - of_x) + (of_y - y));
  result.add(rounded);
  return result;
}

// result += factor * x * y
void add_product(Expansion& result, double factor, const Expansion& x, const Expansion& y) {
  for (std::size_t i = 0; i < x.size; ++i) {
    for (std::size_t j = 0; j < y.size; ++j) result.add_product(factor * x.terms[i], y.terms[j]);
  }
}

int orient3d_exact(const Vec3& a, const Vec3& b, const Vec3& c, const Vec3& d) {
  std::array<std::array<Expansion, 3>, 3> m;
  const std::array<const Vec3*, 3> rows = {&b, &c, &d};
  for (std::size_t r = 0; r < 3; ++r) {
    for (std::size_t k = 0; k < 3; ++k) {
      const auto axis = static_cast<Eigen::Index>(k);
      m[r][k] = difference((*rows[r])[axis], a[axis]);
    }
  }
  Expansion determinant;
  for (std::size_t k = 0; k < 3; ++k) {
    Expansion minor;
    add_product(minor, 1.0, m[0][(k + 1) % 3], m[1][(k + 2) % 3]);
    add_product(minor, -1.0, m[0][(k + 2) % 3], m[1][(k + 1) % 3]);
    add_product(determinant, 1.0, minor, m[2][k]);
  }
  return determinant.sign_of_sum();
}

int orient2d_exact(const Vec2& a, const Vec2& b, const Vec2& c) {
  Expansion determinant;
  add_product(determinant, 1.0, difference(b[0], a[0]), difference(c[1], a[1]));
  add_product(determinant, -1.0, difference(b[1], a[1]), difference(c[0], a[0]));
  return determinant.sign_of_sum();
}

// Rounding of the determinants below, relative to the sum of the products' magnitudes: three (two)
// roundings per factor and product and two (one) for the sums, rounded up generously.
constexpr double kBound3d = 16 * 1.1102230246251565e-16;
constexpr double kBound2d = 8 * 1.1102230246251565e-16;

bool within(const Vec2& a, const Vec2& b, const Vec2& x) {
  return std::min(a[0], b[0]) <= x[0] && x[0] <= std::max(a[0], b[0]) &&
         std::min(a[1], b[1]) <= x[1] && x[1] <= std::max(a[1], b[1]);
}

}  // namespace

int orient3d(const Vec3& a, const Vec3& b, const Vec3& c, const Vec3& d) {
  const Vec3 u = b - a, v = c - a, w = d - a;
  const double yz = u.y() * v.z(), zy = u.z() * v.y();
  const double zx = u.z() * v.x(), xz = u.x() * v.z();
  const double xy = u.x() * v.y(), yx = u.y() * v.x();
  const double determinant = (yz - zy) * w.x() + (zx - xz) * w.y() + (xy - yx) * w.z();
  const double magnitude = (std::abs(yz) + std::abs(zy)) * std::abs(w.x()) +
                           (std::abs(zx) + std::abs(xz)) * std::abs(w.y()) +
                           (std::abs(xy) + std::abs(yx)) * std::abs(w.z());
  if (std::abs(determinant) > kBound3d * magnitude) return sign(determinant);
  if (magnitude == 0) return 0;  // differences are zero only when they are exactly zero
  return orient3d_exact(a, b, c, d);
}

int orient2d(const Vec2& a, const Vec2& b, const Vec2& c) {
  const double left = (b[0] - a[0]) * (c[1] - a[1]);
  const double right = (b[1] - a[1]) * (c[0] - a[0]);
  const double magnitude = std::abs(left) + std::abs(right);
  if (std::abs(left - right) > kBound2d * magnitude) return sign(left - right);
  if (magnitude == 0) return 0;
  return orient2d_exact(a, b, c);
}

bool collinear(const Vec3& a, const Vec3& b, const Vec3& c) {
  for (int k = 0; k < 3; ++k) {
    const int x = (k + 1) % 3, y = (k + 2) % 3;
    if (orient2d({a[x], a[y]}, {b[x], b[y]}, {c[x], c[y]}) != 0) return false;
  }
  return true;
}

bool segments_meet(const Vec2& a, const Vec2& b, const Vec2& c, const Vec2& d) {
  const int c_side = orient2d(a, b, c), d_side = orient2d(a, b, d);
  const int a_side = orient2d(c, d, a), b_side = orient2d(c, d, b);
  if (c_side * d_side < 0 && a_side * b_side < 0) return true;
  return (c_side == 0 && within(a, b, c)) || (d_side == 0 && within(a, b, d)) ||
         (a_side == 0 && within(c, d, a)) || (b_side == 0 && within(c, d, b));
}

}  // namespace vstent::vessels
