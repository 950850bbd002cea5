#include "sdf/level_set.hpp"

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <string>

#include "sdf/exact_field.hpp"
#include "tests/sdf/shapes.hpp"

namespace vstent::sdf {
namespace {

struct NamedSolid {
  std::string name;
  Solid solid;
  double voxel_size;
  double half_width = 3;
};

std::ostream& operator<<(std::ostream& out, const NamedSolid& solid) { return out << solid.name; }

Solid shifted(Solid solid, const Vec3& by) {
  for (Segment& s : solid.segments) s.a += by, s.b += by;
  for (Strut& s : solid.struts) s.a += by, s.b += by;
  for (EndCap& cap : solid.caps) cap.centre += by;
  return solid;
}

Solid mixed() {
  Solid solid = tests::scattered_struts(40, 1, 46);
  solid.struts = tests::scattered_flat_struts(40, 1, 47).struts;
  return solid;
}

std::vector<NamedSolid> solids() {
  const Solid capsule = tests::solid_of(
      Segment{.a = {-2, 0.3, 0.1}, .b = {2.2, 1, 1.4}, .radius_a = 1.3, .radius_b = 1.3});
  const Solid ball = tests::solid_of(
      Segment{.a = {0.1, 0.2, 0.3}, .b = {0.1, 0.2, 0.3}, .radius_a = 1, .radius_b = 1});
  const Solid cone =
      tests::solid_of(Segment{.a = {0, 0, 0}, .b = {3, 1, 2}, .radius_a = 2, .radius_b = 0.5});
  const Polyline arc = tests::arc_axis(7, 1.3, 40);
  return {
      {"capsule", capsule, 0.13},
      {"ball", ball, 0.06},
      {"cone", cone, 0.15},
      {"cone_to_a_point",
       tests::solid_of(Segment{.a = {0, 0, 0}, .b = {3, 1, 2}, .radius_a = 1, .radius_b = 0}),
       0.12},
      {"thick_capsule_with_inside_tiles",
       tests::solid_of(Segment{.a = {-1, 0, 0}, .b = {1, 0, 0}, .radius_a = 6, .radius_b = 6}),
       0.2},
      {"thin_capsule",
       tests::solid_of(
           Segment{.a = {-2, 0, 0}, .b = {2, 1, 1}, .radius_a = 0.02, .radius_b = 0.02}),
       0.1},
      {"long_diagonal_strut",
       tests::solid_of(
           Segment{.a = {-9, -9, -9}, .b = {9, 9, 9}, .radius_a = 0.2, .radius_b = 0.2}),
       0.25},
      {"torus_arc_flat_ends", tests::uniform_tube(arc, 1.5), 0.15},
      {"torus_arc_round_ends", tests::uniform_tube(arc, 1.5, true), 0.15},
      {"torus_arc_far_away", shifted(tests::uniform_tube(arc, 1.5), {812.3, -430.7, 1201.9}), 0.15},
      {"torus_arc_wide_band", tests::uniform_tube(arc, 1.5), 0.2, 6.5},
      {"torus_arc_narrow_band", tests::uniform_tube(arc, 1.5), 0.2, 1},
      {"tight_bend", tests::uniform_tube(tests::arc_axis(1.6, 2.5, 25), 1.5), 0.13},
      {"tapered_arc", tests::tapered_tube(arc, 2, 1), 0.15},
      {"tapered_arc_round_ends", tests::tapered_tube(arc, 1, 2, true), 0.15},
      {"short_tube", tests::uniform_tube(tests::straight_axis({0, 0, 0}, {0.5, 0.8, 0.2}, 4), 2),
       0.13},
      {"paper_arc", tests::paper_tube(tests::arc_axis(7, 1.3, 8), 1.5), 0.15},
      {"flat_strut_sharp", tests::solid_of(tests::slanted_strut(0)), 0.02},
      {"flat_strut_round", tests::solid_of(tests::slanted_strut(0.03)), 0.013},
      {"flat_strut_coarse", tests::solid_of(tests::slanted_strut(0.01)), 0.2},
      {"flat_plate", tests::solid_of(tests::slanted_strut(0.02, 0)), 0.02},
      {"flat_struts", tests::scattered_flat_struts(60, 0.7, 44), 0.05},
      {"flat_struts_far_away",
       shifted(tests::scattered_flat_struts(40, 0.5, 45), {-211.3, 187.9, 95.2}), 0.04},
      {"struts_wires_and_cones", mixed(), 0.06},
      {"capsule_of_an_aorta",
       tests::solid_of(
           Segment{.a = {100, 200, -150}, .b = {103, 201, -148}, .radius_a = 15, .radius_b = 15}),
       0.4},
      {"short_struts", tests::scattered_struts(120, 1.8, 42), 0.08},
      {"short_struts_coarse", tests::scattered_struts(300, 2.5, 43), 0.4}};
}

constexpr double kNodeError = 1e-6;  // mm

class Nodes : public testing::TestWithParam<NamedSolid> {};
INSTANTIATE_TEST_SUITE_P(Solids, Nodes, testing::ValuesIn(solids()),
                         [](const auto& test) { return test.param.name; });

TEST_P(Nodes, AreExactInTheBandAndRightlySignedOutsideIt) {
  // Every node of the padded bounding box against brute force: values to kNodeError, every node
  // within the band active and no other, and the background with the right sign elsewhere. That
  // close to the band's edge either is right.
  const NamedSolid& p = GetParam();
  const double h = p.voxel_size, band = p.half_width * h;
  const LevelSet level_set = voxelise(p.solid, {.voxel_size = h, .half_width = p.half_width});
  const float background = static_cast<float>(band);
  EXPECT_EQ(level_set.background(), static_cast<double>(background));
  EXPECT_EQ(level_set.voxel_size(), h);
  Box box = tests::bounds(p.solid);
  box.pad(band + 4 * h);
  std::size_t active = 0;
  double worst = 0;
  const auto node = [h](double x) { return static_cast<int>(std::floor(x / h)); };
  for (int i = node(box.lower.x()); i <= node(box.upper.x()); ++i) {
    for (int j = node(box.lower.y()); j <= node(box.upper.y()); ++j) {
      for (int k = node(box.lower.z()); k <= node(box.upper.z()); ++k) {
        const double d = distance_brute_force(p.solid, Vec3(i * h, j * h, k * h)).distance;
        const double value = level_set.node_value({i, j, k});
        const bool is_active = level_set.node_is_active({i, j, k});
        active += is_active;
        if (std::abs(std::abs(d) - band) > kNodeError) {
          ASSERT_EQ(is_active, std::abs(d) < band) << i << ' ' << j << ' ' << k << ": " << d;
        }
        if (is_active) {
          worst = std::max(worst, std::abs(value - d));
        } else {
          ASSERT_EQ(value, d < 0 ? -level_set.background() : level_set.background())
              << i << ' ' << j << ' ' << k;
        }
      }
    }
  }
  EXPECT_LT(worst, kNodeError);
  EXPECT_EQ(active, level_set.active_voxels());  // and none outside the box
}

TEST_P(Nodes, AreTheSameForAnyNumberOfThreads) {
  const NamedSolid& p = GetParam();
  const auto nodes_with = [&](std::size_t threads) {
    const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads);
    std::vector<std::pair<std::array<double, 3>, double>> nodes;
    voxelise(p.solid, {.voxel_size = 1.7 * p.voxel_size, .half_width = p.half_width})
        .for_each_active([&](const Vec3& x, double value) {
          nodes.push_back({{x.x(), x.y(), x.z()}, value});
        });
    return nodes;
  };
  const auto one = nodes_with(1);
  EXPECT_FALSE(one.empty());
  EXPECT_EQ(one, nodes_with(2));
  EXPECT_EQ(one, nodes_with(5));
}

struct Definition {
  Sample sample;
  double steepness = 1;  // of the gradient before it was normalised
};

/// The sampler's slow twin: the definition, node by node, in double precision.
Definition sample_by_definition(const LevelSet& level_set, const Vec3& x) {
  const double h = level_set.voxel_size();
  const Vec3 index = x / h;
  const Vec3 base = index.array().floor();
  double value = 0;
  Vec3 gradient = Vec3::Zero();
  bool within = true;
  const auto node = [&](std::array<int, 3> at) {
    const double v = level_set.node_value(at);
    within &= std::abs(v) < level_set.background();
    return v;
  };
  for (int corner = 0; corner < 8; ++corner) {
    const std::array<int, 3> step{corner >> 2, corner >> 1 & 1, corner & 1};
    std::array<int, 3> at;
    double weight = 1;
    for (std::size_t a = 0; a < 3; ++a) {
      const auto axis = static_cast<Eigen::Index>(a);
      at[a] = static_cast<int>(base[axis]) + step[a];
      const double f = index[axis] - base[axis];
      weight *= step[a] ? f : 1 - f;
    }
    value += weight * node(at);
    for (std::size_t a = 0; a < 3; ++a) {
      auto before = at, after = at;
      --before[a], ++after[a];
      gradient[static_cast<Eigen::Index>(a)] += weight * (node(after) - node(before)) / 2;
    }
  }
  if (!within || std::abs(value) >= level_set.background() - h) {
    const double nearest = level_set.node_value(
        {static_cast<int>(base[0]), static_cast<int>(base[1]), static_cast<int>(base[2])});
    return {{std::copysign(level_set.background(), nearest), Vec3::Zero()}};
  }
  return {{value, gradient.normalized()}, gradient.norm() / h};
}

TEST(Sampling, FollowsItsDefinition) {
  // In single precision: at most seven roundings on the way to a value, each of half a unit in the
  // last place of a number below twice the background; a slope is half a difference per voxel.
  constexpr double kHalfWidth = 5;
  constexpr double kRounding = 7 * 2 * 0x1p-25;
  for (const NamedSolid& p : solids()) {
    const LevelSet level_set =
        voxelise(p.solid, {.voxel_size = p.voxel_size, .half_width = kHalfWidth});
    Box box = tests::bounds(p.solid);
    box.pad(8 * p.voxel_size);
    tests::Random random(21);
    std::vector<Vec3> points;
    for (int n = 0; n < 3000; ++n) points.push_back(random.in_box(box.lower, box.upper));
    std::vector<Sample> samples(points.size());
    level_set.sample(points, samples);
    for (std::size_t i = 0; i < points.size(); ++i) {
      const auto [expected, steepness] = sample_by_definition(level_set, points[i]);
      ASSERT_NEAR(samples[i].distance, expected.distance, kRounding * level_set.background())
          << p.name << ' ' << points[i].transpose();
      ASSERT_LT((samples[i].gradient - expected.gradient).norm(),
                std::sqrt(3.0) * kRounding * kHalfWidth / steepness)
          << p.name;
      const Sample alone = level_set.sample(points[i]);
      ASSERT_EQ(alone.distance, samples[i].distance);
      ASSERT_EQ(alone.gradient, samples[i].gradient);
    }
  }
}

TEST(Sampling, OutsideTheBandIsTheSignedBackgroundWithoutGradient) {
  const double h = 0.2;
  const Solid tube = tests::uniform_tube(tests::arc_axis(12, 1.5, 60), 4);
  const ExactField exact(tube);
  const LevelSet level_set = voxelise(tube, {.voxel_size = h, .half_width = 4});
  tests::Random random(22);
  int beyond = 0, within = 0;
  for (int n = 0; n < 50000; ++n) {
    const Vec3 x = random.in_box({-8, -6, -6}, {18, 18, 6});
    const double d = exact.sample(x).distance;
    const Sample sample = level_set.sample(x);
    if (std::abs(d) >
        level_set.background() - h + h * h) {  // the value itself errs by less than h^2 here
      EXPECT_EQ(sample.distance, std::copysign(level_set.background(), d));
      EXPECT_EQ(sample.gradient, Vec3(Vec3::Zero()));
      ++beyond;
    } else if (std::abs(d) < level_set.background() - 2.45 * h) {
      EXPECT_LT(std::abs(sample.distance), level_set.background());
      EXPECT_NEAR(sample.gradient.norm(), 1, 1e-12);
      ++within;
    }
  }
  EXPECT_GT(beyond, 1000);
  EXPECT_GT(within, 1000);
  for (const Vec3& far :
       {Vec3(1e9, 0, 0), Vec3(-1e300, 3, 4), Vec3(0, 1e8, 0), Vec3(std::nan(""), 0, 0)}) {
    EXPECT_EQ(level_set.sample(far).distance, level_set.background());
    EXPECT_EQ(level_set.sample(far).gradient, Vec3(Vec3::Zero()));
  }
}

TEST(Sampling, OfARoundTubeFollowsItsRadiusByShifting) {
  // phi(R2) = phi(R1) - (R2 - R1) holds at every node for uniform round-ended tubes.
  const Polyline axis = tests::arc_axis(12, 1.5, 60);
  const LevelSet thin =
      voxelise(tests::uniform_tube(axis, 2, true), {.voxel_size = 0.2, .half_width = 5});
  const LevelSet thick =
      voxelise(tests::uniform_tube(axis, 2.3, true), {.voxel_size = 0.2, .half_width = 5});
  tests::Random random(23);
  for (int n = 0; n < 20000; ++n) {
    const Vec3 x = random.in_box({-3, -3, -3}, {15, 15, 3});
    const Sample a = thin.sample(x), b = thick.sample(x);
    if (a.gradient.isZero() || b.gradient.isZero()) continue;
    ASSERT_NEAR(b.distance, a.distance - 0.3, 2e-6);
  }
}

TEST(Surface, IsClosedOutwardAndOnTheZeroLevel) {
  const double radius = 2, h = 0.1;
  const Solid ball = tests::solid_of(
      Segment{.a = {0.3, 0.2, 0.1}, .b = {0.3, 0.2, 0.1}, .radius_a = radius, .radius_b = radius});
  const TriangleMesh surface = voxelise(ball, {.voxel_size = h}).surface();
  double volume = 0;
  for (const auto& [i, j, k] : surface.triangles) {
    const auto at = [&](int p) { return surface.points[static_cast<std::size_t>(p)]; };
    volume += at(i).dot(at(j).cross(at(k))) / 6;
  }
  // Points lie within the trilinear error, 2.1 h^2/(8R), and chords of length <= 2h dip (2h)^2/(8R)
  // below the sphere.
  for (const Vec3& p : surface.points)
    EXPECT_NEAR((p - ball.segments[0].a).norm(), radius, 2.1 * 4 * h * h / (8 * radius));
  const double area = 4 * std::numbers::pi * radius * radius;
  EXPECT_NEAR(volume, area * radius / 3, area * 2.1 * 4 * h * h / (8 * radius));
  EXPECT_GT(volume, 0);
  EXPECT_EQ(surface.points.size() - 3 * surface.triangles.size() / 2 + surface.triangles.size(),
            2u);  // Euler
}

TEST(Voxelise, RefusesImpossibleOptions) {
  const Solid solid = tests::scattered_struts(3, 1, 1);
  EXPECT_THROW(voxelise(solid, {.voxel_size = 0}), std::invalid_argument);
  EXPECT_THROW(voxelise(solid, {.voxel_size = -1}), std::invalid_argument);
  EXPECT_THROW(voxelise(solid, {.voxel_size = std::nan("")}), std::invalid_argument);
  EXPECT_THROW(voxelise(solid, {.voxel_size = 0.1, .half_width = 0}), std::invalid_argument);
  EXPECT_THROW(voxelise(Solid{}, {.voxel_size = 0.1}), std::invalid_argument);
  EXPECT_THROW(voxelise(solid, {.voxel_size = 1e-12}), std::length_error);
}

double fitting_voxel_size(const std::string& message) {
  const auto at = message.find("voxels of ", message.find(';')) + std::string("voxels of ").size();
  return std::stod(message.substr(at));
}

TEST(Voxelise, RefusesWhatDoesNotFitAndNamesAVoxelSizeThatDoes) {
  const Solid tube = tests::uniform_tube(tests::arc_axis(20, 2, 200), 3);
  const Solid struts = tests::scattered_struts(300, 3, 2);
  for (const Solid& solid : {tube, struts}) {
    VoxelOptions options{.voxel_size = 1e-4, .memory_limit = std::size_t{32} << 20};
    try {
      voxelise(solid, options);
      FAIL() << "not refused";
    } catch (const std::length_error& error) {
      const double fits = fitting_voxel_size(error.what());
      EXPECT_GT(fits, options.voxel_size) << error.what();
      options.voxel_size = fits;
      EXPECT_LE(voxelise(solid, options).memory_bytes(), options.memory_limit);
      options.voxel_size = 0.98 * fits;
      EXPECT_THROW(voxelise(solid, options), std::length_error);
    }
  }
}

}  // namespace
}  // namespace vstent::sdf
