#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <stdexcept>

#include "stents/straight_surface.hpp"
#include "tests/stents/pipes.hpp"

namespace vstent::stents {
namespace {

TriangleMesh moved(TriangleMesh mesh, const Eigen::AngleAxisd& turn, const Vec3& by) {
  for (Vec3& p : mesh.points) p = turn * p + by;
  return mesh;
}

std::string refusal(const TriangleMesh& mesh) {
  try {
    on_its_axis(mesh);
  } catch (const std::invalid_argument& no_stent) {
    return no_stent.what();
  }
  return "";
}

/// A wire of square section wound about the z axis: no symmetry but the cylinder's.
TriangleMesh coil(double radius, double thickness, double length, double turns) {
  TriangleMesh mesh;
  const int steps = static_cast<int>(turns * 60);
  for (int i = 0; i <= steps; ++i) {
    const double share = static_cast<double>(i) / steps;
    const double angle = 2 * std::numbers::pi * turns * share;
    const Vec3 out(std::cos(angle), std::sin(angle), 0);
    for (const auto& [r, z] : {std::pair(0.0, 0.0), {-1.0, 0.0}, {-1.0, 1.0}, {0.0, 1.0}})
      mesh.points.push_back((radius + r * thickness) * out +
                            (share * length + z * thickness) * Vec3::UnitZ());
  }
  for (int i = 0; i < steps; ++i) {
    for (int k = 0; k < 4; ++k) {
      const int a = 4 * i + k, b = 4 * i + (k + 1) % 4;
      mesh.triangles.push_back({a, a + 4, b});
      mesh.triangles.push_back({b, a + 4, b + 4});
    }
  }
  const int last = 4 * steps;
  mesh.triangles.push_back({0, 1, 2});
  mesh.triangles.push_back({0, 2, 3});
  mesh.triangles.push_back({last, last + 2, last + 1});
  mesh.triangles.push_back({last, last + 3, last + 2});
  return mesh;
}

TEST(StraightSurface, FindsTheAxisOfATubeHoweverItLies) {
  // Shorter than, as long as and longer than where all three moments are about equal (2.4 R).
  for (const double length : {0.8, 2.0, 9.0}) {
    const TriangleMesh mesh = tests::pipe({.length = length});
    const Eigen::AngleAxisd turn(0.7, Vec3(1, 2, -0.5).normalized());
    const StraightSurface s = on_its_axis(moved(mesh, turn, Vec3(10, -3, 40)));
    EXPECT_NEAR(s.outer_radius, 1.5, 1e-9);
    EXPECT_NEAR(s.length, length, 1e-9);
    // Between vertices the inner facets' chords come nearer to the axis.
    EXPECT_NEAR(s.inner_radius, 1.4 * std::cos(std::numbers::pi / 48), 1e-9);
    const double wedge = 48 * 0.5 * std::sin(2 * std::numbers::pi / 48);
    EXPECT_NEAR(s.volume, wedge * (1.5 * 1.5 - 1.4 * 1.4) * length, 1e-9);
    double lowest = 1;
    for (const Vec3& p : s.mesh.points) lowest = std::min(lowest, p.z());
    EXPECT_NEAR(lowest, 0, 1e-12);
  }
}

TEST(StraightSurface, LeavesASurfaceThatLiesAlongZAsItIs) {
  const TriangleMesh mesh = tests::pipe({});
  const StraightSurface s =
      on_its_axis(moved(mesh, Eigen::AngleAxisd(0, Vec3::UnitX()), {1, 2, 3}));
  for (std::size_t i = 0; i < mesh.points.size(); ++i)
    EXPECT_LT((s.mesh.points[i] - mesh.points[i]).norm(), 1e-9);
}

TEST(StraightSurface, ACoilsAxisIsThatOfItsCylinderNotThatOfItsMoments) {
  const TriangleMesh wire = coil(1.5, 0.1, 9, 7.3);
  const StraightSurface s =
      on_its_axis(moved(wire, Eigen::AngleAxisd(0.4, Vec3::UnitY()), Vec3(1, 2, 3)));
  // Chords of 6 degrees sag by 1.5 (1 - cos 3 deg) = 0.002 mm everywhere alike; only at the ends
  // does the outer side stop somewhere around.
  EXPECT_NEAR(s.outer_radius, 1.5, 0.002);
}

TEST(StraightSurface, LongFacetsCountAlongTheirLength) {
  const Eigen::AngleAxisd turn(0.7, Vec3(1, 2, -0.5).normalized());
  const StraightSurface s = on_its_axis(moved(tests::pipe({.along = 1}), turn, Vec3(10, -3, 40)));
  EXPECT_NEAR(s.outer_radius, 1.5, 1e-9);
  EXPECT_NEAR(s.length, 9, 1e-9);
}

TEST(StraightSurface, KnowsItsWaistsAndFlares) {
  const auto wider = [](double z) { return 0.04 * (z - 4.5) * (z - 4.5); };  // 0.81 at the ends
  const StraightSurface s = on_its_axis(tests::pipe({.along = 200, .wider = wider}));
  EXPECT_NEAR(s.outer_radius, 1.5 + 0.81, 1e-9);
  // A slice has its widest radius, which lies within half its height of its middle, the slope at
  // most 0.36; at the ends there is no middle beyond.
  const double height = 0.1 * s.outer_radius;
  for (double z = 0; z <= 9; z += 0.05)
    EXPECT_NEAR(outer_radius_at(s, z), 1.5 + wider(z), 0.36 * height) << z;
  const StraightSurface back = turned_around(s);
  EXPECT_EQ(outer_radius_at(back, 1), outer_radius_at(s, 8));

  // Two rings 5 mm apart: what lies between them is as wide as they are.
  TriangleMesh rings = tests::pipe({.length = 2});
  const TriangleMesh second = tests::pipe({.outer = 1.6, .inner = 1.5, .length = 2});
  const int count = static_cast<int>(rings.points.size());
  for (const Vec3& p : second.points) rings.points.push_back(p + 7 * Vec3::UnitZ());
  for (const Triangle& t : second.triangles)
    rings.triangles.push_back({t[0] + count, t[1] + count, t[2] + count});
  const StraightSurface two = on_its_axis(rings, Vec3(0, 0, 1));
  EXPECT_NEAR(outer_radius_at(two, 1), 1.5, 1e-9);
  EXPECT_NEAR(outer_radius_at(two, 4.5), 1.55, 1e-9);
  EXPECT_NEAR(outer_radius_at(two, 8), 1.6, 1e-9);
}

TEST(StraightSurface, TurningItAroundTwiceGivesItBack) {
  const StraightSurface s = on_its_axis(tests::pipe({.wider = [](double z) { return 0.1 * z; }}));
  const StraightSurface once = turned_around(s), twice = turned_around(once);
  double widest_at = 0, widest = 0;
  for (const Vec3& p : once.mesh.points) {
    if (std::hypot(p.x(), p.y()) > widest) widest = std::hypot(p.x(), p.y()), widest_at = p.z();
  }
  EXPECT_NEAR(widest_at, 0, 1e-9);
  for (std::size_t i = 0; i < s.mesh.points.size(); ++i)
    EXPECT_LT((twice.mesh.points[i] - s.mesh.points[i]).norm(), 1e-12);
}

TEST(StraightSurface, RefusesWhatIsNoStraightHollowTube) {
  // A plate has three different moments; a tube with a flat section, too.
  TriangleMesh flat = tests::pipe({});
  for (Vec3& p : flat.points) p.x() *= 1.3;
  EXPECT_NE(refusal(flat).find("second moments"), std::string::npos);
  // R^2 / 2 = L^2 / 12 makes any direction an axis.
  EXPECT_NE(
      refusal(tests::pipe({.inner = 1.499, .length = 1.5 * std::sqrt(6.0)})).find("second moments"),
      std::string::npos);
  EXPECT_NO_THROW(
      on_its_axis(tests::pipe({.inner = 1.499, .length = 1.5 * std::sqrt(6.0)}), Vec3(0, 0, 1)));
  EXPECT_NE(refusal(tests::pipe({.inner = 0.1})).find("within 0.09"), std::string::npos);
  TriangleMesh bent = tests::pipe({});
  for (Vec3& p : bent.points) p.x() += 0.3 * std::pow((p.z() - 4.5) / 4.5, 2);
  EXPECT_NE(refusal(bent).find("not straight: its axis sags by 0.29"), std::string::npos)
      << refusal(bent);
}

}  // namespace
}  // namespace vstent::stents
