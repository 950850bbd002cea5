// Stretches against closed forms and against a decomposition of the whole gradient.
#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <random>

#include "tests/measure/vessels.hpp"

namespace vstent::measure {
namespace {

using tests::TestVessel;

TestVessel tube_of(double radius) {
  return tests::lathe(30, 40, 31, [=](double) { return radius; });
}

template <class Map>
vessels::Surface moved(const vessels::Surface& surface, Map&& map) {
  TriangleMesh mesh = surface.mesh;
  for (Vec3& x : mesh.points) x = map(x);
  return vessels::make_surface(mesh, "after");
}

TEST(WallStretch, OfAConcentricExpansionIsTheRatioOfTheDiameters) {
  const TestVessel before = tube_of(3);
  const vessels::Surface after =
      moved(before.surface, [](const Vec3& x) { return Vec3(1.5 * x.x(), 1.5 * x.y(), x.z()); });
  const StentBody stent = tests::straight_stent(8, 22, 4.5);
  const Measurement result = measure({before.surface, after, before.centerline, &stent});
  const double ratio = result.metrics.narrowest_after / result.metrics.narrowest_before;
  EXPECT_NEAR(ratio, 1.5, 1e-9);
  ASSERT_TRUE(result.metrics.wall);
  const WallMetrics& wall = *result.metrics.wall;
  for (const double p : {wall.circumferential.p5, wall.circumferential.p99})
    EXPECT_NEAR(p, ratio, 1e-9);
  EXPECT_NEAR(wall.axial.p5, 1, 1e-9);
  EXPECT_NEAR(wall.axial.p99, 1, 1e-9);
  EXPECT_NEAR(wall.area_ratio.p50, 1.5, 1e-9);
  EXPECT_NEAR(wall.largest.p50, 1.5, 1e-9);
  EXPECT_NEAR(wall.smallest.p50, 1, 1e-9);
  EXPECT_EQ(wall.overstretched[0], 100);  // above 1.2
  EXPECT_EQ(wall.overstretched[2], 0);    // not above 2
  for (const double s : result.triangle_fields.at("StretchCircumferential"))
    EXPECT_NEAR(s, 1.5, 1e-9);
  // Rings of triangles are 1 mm long, and the stent covers 14 mm of the length, ends to within a
  // station on both sides.
  const double around = 80 * 3 * std::sin(std::numbers::pi / 40);
  EXPECT_NEAR(wall.area_before, 14 * around, 2 * around);
}

TEST(WallStretch, AlongTheVesselIsAxial) {
  const TestVessel before = tube_of(3);
  const auto longer = [](const Vec3& x) { return Vec3(x.x(), x.y(), 15 + 1.1 * (x.z() - 15)); };
  const std::vector<Vec3> points = moved(before.surface, longer).mesh.points;
  const WallStretch s =
      wall_stretch(before.surface.mesh, points, before.centerline.branches[0].points);
  for (std::size_t t = 0; t < s.axial.size(); ++t) {
    EXPECT_NEAR(s.axial[t], 1.1, 1e-12);
    EXPECT_NEAR(s.circumferential[t], 1, 1e-12);
  }
}

TEST(WallStretch, IsOneForARigidMotionAndExactlyOneForNone) {
  const TestVessel before = tube_of(3);
  const Eigen::AngleAxisd turn(0.7, Vec3(1, 2, 3).normalized());
  const auto motion = [&](const Vec3& x) { return Vec3(turn * x + Vec3(4, 5, 6)); };
  const Polyline& axis = before.centerline.branches[0].points;
  const WallStretch s =
      wall_stretch(before.surface.mesh, moved(before.surface, motion).mesh.points, axis);
  const WallStretch none = wall_stretch(before.surface.mesh, before.surface.mesh.points, axis);
  for (std::size_t t = 0; t < s.axial.size(); ++t) {
    for (const double value :
         {s.axial[t], s.circumferential[t], s.area_ratio[t], s.largest[t], s.smallest[t]})
      EXPECT_NEAR(value, 1, 1e-12);
    EXPECT_EQ(none.circumferential[t], 1);
    EXPECT_EQ(none.largest[t], 1);
  }
}

// The twin: the three-dimensional map that takes both edges and the normals into each other, and
// its singular value decomposition.
TEST(WallStretch, AgreesWithTheWholeGradientOnAnyTriangles) {
  std::mt19937 random(7);
  std::uniform_real_distribution<double> any(-1, 1);
  const auto point = [&] { return Vec3(any(random), any(random), any(random)); };
  const Polyline axis{Vec3(0, 0, -9), Vec3(0, 0, 0), Vec3(0, 0, 9)};
  for (int trial = 0; trial < 200; ++trial) {
    const TriangleMesh mesh{{point(), point(), point()}, {{0, 1, 2}}};
    const std::vector<Vec3> after{point(), point(), point()};
    const auto frame = [](const std::vector<Vec3>& x) {
      Eigen::Matrix3d m;
      m.col(0) = x[1] - x[0];
      m.col(1) = x[2] - x[0];
      m.col(2) = m.col(0).cross(m.col(1)).normalized();
      return m;
    };
    const Eigen::Matrix3d from = frame(mesh.points), to = frame(after);
    if (from.col(0).cross(from.col(1)).norm() < 0.05) continue;
    const Eigen::Matrix3d gradient = to * from.inverse();
    const Vec3 normal = from.col(2);
    const Vec3 along = (Vec3::UnitZ() - normal.z() * normal).normalized();
    const WallStretch s = wall_stretch(mesh, after, axis);
    EXPECT_NEAR(s.axial[0], (gradient * along).norm(), 1e-9);
    EXPECT_NEAR(s.circumferential[0], (gradient * normal.cross(along)).norm(), 1e-9);
    // One singular value is the normal's 1; their product is the area ratio.
    const Vec3 values = Eigen::JacobiSVD<Eigen::Matrix3d>(gradient).singularValues();
    EXPECT_NEAR(s.area_ratio[0], values.prod(), 1e-9 * (1 + values.prod()));
    EXPECT_NEAR(s.largest[0] * s.smallest[0], s.area_ratio[0], 1e-9 * (1 + values.prod()));
    EXPECT_NEAR(s.largest[0] * s.largest[0] + s.smallest[0] * s.smallest[0] + 1,
                values.squaredNorm(), 1e-9 * (1 + values.squaredNorm()));
  }
}

TEST(WallMetrics, WeighWithAreas) {
  // Four right triangles whose areas are 1, 2, 3 and 4.
  TriangleMesh mesh;
  WallStretch stretch;
  for (int k = 1; k <= 4; ++k) {
    const int first = static_cast<int>(mesh.points.size());
    mesh.points.insert(mesh.points.end(), {Vec3(0, 0, k), Vec3(2, 0, k), Vec3(0, k, k)});
    mesh.triangles.push_back({first, first + 1, first + 2});
    stretch.circumferential.push_back(1 + 0.2 * k);  // 1.2, 1.4, 1.6, 1.8
  }
  stretch.axial = stretch.area_ratio = stretch.largest = stretch.smallest = stretch.circumferential;
  const auto wall = measure_wall(mesh, stretch, std::vector<char>{1, 1, 1, 1});
  ASSERT_TRUE(wall);
  EXPECT_NEAR(wall->area_before, 10, 1e-12);
  EXPECT_NEAR(wall->circumferential.p5, 1.2, 1e-12);   // the first tenth of the area
  EXPECT_NEAR(wall->circumferential.p50, 1.6, 1e-12);  // from 3 to 6 of 10
  EXPECT_NEAR(wall->circumferential.p95, 1.8, 1e-12);
  EXPECT_NEAR(wall->overstretched[0], 90, 1e-9);  // above 1.2: not the first
  EXPECT_NEAR(wall->overstretched[1], 70, 1e-9);  // above 1.5
  const auto part = measure_wall(mesh, stretch, std::vector<char>{1, 0, 0, 1});
  EXPECT_NEAR(part->overstretched[1], 80, 1e-9);
  EXPECT_FALSE(measure_wall(mesh, stretch, std::vector<char>{0, 0, 0, 0}));
}

TEST(Neighbours, AreVesselsBesideAndNotTheVesselItself) {
  const double gap = 0.8;
  TriangleMesh one = tests::tube(3, 40, 40, 41), two = one;
  const int count = static_cast<int>(one.points.size());
  for (const Vec3& x : one.points) two.points.push_back(x + Vec3(6 + gap, 0, 0));
  for (const Triangle& t : one.triangles)
    two.triangles.push_back({t[0] + count, t[1] + count, t[2] + count});
  const auto stented = [&](const TriangleMesh& mesh) {
    std::vector<char> marks(mesh.triangles.size(), 0);
    for (std::size_t t = 0; t < one.triangles.size(); ++t) {
      const double z = mesh.points[static_cast<std::size_t>(mesh.triangles[t][0])].z();
      marks[t] = z > 15 && z < 25;
    }
    return marks;
  };
  EXPECT_FALSE(distance_to_neighbours(one, stented(one), 6));
  const auto distance = distance_to_neighbours(two, stented(two), 6);
  ASSERT_TRUE(distance);
  EXPECT_NEAR(*distance, gap, 1e-9);  // corners of both polygons face each other
  EXPECT_FALSE(distance_to_neighbours(two, stented(two), 0.5)) << "beyond reach";
}

TEST(Neighbours, AreOtherPartsOfAVesselThatTurnsBack) {
  // A hairpin: half a torus of tube radius 2, bend radius 3.
  TriangleMesh mesh = tests::tube(2, 1, 40, 61);
  const double bend = 3, leg = 30;
  const double arc = std::numbers::pi * bend, total = 2 * leg + arc;
  for (Vec3& x : mesh.points) {
    const double s = x.z() * total, across = x.x();
    if (s < leg) {
      x = {across - bend, x.y(), s};
    } else if (s < leg + arc) {
      const double turn = (s - leg) / bend;
      x = {-(bend - across) * std::cos(turn), x.y(), leg + (bend - across) * std::sin(turn)};
    } else {
      x = {bend - across, x.y(), leg - (s - leg - arc)};
    }
  }
  std::vector<char> stented(mesh.triangles.size(), 0);
  for (std::size_t t = 0; t < stented.size(); ++t) {
    const Vec3& x = mesh.points[static_cast<std::size_t>(mesh.triangles[t][0])];
    stented[t] = x.x() < 0 && x.z() > 2 && x.z() < 10;
  }
  const auto distance = distance_to_neighbours(mesh, stented, 4);
  ASSERT_TRUE(distance);
  EXPECT_NEAR(*distance, 2 * (bend - 2), 1e-9);
}

}  // namespace
}  // namespace vstent::measure
