// Volume and area of meshed level sets of struts against closed forms, at voxels as coarse as a
// stent's.
#include <gtest/gtest.h>

#include <numbers>

#include "sdf/level_set.hpp"
#include "tests/sdf/shapes.hpp"

namespace vstent::sdf {
namespace {

constexpr double kPi = std::numbers::pi;

struct Measures {
  double volume = 0, area = 0;  // mm^3, mm^2
};

Measures measures_of(const TriangleMesh& mesh) {
  Measures sum;
  for (const auto& [i, j, k] : mesh.triangles) {
    const Vec3& a = mesh.points[static_cast<std::size_t>(i)];
    const Vec3& b = mesh.points[static_cast<std::size_t>(j)];
    const Vec3& c = mesh.points[static_cast<std::size_t>(k)];
    sum.volume += a.dot(b.cross(c)) / 6;
    sum.area += (b - a).cross(c - a).norm() / 2;
  }
  return sum;
}

Measures capsule_measures(double length, double r) {
  return {kPi * r * r * length + 4.0 / 3.0 * kPi * r * r * r,
          2 * kPi * r * length + 4 * kPi * r * r};
}

/// Steiner's formula for a stadium prism, volume V, area S and mean curvature integral M, swept by
/// a ball: V + S r + M r^2 + 4/3 pi r^3, and its derivative. M of a convex prism: pi times its
/// height (over the sides) plus half the perimeter of each base times pi / 2.
Measures strut_measures(const Strut& strut) {
  const double r = strut.edge_radius, length = (strut.b - strut.a).norm();
  const double w = strut.width / 2 - r, height = strut.thickness - 2 * r;
  const double base = 2 * w * length + kPi * w * w, perimeter = 2 * length + 2 * kPi * w;
  const double volume = base * height, area = 2 * base + perimeter * height;
  const double mean_curvature = kPi * height + kPi / 2 * perimeter;
  return {volume + area * r + mean_curvature * r * r + 4.0 / 3.0 * kPi * r * r * r,
          area + 2 * mean_curvature * r + 4 * kPi * r * r};
}

/// Largest relative errors over several places in the lattice, so that no lucky one decides.
Measures errors(const Solid& solid, const Measures& exact, double h) {
  tests::Random random(61);
  Measures worst;
  for (int n = 0; n < 3; ++n) {
    const Vec3 shift = random.in_cube(1);
    Solid moved = solid;
    for (Segment& s : moved.segments) s.a += shift, s.b += shift;
    for (Strut& s : moved.struts) s.a += shift, s.b += shift;
    const Measures found = measures_of(voxelise(moved, {.voxel_size = h}).surface());
    worst.volume = std::max(worst.volume, std::abs(found.volume / exact.volume - 1));
    worst.area = std::max(worst.area, std::abs(found.area / exact.area - 1));
  }
  return worst;
}

/// Within 2 % at three voxels per radius (per half thickness for struts), and within half and a
/// quarter of that when the voxel is halved twice: at least first order. An edge sharper than a
/// voxel is cut off up to half a voxel from it, which takes (2 - sqrt 2) h / 2 of area per length
/// of edge: `sharp_edges` in mm.
void expect_converging(const Solid& solid, const Measures& exact, double half_thickness,
                       double sharp_edges = 0) {
  double share = 1;
  for (const double voxels : {3.0, 6.0, 12.0}) {
    const double h = half_thickness / voxels;
    const Measures error = errors(solid, exact, h);
    EXPECT_LT(error.volume, 0.02 * share) << h;
    const double cut = sharp_edges * (2 - std::numbers::sqrt2) * h / 2;
    EXPECT_LT(error.area, 0.02 * share + cut / exact.area) << h;
    share /= 2;
  }
}

const Vec3 kAlong = Vec3(3, 1, 2).normalized();

TEST(MeshedVolume, OfACapsule) {
  const double r = 0.045, length = 0.9;
  const Solid solid = tests::solid_of(
      Segment{.a = Vec3::Zero(), .b = length * kAlong, .radius_a = r, .radius_b = r});
  expect_converging(solid, capsule_measures(length, r), r);
}

class MeshedStrut : public testing::TestWithParam<double> {};
INSTANTIATE_TEST_SUITE_P(EdgeRadius, MeshedStrut, testing::Values(0.0, 0.01, 0.04));

TEST_P(MeshedStrut, HasTheVolumeAndAreaOfSteinersFormula) {
  const Strut strut{.a = Vec3::Zero(),
                    .b = 0.9 * kAlong,
                    .normal = kAlong.unitOrthogonal(),
                    .width = 0.12,
                    .thickness = 0.08,
                    .edge_radius = GetParam()};
  const double rim = 2 * 0.9 + kPi * strut.width;  // of each flat side
  expect_converging(tests::solid_of(strut), strut_measures(strut), strut.thickness / 2,
                    strut.edge_radius > 0 ? 0 : 2 * rim);
}

/// A closed zig-zag ring of capsules.
Solid ring(double stent_radius, int crowns, double height, double radius) {
  Solid solid;
  const auto crown = [&](int i) {
    const double angle = kPi * i / crowns;
    return Vec3(stent_radius * std::cos(angle), stent_radius * std::sin(angle),
                i % 2 == 0 ? 0 : height);
  };
  for (int i = 0; i < 2 * crowns; ++i) {
    solid.segments.push_back({.a = crown(i),
                              .b = crown((i + 1) % (2 * crowns)),
                              .radius_a = radius,
                              .radius_b = radius});
  }
  return solid;
}

/// Two capsules that meet at an end with an angle between them share the ball and, on the inner
/// side of the bend, a wedge: mirrored in the bisecting plane, each loses the part of its cylinder
/// beyond that plane. A cylinder cut by a plane through its axis point, tilted by half the angle:
/// the part cut off has volume 2/3 r^3 cot(half) and side area 2 r^2 cot(half); the ball's part
/// that stays outside both is the lune of angle pi - angle.
Measures ring_measures(const Solid& solid, double r) {
  Measures sum;
  for (std::size_t i = 0; i < solid.segments.size(); ++i) {
    const Segment& s = solid.segments[i];
    const Segment& next = solid.segments[(i + 1) % solid.segments.size()];
    const Vec3 back = (s.a - s.b).normalized(), ahead = (next.b - next.a).normalized();
    const double angle = std::atan2(back.cross(ahead).norm(), back.dot(ahead));
    const double cot = 1 / std::tan(angle / 2), length = (s.b - s.a).norm();
    const double lune = (kPi - angle) / (2 * kPi);
    sum.volume +=
        kPi * r * r * length - 2 * 2.0 / 3.0 * r * r * r * cot + lune * 4.0 / 3.0 * kPi * r * r * r;
    sum.area += 2 * kPi * r * length - 2 * 2 * r * r * cot + lune * 4 * kPi * r * r;
  }
  return sum;
}

TEST(MeshedVolume, OfAZigZagRing) {
  const double r = 0.045;
  const Solid solid = ring(0.5, 4, 0.6, r);
  expect_converging(solid, ring_measures(solid, r), r);
}

}  // namespace
}  // namespace vstent::sdf
