#include "sdf/signed_mesh_distance.hpp"

#include <gtest/gtest.h>

#include "tests/sdf/meshes.hpp"
#include "tests/sdf/shapes.hpp"

namespace vstent::sdf {
namespace {

/// A ball whose points are pulled in and out: ridges and dents, so that every kind of feature is
/// nearest somewhere.
TriangleMesh spiky_ball() {
  TriangleMesh mesh = tests::icosphere(1, 2);
  tests::Random random(61);
  for (Vec3& p : mesh.points) p *= 1 + 0.25 * random(-1, 1);
  return mesh;
}

TEST(SignedMeshDistance, HasTheSignOfTheWindingNumber) {
  const TriangleMesh mesh = spiky_ball();
  const SignedMeshDistance signed_distance(mesh);
  const MeshDistance plain(mesh);
  tests::Random random(62);
  int inside = 0;
  for (int n = 0; n < 3000; ++n) {
    const Vec3 x = random.in_cube(1.4);
    const double d = signed_distance.distance(x);
    EXPECT_EQ(std::abs(d), plain.closest(x).distance);
    const double winding = plain.winding_number(x);
    EXPECT_EQ(d<0, winding> 0.5) << x.transpose() << " winding " << winding;
    inside += d < 0;
  }
  EXPECT_GT(inside, 300);
}

TEST(FirstCrossing, IsWhereTheSignChanges) {
  const TriangleMesh mesh = spiky_ball();
  const SignedMeshDistance signed_distance(mesh);
  const BoxTree tree = triangle_tree(mesh);
  tests::Random random(63);
  for (int n = 0; n < 300; ++n) {
    const Vec3 direction = random.in_cube(1).normalized();
    const double s = first_crossing(mesh, tree, Vec3::Zero(), direction, 3);
    ASSERT_TRUE(std::isfinite(s));
    EXPECT_LT(std::abs(signed_distance.distance(s * direction)), 1e-12);
    EXPECT_LT(signed_distance.distance(0.999 * s * direction), 0);
    EXPECT_EQ(first_crossing(mesh, tree, Vec3::Zero(), direction, 0.99 * s),
              std::numeric_limits<double>::infinity());
  }
}

}  // namespace
}  // namespace vstent::sdf
