// Sampled values and gradients against closed forms, and their order of convergence.
#include <gtest/gtest.h>

#include "sdf/level_set.hpp"
#include "tests/sdf/shapes.hpp"

namespace vstent::sdf {
namespace {

constexpr int kPoints = 100000;
constexpr double kLargestOffset = 0.5;  // voxels from the surface

struct Errors {
  double value = 0;     // mm
  double gradient = 0;  // rad
};

/// Largest errors at random places of a surface. point(random, offset) gives a place `offset` mm
/// from the surface and its exact outward normal.
template <class PointAt>
Errors largest_errors(const Solid& solid, double h, PointAt&& point_at) {
  const LevelSet level_set = voxelise(solid, {.voxel_size = h, .half_width = 4});
  tests::Random random(31);
  std::vector<Vec3> points, normals;
  std::vector<double> distances;
  for (int n = 0; n < kPoints; ++n) {
    const double offset = random(-kLargestOffset, kLargestOffset) * h;
    const auto [x, normal] = point_at(random, offset);
    points.push_back(x), normals.push_back(normal), distances.push_back(offset);
  }
  std::vector<Sample> samples(points.size());
  level_set.sample(points, samples);
  Errors errors;
  for (std::size_t i = 0; i < points.size(); ++i) {
    errors.value = std::max(errors.value, std::abs(samples[i].distance - distances[i]));
    const double angle = std::atan2(samples[i].gradient.cross(normals[i]).norm(),
                                    samples[i].gradient.dot(normals[i]));
    errors.gradient = std::max(errors.gradient, angle);
  }
  return errors;
}

double order(double coarse, double fine) { return std::log2(coarse / fine); }

constexpr std::array<double, 3> kVoxelSizes{0.2, 0.1, 0.05};

struct Bounds {
  double value_factor;     // times h^2/(8 R)
  double gradient_factor;  // times (h/R)^2
  double kink = 0;         // rad
};

template <class PointAt>
void expect_second_order(const Solid& solid, double radius, const Bounds& bounds,
                         PointAt&& point_at) {
  std::vector<Errors> errors;
  for (const double h : kVoxelSizes) {
    errors.push_back(largest_errors(solid, h, point_at));
    const double rho = radius - kLargestOffset * h;  // the tightest curvature among the points
    EXPECT_LE(errors.back().value, bounds.value_factor * h * h / (8 * rho)) << "h = " << h;
    EXPECT_LE(errors.back().gradient, bounds.gradient_factor * h * h / (rho * rho) + bounds.kink)
        << "h = " << h;
  }
  for (std::size_t i = 1; i < errors.size(); ++i) {
    EXPECT_GE(order(errors[i - 1].value, errors[i].value), 1.9);
    EXPECT_GE(order(errors[i - 1].gradient, errors[i].gradient), 1.9);
  }
}

class CapsuleDirections : public testing::TestWithParam<Vec3> {};
INSTANTIATE_TEST_SUITE_P(Along, CapsuleDirections,
                         testing::Values(Vec3(0, 0, 1), Vec3(1, 0, 0), Vec3(1, 1, 0), Vec3(1, 1, 1),
                                         Vec3(3, -1, 2)));

TEST_P(CapsuleDirections, SideIsSampledToSecondOrder) {
  const double radius = 2;
  const Vec3 along = GetParam().normalized();
  const Vec3 across = along.unitOrthogonal();
  const Solid solid = tests::solid_of(
      Segment{.a = -3 * along, .b = 3 * along, .radius_a = radius, .radius_b = radius});
  // The side ends a stencil, 2 voxels, before the seams at +-3.
  expect_second_order(solid, radius, {1.1, 0.25}, [&](tests::Random& random, double offset) {
    const Vec3 normal = Eigen::AngleAxisd(random(0, 2 * std::numbers::pi), along) * across;
    return std::pair(Vec3(random(-2.2, 2.2) * along + (radius + offset) * normal), normal);
  });
}

TEST(Accuracy, BallIsSampledToSecondOrder) {
  // Two equal curvatures: twice the cylinder's value error.
  const double radius = 2;
  const Vec3 centre(0.03, -0.02, 0.01);
  const Solid solid =
      tests::solid_of(Segment{.a = centre, .b = centre, .radius_a = radius, .radius_b = radius});
  expect_second_order(solid, radius, {2.2, 0.25}, [&](tests::Random& random, double offset) {
    const Vec3 normal = random.direction();
    return std::pair(Vec3(centre + (radius + offset) * normal), normal);
  });
}

TEST(Accuracy, TorusArcIsSampledToSecondOrder) {
  // Curvatures 1/R and at most 1/(Rb - R); 6,000 chords leave the arc by s^2/(8 Rb) = 4e-8 mm and
  // turn by 1.7e-4 rad.
  const double radius = 2, bend = 30, angle = 1;
  const int segments = 6000;
  const Solid solid = tests::uniform_tube(tests::arc_axis(bend, angle, segments), radius);
  const double curvatures = 1 + radius / (bend - radius);
  expect_second_order(solid, radius, {1.1 * curvatures, 0.25, angle / segments},
                      [&](tests::Random& random, double offset) {
                        const double t = random(0.1, 0.9), turn = random(0, 2 * std::numbers::pi);
                        const Vec3 outward(std::cos(t), std::sin(t), 0);
                        const Vec3 normal =
                            std::cos(turn) * outward + std::sin(turn) * Vec3::UnitZ();
                        return std::pair(Vec3(bend * outward + (radius + offset) * normal), normal);
                      });
}

TEST(Accuracy, CoarseTorusArcErrsByItsOwnKinks) {
  // 40 chords: the gradient errs by up to half a turn of the polyline more, the value by its
  // sagitta.
  const double radius = 2, bend = 10, angle = 1, h = 0.1;
  const int segments = 40;
  const Solid solid = tests::uniform_tube(tests::arc_axis(bend, angle, segments), radius);
  const Errors errors = largest_errors(solid, h, [&](tests::Random& random, double offset) {
    const double t = random(0.1, 0.9), turn = random(0, 2 * std::numbers::pi);
    const Vec3 outward(std::cos(t), std::sin(t), 0);
    const Vec3 normal = std::cos(turn) * outward + std::sin(turn) * Vec3::UnitZ();
    return std::pair(Vec3(bend * outward + (radius + offset) * normal), normal);
  });
  const double sagitta = std::pow(bend * angle / segments, 2) / (8 * bend);
  EXPECT_LE(errors.value, 1.1 * (1 + radius / (bend - radius)) * h * h / (8 * radius) + sagitta);
  EXPECT_LE(errors.gradient, 0.25 * h * h / (radius * radius) + angle / segments);
}

TEST(Accuracy, ConeSideIsSampledToSecondOrder) {
  // The cone's normal curvature is cos(alpha) / rho <= 1 / r2 where the narrow end has r2.
  const double r1 = 3, r2 = 2, length = 8;
  const double sine = (r1 - r2) / length, cosine = std::sqrt(1 - sine * sine);
  const Solid solid =
      tests::solid_of(Segment{.a = {0, 0, 0}, .b = {0, 0, length}, .radius_a = r1, .radius_b = r2});
  expect_second_order(solid, r2, {1.1, 0.25}, [&](tests::Random& random, double offset) {
    const double s = random(1, 7), turn = random(0, 2 * std::numbers::pi);
    const Vec3 normal(cosine * std::cos(turn), cosine * std::sin(turn), sine);
    return std::pair(Vec3(s * Vec3::UnitZ() + (r1 - s * sine + offset) * normal), normal);
  });
}

TEST(Accuracy, AtSeamsAndRimsStaysBelowAVoxel) {
  // V1a: rim and medial axis within 0.6 voxel.
  const double radius = 2, h = 0.1;
  const Solid tube = tests::uniform_tube(tests::arc_axis(6, 1, 60), radius);
  const LevelSet level_set = voxelise(tube, {.voxel_size = h, .half_width = 4});
  tests::Random random(33);
  for (int n = 0; n < 5000; ++n) {
    const double turn = random(0, 2 * std::numbers::pi);
    const Vec3 rim(6 + radius * std::cos(turn), 0, radius * std::sin(turn));
    const Vec3 x = rim + random(0, h) * random.direction();
    EXPECT_NEAR(level_set.sample(x).distance, distance_brute_force(tube, x).distance, 0.6 * h);
  }
}

}  // namespace
}  // namespace vstent::sdf
