// Whole measurements: nothing moved, other triangles, and what cannot be compared.
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <nlohmann/json.hpp>

#include "measure/report_files.hpp"
#include "tests/measure/vessels.hpp"
#include "vessels/error.hpp"

namespace vstent::measure {
namespace {

using tests::TestVessel;

TestVessel tube_of(double radius, int around = 40, int rings = 41) {
  return tests::lathe(40, around, rings, [=](double) { return radius; });
}

TEST(Measure, NothingMovedGivesZeros) {
  vessels::IdealisedVessel bent;
  bent.bend_angle = 0.6;
  const TestVessel vessel = tests::idealised(bent);
  const std::vector<double> radii(vessel.centerline.branches[0].points.size(), 3);
  const Polyline& axis = vessel.centerline.branches[0].points;
  const std::vector<double> arc = arc_lengths(axis);
  const Polyline place = resample(axis, 20, 40, 1);
  const StentBody stent(
      sdf::voxelise(sdf::make_tube(place, std::vector<double>(place.size(), 4)), {0.3, 3}));
  const Measurement result = measure({vessel.surface, vessel.surface, vessel.centerline, &stent});
  const Metrics& m = result.metrics;
  EXPECT_TRUE(m.same_triangles);
  EXPECT_EQ(m.moved_vertices, 0u);
  EXPECT_EQ(m.largest_displacement, 0);
  EXPECT_EQ(m.inverted_triangles, 0u);
  EXPECT_EQ(m.new_self_intersections, 0u);
  EXPECT_EQ(m.openings_before, 2u);
  EXPECT_FALSE(m.closed_after);
  EXPECT_GT(m.narrowest_before, 4.9);
  EXPECT_EQ(m.narrowest_before, m.narrowest_after);
  EXPECT_EQ(m.volume_before, m.volume_after);
  EXPECT_EQ(m.lateral_shift, 0);
  EXPECT_EQ(m.curve_before.total, m.curve_after.total);
  EXPECT_EQ(m.neighbours_before, m.neighbours_after);
  ASSERT_TRUE(m.wall.has_value());
  for (const Percentiles& p : {m.wall->circumferential, m.wall->axial, m.wall->area_ratio})
    EXPECT_TRUE(p.p5 == 1 && p.p50 == 1 && p.p95 == 1 && p.p99 == 1);
  EXPECT_EQ(m.wall->overstretched[0], 0);
  for (const double d : result.vertex_fields.at("Displacement")) EXPECT_EQ(d, 0);
  for (const Station& s : m.stations)
    EXPECT_EQ(s.before ? s.before->area : 0, s.after ? s.after->area : 0);
}

TEST(Measure, OtherTrianglesAfterGiveTheLumenButNoStretch) {
  const TestVessel before = tube_of(3), after = tube_of(4.5, 52, 47);
  const StentBody stent = tests::straight_stent(12, 28, 4.5);
  const Measurement result = measure({before.surface, after.surface, before.centerline, &stent});
  const Metrics& m = result.metrics;
  EXPECT_FALSE(m.same_triangles);
  EXPECT_NEAR(m.narrowest_before, tests::equivalent_diameter(tests::polygon_area(40, 3)), 1e-9);
  EXPECT_NEAR(m.narrowest_after, tests::equivalent_diameter(tests::polygon_area(52, 4.5)), 1e-9);
  EXPECT_FALSE(m.wall);
  EXPECT_FALSE(result.triangle_fields.contains("AreaRatio"));
  EXPECT_FALSE(result.vertex_fields.contains("Displacement"));
  EXPECT_TRUE(result.vertex_fields.contains("StentDistance"));
  const auto json = to_json(m);
  EXPECT_TRUE(json["wall"]["circumferential_stretch_p50"].is_null());
  EXPECT_TRUE(json["mesh"]["moved_vertices"].is_null());
  const std::string reason = json["unmeasured"]["/wall"];
  EXPECT_NE(reason.find("same vertices and triangles"), std::string::npos);
}

// One surface in two sets of triangles: nothing happened.
TEST(Measure, TheSameVesselRemeshedHasNoGain) {
  const TestVessel before = tube_of(3, 40, 41), after = tube_of(3, 80, 57);
  const Metrics m = measure({before.surface, after.surface, before.centerline}).metrics;
  const double other = tests::equivalent_diameter(tests::polygon_area(80, 3)) -
                       tests::equivalent_diameter(tests::polygon_area(40, 3));
  EXPECT_NEAR(m.narrowest_after - m.narrowest_before, other, 1e-9);
  EXPECT_NEAR(m.lateral_shift, 0, 1e-9);
  EXPECT_FALSE(m.changed);
}

TEST(Measure, SeesInvertedTrianglesCrossingsAndStrays) {
  const TestVessel before = tube_of(5);
  TriangleMesh mesh = before.surface.mesh;
  const std::size_t victim = 20 * 40;
  mesh.points[victim].head<2>() *= -1.3;  // through the lumen and out of the other side
  const vessels::Surface after = vessels::make_surface(mesh, "after");
  Comparison comparison{before.surface, after, before.centerline};
  comparison.movable.assign(mesh.points.size(), 1);
  comparison.movable[victim] = 0;
  const Metrics m = measure(comparison).metrics;
  EXPECT_GT(m.inverted_triangles, 0u);
  EXPECT_EQ(m.moved_vertices, 1u);
  EXPECT_EQ(m.changed_outside_patch, 1u);
  EXPECT_NEAR(m.largest_displacement, 2.3 * 5, 1e-9);
}

// A vertex drawn across an edge of its fan turns over exactly the triangles whose signed area
// becomes negative, seen along the sheet's normal; turning the whole sheet turns over none.
TEST(MeshCertificate, TrianglesAreInvertedAmongTheirNeighboursOnly) {
  TriangleMesh sheet;
  constexpr int kSide = 9;
  const auto vertex = [](int i, int j) { return j * kSide + i; };
  for (int j = 0; j < kSide; ++j)
    for (int i = 0; i < kSide; ++i) sheet.points.emplace_back(i, j, 0);
  for (int j = 0; j + 1 < kSide; ++j) {
    for (int i = 0; i + 1 < kSide; ++i) {
      sheet.triangles.push_back({vertex(i, j), vertex(i + 1, j), vertex(i + 1, j + 1)});
      sheet.triangles.push_back({vertex(i, j), vertex(i + 1, j + 1), vertex(i, j + 1)});
    }
  }

  TriangleMesh folded = sheet;
  const auto moved = static_cast<std::size_t>(vertex(4, 4));
  folded.points[moved] += Vec3(1.2, 0.3, 0);
  std::size_t negative = 0;
  for (const Triangle& t : folded.triangles) {
    const auto p = [&](int k) {
      return folded.points[static_cast<std::size_t>(t[static_cast<std::size_t>(k)])];
    };
    negative += (p(1) - p(0)).cross(p(2) - p(0)).z() < 0;
  }
  ASSERT_GT(negative, 0u);
  const Eigen::AngleAxisd turn(2.0, Vec3(1, 2, 0.5).normalized());
  for (Vec3& p : folded.points) p = turn * p;
  const MeshMetrics m = certify(sheet, folded, {});
  EXPECT_EQ(m.inverted_triangles, negative);

  TriangleMesh turned = sheet;
  for (Vec3& p : turned.points) p = turn * p;
  const MeshMetrics rigid = certify(sheet, turned, {});
  EXPECT_EQ(rigid.inverted_triangles, 0u);
  EXPECT_EQ(rigid.turned_triangles, sheet.triangles.size());
}

std::string refusal(const Comparison& comparison) {
  try {
    measure(comparison);
  } catch (const Error& error) {
    EXPECT_EQ(error.code(), ExitCode::geometry);
    EXPECT_EQ(std::string(error.what()).find('\n'), std::string::npos);
    return error.what();
  }
  return "accepted";
}

TEST(Measure, RefusesWhatCannotBeCompared) {
  const TestVessel vessel = tube_of(3);
  const auto moved = [&](double scale, const Vec3& shift) {
    TriangleMesh mesh = vessel.surface.mesh;
    for (Vec3& x : mesh.points) x = scale * x + shift;
    return vessels::make_surface(mesh, "other.vtp");
  };
  const vessels::Surface centimetres = moved(0.1, Vec3::Zero());
  EXPECT_NE(refusal({vessel.surface, centimetres, vessel.centerline})
                .find("other.vtp: is 10 times smaller than vessel"),
            std::string::npos);
  const vessels::Surface beside = moved(1, Vec3(50, 0, 0));
  EXPECT_NE(refusal({vessel.surface, beside, vessel.centerline}).find("lies beside"),
            std::string::npos);
  const vessels::Surface half_beside = moved(1, Vec3(5, 0, 0));
  TestVessel other = tube_of(3, 30);
  for (Vec3& x : other.surface.mesh.points) x += Vec3(5, 0, 0);
  EXPECT_NE(
      refusal({vessel.surface, other.surface, vessel.centerline}).find("is it the same vessel?"),
      std::string::npos);
  const StentBody far = [] {
    const Polyline axis{Vec3(90, 0, 10), Vec3(90, 0, 20)};
    return StentBody(sdf::voxelise(sdf::make_tube(axis, {2, 2}), {0.2, 3}));
  }();
  EXPECT_NE(refusal({vessel.surface, vessel.surface, vessel.centerline, &far})
                .find("from the vessel's centerline"),
            std::string::npos);
  const StentBody tiny = tests::straight_stent(18, 22, 0.2, 0.05);
  EXPECT_NE(refusal({vessel.surface, vessel.surface, vessel.centerline, &tiny})
                .find("within its radius; level sets are in mm"),
            std::string::npos);
  const vessels::Centerline none;
  EXPECT_NE(refusal({vessel.surface, vessel.surface, none}).find("the centerline is empty"),
            std::string::npos);
  vessels::Centerline elsewhere = vessel.centerline;
  for (Vec3& x : elsewhere.branches[0].points) x += Vec3(20, 0, 0);
  EXPECT_NE(refusal({vessel.surface, vessel.surface, elsewhere}).find("of this vessel"),
            std::string::npos);
  const vessels::Surface empty = vessels::make_surface({}, "empty.vtp");
  EXPECT_NE(refusal({vessel.surface, empty, vessel.centerline}).find("has no triangles"),
            std::string::npos);
}

TEST(Measure, ProfilesSayWhatIsKnownAndFlagTheRest) {
  const TestVessel vessel = tube_of(3);
  const StentBody stent = tests::straight_stent(2, 10, 3);
  const Metrics m = measure({vessel.surface, vessel.surface, vessel.centerline, &stent}).metrics;
  std::istringstream csv(profiles_csv(m));
  std::string header, row, first;
  std::getline(csv, header);
  EXPECT_EQ(header,
            "arc_length_mm,before_area_mm2,before_equivalent_diameter_mm,before_min_diameter_mm,"
            "before_max_diameter_mm,after_area_mm2,after_equivalent_diameter_mm,"
            "after_min_diameter_mm,after_max_diameter_mm,target_diameter_mm,"
            "curvature_before_per_mm,curvature_after_per_mm,flags");
  std::size_t rows = 0, in_stent = 0;
  while (std::getline(csv, row)) {
    ++rows;
    EXPECT_EQ(std::count(row.begin(), row.end(), ','), 12) << row;
    in_stent += row.ends_with("in_stent");
    if (first.empty()) first = row;
  }
  EXPECT_EQ(rows, m.stations.size());
  EXPECT_GT(in_stent, 20u);
  // Nothing of the vessel lies below its first ring: open.
  EXPECT_TRUE(first.starts_with("0,,,,,,,,,,")) << first;
  EXPECT_TRUE(first.ends_with("open_before open_after")) << first;
}

}  // namespace
}  // namespace vstent::measure
