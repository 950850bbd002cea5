#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include "sdf/level_set.hpp"
#include "sdf/mesh_distance.hpp"
#include "tests/sdf/meshes.hpp"
#include "tests/sdf/shapes.hpp"

namespace vstent::sdf {
namespace {

TEST(VoxelisedMesh, NodesAreTheSignedDistanceToTheTriangles) {
  const TriangleMesh ball = tests::icosphere(2, 3, {0.1, 0.2, 0.3});
  const MeshDistance distance(ball);
  const double h = 0.15;
  for (const double interior_width : {0.0, 1.2, 5.0}) {
    const LevelSet level_set = voxelise(ball, {.voxel_size = h, .half_width = 3}, interior_width);
    const double inside_band = std::max(interior_width, 3 * h);
    double worst = 0;
    for (int i = -20; i <= 20; ++i) {
      for (int j = -20; j <= 20; ++j) {
        for (int k = -20; k <= 20; ++k) {
          const Vec3 x(i * h, j * h, k * h);
          const double d = distance.closest(x).distance;
          const double from_centre = (x - Vec3(0.1, 0.2, 0.3)).norm();
          const bool is_inside = d < 0.1 ? distance.winding_number(x) > 0.5 : from_centre < 2;
          const double sign = is_inside ? -1.0 : 1.0;
          const double value = level_set.node_value({i, j, k});
          if (d < 1e-3) {  // inside or outside is a matter of rounding
            worst = std::max(worst, std::abs(std::abs(value) - d));
          } else if (sign > 0 ? d < 2.9 * h : d < inside_band - 0.1 * h) {
            worst = std::max(worst, std::abs(value - sign * d));
          } else if (sign < 0) {
            ASSERT_LT(value, -0.9 * std::min(d, inside_band));
          } else {
            ASSERT_GT(value, 2.5 * h);
          }
        }
      }
    }
    EXPECT_LT(worst, 1e-6) << "interior width " << interior_width;
  }
}

TEST(VoxelisedMesh, IsTheSameForAnyNumberOfThreads) {
  const TriangleMesh ball = tests::icosphere(2, 3, {0.1, 0.2, 0.3});
  const auto nodes_with = [&](std::size_t threads) {
    const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads);
    std::vector<std::pair<std::array<double, 3>, double>> nodes;
    voxelise(ball, {.voxel_size = 0.1}, 1).for_each_active([&](const Vec3& x, double value) {
      nodes.push_back({{x.x(), x.y(), x.z()}, value});
    });
    return nodes;
  };
  const auto one = nodes_with(1);
  for (int repeat = 0; repeat < 2; ++repeat) EXPECT_EQ(one, nodes_with(2));
}

TEST(VoxelisedMesh, SamplesDeepInside) {
  const double radius = 2, h = 0.1;
  const TriangleMesh ball = tests::icosphere(radius, 5);
  const LevelSet level_set = voxelise(ball, {.voxel_size = h}, 5);
  tests::Random random(61);
  for (int n = 0; n < 2000; ++n) {
    const Vec3 direction = random.direction();
    const double rho = random(0.5, 2.04);
    const Sample sample = level_set.sample(rho * direction);
    // Trilinear error 2.1 h^2/(8 rho), and facets within 0.002 mm of the sphere (edge 0.07:
    // e^2/(8R) * 4/3 < 5e-4).
    EXPECT_NEAR(sample.distance, rho - radius, 2.1 * h * h / (8 * (rho - 0.3)) + 0.002);
    EXPECT_GT(sample.gradient.dot(direction), 0.99);
  }
}

TEST(VoxelisedMesh, RefusesWhatItCannotConvert) {
  TriangleMesh ball = tests::icosphere(2, 2);
  EXPECT_THROW(voxelise(TriangleMesh{}, {.voxel_size = 0.1}), std::invalid_argument);
  EXPECT_THROW(voxelise(ball, {.voxel_size = 0}), std::invalid_argument);
  EXPECT_THROW(voxelise(ball, {.voxel_size = 1e-4}), std::length_error);
  EXPECT_THROW(voxelise(ball, {.voxel_size = 1e-9}), std::length_error);
  ball.triangles[3][1] = 9999;
  EXPECT_THROW(voxelise(ball, {.voxel_size = 0.1}), std::invalid_argument);
  ball.triangles[3][1] = 0;
  ball.points[0].x() = std::nan("");
  EXPECT_THROW(voxelise(ball, {.voxel_size = 0.1}), std::invalid_argument);
}

}  // namespace
}  // namespace vstent::sdf
