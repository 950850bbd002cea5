#include "sdf/mesh_distance.hpp"

#include <gtest/gtest.h>

#include "tests/sdf/meshes.hpp"
#include "tests/sdf/shapes.hpp"

namespace vstent::sdf {
namespace {

TEST(ClosestPointOnTriangle, IsNoFartherThanAnyOfItsPointsAndOneOfThem) {
  tests::Random random(51);
  for (int n = 0; n < 2000; ++n) {
    const Vec3 a = random.in_cube(1), c = random.in_cube(1);
    const Vec3 b = n % 10 == 0 ? Vec3(a + 0.5 * (c - a))
                               : random.in_cube(1);  // every tenth is a needle without area
    const Vec3 x = random.in_cube(2);
    const Vec3 closest = closest_point_on_triangle(x, a, b, c);
    const double distance = (x - closest).norm();
    for (int m = 0; m < 50; ++m) {
      double u = random(0, 1), v = random(0, 1);
      if (u + v > 1) u = 1 - u, v = 1 - v;
      EXPECT_LE(distance, (x - (a + u * (b - a) + v * (c - a))).norm() + 1e-12);
    }
    // On the triangle: its own closest point, and on its plane.
    EXPECT_LT((closest_point_on_triangle(closest, a, b, c) - closest).norm(), 1e-9);
    const Vec3 normal = (b - a).cross(c - a);
    if (normal.norm() > 1e-9) {
      EXPECT_LT(std::abs((closest - a).dot(normal.normalized())), 1e-9);
    }
  }
}

TEST(ClosestPointOnTriangle, KnowsCornersEdgesAndFace) {
  const Vec3 a(0, 0, 0), b(2, 0, 0), c(0, 2, 0);
  EXPECT_EQ(closest_point_on_triangle({-1, -1, 1}, a, b, c), a);
  EXPECT_EQ(closest_point_on_triangle({5, -1, 1}, a, b, c), b);
  EXPECT_EQ(closest_point_on_triangle({-1, 5, 1}, a, b, c), c);
  EXPECT_LT((closest_point_on_triangle({1, -3, 2}, a, b, c) - Vec3(1, 0, 0)).norm(), 1e-15);
  EXPECT_LT((closest_point_on_triangle({2, 2, 2}, a, b, c) - Vec3(1, 1, 0)).norm(), 1e-15);
  EXPECT_LT((closest_point_on_triangle({0.5, 0.5, -3}, a, b, c) - Vec3(0.5, 0.5, 0)).norm(), 1e-15);
}

TEST(MeshDistance, EqualsTryingEveryTriangle) {
  const TriangleMesh ball = tests::icosphere(2, 3);
  const MeshDistance distance(ball);
  tests::Random random(52);
  for (int n = 0; n < 500; ++n) {
    const Vec3 x = random.in_cube(4);
    double least = std::numeric_limits<double>::infinity();
    for (const auto& [i, j, k] : ball.triangles) {
      const auto at = [&](int p) { return ball.points[static_cast<std::size_t>(p)]; };
      least = std::min(least, (x - closest_point_on_triangle(x, at(i), at(j), at(k))).norm());
    }
    const auto closest = distance.closest(x);
    EXPECT_EQ(closest.distance, least);
    EXPECT_NEAR((x - closest.point).norm(), least, 1e-15);
    EXPECT_EQ(distance.closest(x, 0.999 * least).triangle, -1);
    EXPECT_EQ(distance.closest(x, 1.001 * least).triangle, closest.triangle);
  }
}

TEST(MeshDistance, WindingNumberCountsInsideAndOutside) {
  const TriangleMesh ball = tests::icosphere(2, 3);
  const MeshDistance distance(ball);
  tests::Random random(53);
  for (int n = 0; n < 500; ++n) {
    const Vec3 direction = random.direction();
    EXPECT_NEAR(distance.winding_number(random(0, 1.9) * direction), 1, 1e-12);
    EXPECT_NEAR(distance.winding_number(random(2.01, 9) * direction), 0, 1e-12);
  }
}

TEST(MeshDistance, WindingNumberOfAHalfOpenBallIsGraded) {
  // A hemisphere seen from its centre covers half of all directions.
  TriangleMesh half = tests::icosphere(2, 4);
  std::erase_if(half.triangles, [&](const Triangle& t) {
    double z = 0;
    for (const int p : t) z += half.points[static_cast<std::size_t>(p)].z();
    return z < 0;
  });
  EXPECT_NEAR(MeshDistance(half).winding_number(Vec3::Zero()), 0.5,
              0.02);  // a ragged rim, one triangle wide
}

}  // namespace
}  // namespace vstent::sdf
