#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "tests/vessels/shapes.hpp"
#include "vessels/sections.hpp"

namespace vstent::vessels {
namespace {

using tests::tube;

constexpr int kAround = 180;
constexpr double kRadius = 3;
constexpr double kTurn = std::numbers::pi / kAround;  // half a side of the regular polygon, seen
                                                      // from its centre
const double kPolygonArea = kAround * kRadius * kRadius * std::sin(kTurn) * std::cos(kTurn);
const double kPolygonPerimeter = 2 * kAround * kRadius * std::sin(kTurn);

TriangleMesh placed(TriangleMesh mesh, const Vec3& shift) {
  for (Vec3& x : mesh.points) x += shift;
  return mesh;
}

TriangleMesh joined(TriangleMesh mesh, const TriangleMesh& other) {
  const int offset = static_cast<int>(mesh.points.size());
  mesh.points.insert(mesh.points.end(), other.points.begin(), other.points.end());
  for (const Triangle& t : other.triangles) {
    mesh.triangles.push_back({t[0] + offset, t[1] + offset, t[2] + offset});
  }
  return mesh;
}

TEST(Section, OfACircularTubeIsItsPolygon) {
  const Sectioner sectioner(tube(kRadius, 20, kAround, 21));
  const Vec3 off_centre(0.4, -0.3, 9.7);
  const auto section = sectioner.cut(off_centre, Vec3(0, 0, 2), 10);
  ASSERT_TRUE(section);
  EXPECT_NEAR(section->area, kPolygonArea, 1e-9);
  EXPECT_NEAR(section->perimeter, kPolygonPerimeter, 1e-9);
  EXPECT_NEAR((section->centroid - Vec3(0, 0, 9.7)).norm(), 0, 1e-9);
  EXPECT_NEAR(section->equivalent_diameter, std::sqrt(4 * kPolygonArea / std::numbers::pi), 1e-9);
  // Chords of a regular polygon lie between its inscribed and its circumscribed circle.
  EXPECT_GE(section->min_diameter, 2 * kRadius * std::cos(kTurn) - 1e-9);
  EXPECT_LE(section->max_diameter, 2 * kRadius + 1e-9);
  for (const Vec3& x : section->outline) EXPECT_NEAR(x.z(), 9.7, 1e-12);
}

TEST(Section, CutObliquelyIsAnEllipse) {
  const Sectioner sectioner(tube(kRadius, 40, kAround, 41));
  for (const double tilt : {0.3, 0.8}) {
    const auto section = sectioner.cut(Vec3(0, 0, 20), Vec3(std::sin(tilt), 0, std::cos(tilt)), 20);
    ASSERT_TRUE(section);
    EXPECT_NEAR(section->area, kPolygonArea / std::cos(tilt), 1e-9);  // its shadow is the polygon
    EXPECT_NEAR((section->centroid - Vec3(0, 0, 20)).norm(), 0, 1e-9);
    // The long chord is found to 1 degree: r(delta) = a (1 - ((a/b)^2 - 1) delta^2 / 2).
    const double slender = 1 / (std::cos(tilt) * std::cos(tilt)) - 1;
    const double degree = std::numbers::pi / 180;
    const double longest = 2 * kRadius / std::cos(tilt);
    EXPECT_NEAR(section->max_diameter, longest,
                longest * (0.5 * slender * degree * degree + 0.5 * kTurn * kTurn));
    EXPECT_NEAR(section->min_diameter, 2 * kRadius,
                2 * kRadius * (0.5 * slender * degree * degree + 0.5 * kTurn * kTurn));
  }
}

TEST(Section, OfAnEllipticalTubeHasItsTwoDiameters) {
  TriangleMesh mesh = tube(kRadius, 20, kAround, 21);
  for (Vec3& x : mesh.points) x.x() *= 2;
  const auto section = Sectioner(mesh).cut(Vec3(1, 0.5, 10), Vec3::UnitZ(), 15);
  ASSERT_TRUE(section);
  EXPECT_NEAR(section->area, 2 * kPolygonArea, 1e-9);
  EXPECT_NEAR((section->centroid - Vec3(0, 0, 10)).norm(), 0, 1e-9);
  const double degree = std::numbers::pi / 180;  // and ((a/b)^2 - 1) / 2 = 1.5, as above
  const double tolerance = 1.5 * degree * degree + 0.5 * kTurn * kTurn;
  EXPECT_NEAR(section->max_diameter, 4 * kRadius, 4 * kRadius * tolerance);
  EXPECT_NEAR(section->min_diameter, 2 * kRadius, 2 * kRadius * tolerance);
}

TEST(Section, IsOfTheVesselAskedForWhereSeveralAreCut) {
  const Vec3 beside(2 * kRadius + 0.1, 0, 0);
  const TriangleMesh one = tube(kRadius, 20, kAround, 21);
  const Sectioner two(joined(one, placed(one, beside)));
  for (const Vec3& axis : {Vec3(0, 0, 0), beside}) {
    const auto section = two.cut(axis + Vec3(0.5, 0.5, 10.2), Vec3::UnitZ(), 5 * kRadius);
    ASSERT_TRUE(section);
    EXPECT_NEAR((section->centroid - axis - Vec3(0, 0, 10.2)).norm(), 0, 1e-9);
    EXPECT_NEAR(section->area, kPolygonArea, 1e-9);
  }
  // One vessel inside another's outline: the inner one.
  const auto inner = Sectioner(joined(tube(3 * kRadius, 20, kAround, 21), one))
                         .cut(Vec3(0, 0, 10.2), Vec3::UnitZ(), 5 * kRadius);
  ASSERT_TRUE(inner);
  EXPECT_NEAR(inner->area, kPolygonArea, 1e-9);
}

TEST(Section, OfAForkedVesselIsOneOutlineBelowTheForkAndOnePerLegAbove) {
  // The legs of a pair of trousers: a tube whose upper rings are squeezed into two lobes never
  // closes there, so the legs are tubes of their own, standing on the trunk's rim.
  const double leg = 0.45 * kRadius;
  TriangleMesh mesh = tube(kRadius, 10, kAround, 11);
  for (const double side : {-0.5, 0.5}) {
    mesh = joined(mesh, placed(tube(leg, 10, kAround, 11), Vec3(side * kRadius, 0, 10)));
  }
  const Sectioner sectioner(mesh);
  const auto trunk = sectioner.cut(Vec3(0, 0, 5.1), Vec3::UnitZ(), 3 * kRadius);
  const auto left = sectioner.cut(Vec3(-0.5 * kRadius, 0, 15.1), Vec3::UnitZ(), 3 * kRadius);
  const auto right = sectioner.cut(Vec3(0.5 * kRadius, 0, 15.1), Vec3::UnitZ(), 3 * kRadius);
  ASSERT_TRUE(trunk && left && right);
  EXPECT_NEAR(trunk->area, kPolygonArea, 1e-9);
  EXPECT_NEAR(left->area, 0.45 * 0.45 * kPolygonArea, 1e-9);
  EXPECT_NEAR((left->centroid - Vec3(-0.5 * kRadius, 0, 15.1)).norm(), 0, 1e-9);
  EXPECT_NEAR((right->centroid - Vec3(0.5 * kRadius, 0, 15.1)).norm(), 0, 1e-9);
  EXPECT_FALSE(sectioner.cut(Vec3(0, 0, 15.1), Vec3::UnitZ(), 3 * kRadius)) << "between the legs";
}

TEST(Section, IsNothingWhereTheCutStaysOpenOrMissesTheLumen) {
  const Sectioner sectioner(tube(kRadius, 20, kAround, 21));
  EXPECT_FALSE(sectioner.cut(Vec3(0, 0, 20.5), Vec3::UnitZ(), 10)) << "beyond the end";
  EXPECT_FALSE(sectioner.cut(Vec3(0, 0, 19), Vec3(1, 0, 1), 10)) << "through the rim";
  EXPECT_FALSE(sectioner.cut(Vec3(0, 0, 10), Vec3::UnitX(), 30)) << "along the axis";
  EXPECT_FALSE(sectioner.cut(Vec3(1.01 * kRadius, 0, 10), Vec3::UnitZ(), 10)) << "outside";
  EXPECT_FALSE(sectioner.cut(Vec3(0, 0, 10.2), Vec3::UnitZ(), 0.5 * kRadius)) << "out of reach";
}

TEST(Section, PassesThroughMeshVerticesExactly) {
  const Sectioner sectioner(tube(kRadius, 20, kAround, 21));
  const auto section = sectioner.cut(Vec3(0, 0, 10), Vec3::UnitZ(), 10);  // a ring of vertices
  ASSERT_TRUE(section);
  EXPECT_NEAR(section->area, kPolygonArea, 1e-9);
  EXPECT_NEAR(section->perimeter, kPolygonPerimeter, 1e-9);
}

}  // namespace
}  // namespace vstent::vessels
