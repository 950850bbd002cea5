// Profiles against closed forms: tube, cone, torus, fork.
#include <gtest/gtest.h>

#include "measure/profile.hpp"
#include "tests/measure/vessels.hpp"

namespace vstent::measure {
namespace {

using std::numbers::pi;
using tests::equivalent_diameter;
using tests::polygon_area;
using tests::TestVessel;

Profile profile_of(const TestVessel& before, const TestVessel& after, bool same_triangles,
                   double from, double to, double spacing) {
  return sample_profile(CutSurface(before.surface), CutSurface(after.surface), same_triangles,
                        before.centerline, vessels::paths(before.centerline).front(), from, to,
                        spacing);
}

TEST(Profile, OfAConeIsThePolygonOfItsRadius) {
  constexpr int kAround = 48;
  const auto radius = [](double z) { return 3 + 0.05 * z; };
  const TestVessel cone = tests::lathe(40, kAround, 41, radius);
  const Profile profile = profile_of(cone, cone, true, 5, 35, 0.7);
  for (const Station& s : profile.stations) {
    ASSERT_TRUE(s.whole_before() && s.whole_after());
    // The facets of a cone's quadrilaterals are flat, so that a cut is a regular polygon exactly.
    const double area = polygon_area(kAround, radius(s.arc_length));
    EXPECT_NEAR(s.before->area, area, 1e-9);
    EXPECT_NEAR(s.before->equivalent_diameter, equivalent_diameter(area), 1e-9);
    EXPECT_GE(s.before->min_diameter, 2 * radius(s.arc_length) * std::cos(pi / kAround) - 1e-9);
    EXPECT_LE(s.before->max_diameter, 2 * radius(s.arc_length) + 1e-9);
    EXPECT_EQ(s.after->area, s.before->area);
    EXPECT_NEAR(s.curvature_before, 0, 1e-9);
  }
}

TEST(Profile, OfATubeInOtherTrianglesAfterwardsIsThatOfTheOtherPolygon) {
  const TestVessel before = tests::lathe(30, 40, 31, [](double) { return 3.0; });
  const TestVessel after = tests::lathe(30, 50, 44, [](double) { return 4.0; });
  for (const Station& s : profile_of(before, after, false, 3, 27, 0.5).stations) {
    ASSERT_TRUE(s.whole_before() && s.whole_after());
    EXPECT_NEAR(s.before->area, polygon_area(40, 3), 1e-9);
    EXPECT_NEAR(s.after->area, polygon_area(50, 4), 1e-9);
  }
}

TEST(Profile, OfATorusHasItsSectionsAndItsCurvature) {
  vessels::IdealisedVessel vessel;
  vessel.stenosis = 0;
  vessel.radius = 3;
  vessel.bend_angle = pi / 3;
  vessel.edge_length = 0.4;
  const TestVessel bent = tests::idealised(vessel);
  const double bend_radius = 0.5 * vessel.length / vessel.bend_angle;  // the middle half turns
  const Profile profile = profile_of(bent, bent, true, 17, 43, 0.3);
  // Facets cut corners around and along: by e^2 / (8 R) at most each, for rows e apart on average
  // and up to 1 + R / bend radius times as far on the outer side.
  const double outer = vessel.edge_length * (1 + 3 / bend_radius);
  const double sag = outer * outer / 8 * (1 / 3.0 + 1 / (bend_radius - 3)) * 1.3;
  for (const Station& s : profile.stations) {
    ASSERT_TRUE(s.whole_before());
    EXPECT_LE(s.before->equivalent_diameter, 6 + 1e-9);
    EXPECT_GE(s.before->equivalent_diameter, 6 - 2 * sag);
  }
  // Smoothing over w, half a radius, and once more on what it took away leaves all but (w / bend
  // radius)^4 of a bend, and the polyline's corners, 0.5 mm apart, all but exp(-(2 pi w / 0.5)^2 /
  // 2) of their turns. It looks 3 w to both sides, twice: the middle knows neither the straight
  // parts nor the ends.
  const std::size_t n = profile.stations.size();
  for (std::size_t i = n / 2 - 10; i < n / 2 + 10; ++i)
    EXPECT_NEAR(profile.stations[i].curvature_before, 1 / bend_radius, 2e-3 / bend_radius);
}

TEST(Profile, FollowsAVesselThatWentStraight) {
  vessels::IdealisedVessel vessel;
  vessel.stenosis = 0;
  vessel.radius = 3;
  vessel.edge_length = 0.4;
  vessel.bend_angle = pi / 9;
  const TestVessel bent = tests::idealised(vessel);
  vessel.bend_angle = 0;
  const TestVessel straight = tests::idealised(vessel);
  ASSERT_EQ(bent.surface.mesh.triangles.size(), straight.surface.mesh.triangles.size());
  // Moved so that it overlaps the bent one in the middle.
  TestVessel after = straight;
  const Polyline axis = vessels::idealised_axis(vessel, 0.5);
  const Vec3 along =
      (bent.centerline.branches[0].points.back() - bent.centerline.branches[0].points.front())
          .normalized();
  const Eigen::Quaterniond turn = Eigen::Quaterniond::FromTwoVectors(Vec3::UnitZ(), along);
  const std::vector<double> arc = arc_lengths(bent.centerline.branches[0].points);
  const Vec3 middle = point_at(bent.centerline.branches[0].points, arc, 30);
  std::vector<Vec3> points;
  for (const Vec3& x : straight.surface.mesh.points)
    points.push_back(middle + turn * (x - Vec3(0, 0, 30)));
  after.surface = vessels::make_surface({points, straight.surface.mesh.triangles}, "straight");
  for (const bool same : {true, false}) {
    const Profile profile = profile_of(bent, after, same, 15, 45, 0.3);
    double before = 0, turned = 0;
    for (std::size_t i = 10; i + 10 < profile.stations.size(); ++i) {
      ASSERT_TRUE(profile.stations[i].whole_after()) << i << (same ? " carried" : " cut");
      EXPECT_NEAR(profile.stations[i].after->equivalent_diameter, 6, 0.03);
      before += profile.stations[i].curvature_before;
      turned += profile.stations[i].curvature_after;
    }
    EXPECT_LT(turned, 0.1 * before) << (same ? "carried" : "cut");
  }
}

TEST(Profile, IsNothingAtOpenEndsAndBehindCaps) {
  const TestVessel open = tests::lathe(20, 40, 21, [](double) { return 3.0; });
  const Profile profile = profile_of(open, open, true, 0, 20, 0.5);
  // Cut exactly at its first ring of vertices a tube is closed by none of its triangles.
  EXPECT_FALSE(profile.stations.back().before && profile.stations.front().before);
  EXPECT_TRUE(profile.stations[5].before);
  EXPECT_FALSE(profile.stations[5].branch_before);

  TriangleMesh capped = tests::tube(3, 20, 40, 21);
  for (const int ring : {0, 20}) {
    capped.points.emplace_back(0, 0, ring);
    const int centre = static_cast<int>(capped.points.size()) - 1;
    for (int j = 0; j < 40; ++j) {
      const int a = ring * 40 + j, b = ring * 40 + (j + 1) % 40;
      capped.triangles.push_back(ring == 0 ? Triangle{centre, b, a} : Triangle{centre, a, b});
    }
  }
  const vessels::Surface surface = vessels::make_surface(capped, "capped");
  const CutSurface cut(surface);
  EXPECT_TRUE(cut.section(Vec3(0, 0, 10), Vec3::UnitZ(), 9));
  EXPECT_FALSE(cut.section(Vec3(0, 0, 1), Vec3(1, 0, 1), 9)) << "cuts through the cap";
}

TEST(Profile, FlagsSectionsThatRunIntoABranchAndNoOthers) {
  for (const double angle : {pi / 2, pi / 3}) {
    const TestVessel fork = tests::forked(angle);
    const Profile profile = profile_of(fork, fork, true, 4, 36, 0.25);
    // The branch's wall meets the trunk's between these heights on the trunk's side...
    const double lean = tests::kTrunk / std::tan(angle);
    const double half = tests::kBranch / std::sin(angle);
    for (const Station& s : profile.stations) {
      const double up = s.arc_length - tests::kFork;
      const bool within = up > lean - half + 0.3 && up < lean + half - 0.3;
      // ... and leaves it by a radius more on its obtuse side.
      const bool beyond = up < -tests::kBranch || up > lean + half + 2.5 * tests::kBranch;
      if (within) {
        EXPECT_TRUE(s.branch_before) << s.arc_length;
      }
      if (!beyond) continue;
      EXPECT_FALSE(s.branch_before) << s.arc_length;
      ASSERT_TRUE(s.before);
      // Level set surfaces lie on the circle in the mean: within the sag of facets of a voxel and
      // a tenth of a voxel.
      const double h = tests::kForkVoxel;
      EXPECT_NEAR(s.before->equivalent_diameter, 2 * tests::kTrunk,
                  2 * (h * h / (8 * tests::kTrunk) + 0.1 * h));
    }
  }
}

}  // namespace
}  // namespace vstent::measure
