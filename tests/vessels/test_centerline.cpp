#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <cmath>
#include <fstream>
#include <numbers>

#include "sdf/level_set.hpp"
#include "sdf/polyline.hpp"
#include "tests/data.hpp"
#include "vessels/centerline.hpp"
#include "vessels/check.hpp"
#include "vessels/error.hpp"
#include "vessels/idealised.hpp"
#include "vessels/lumen_ends.hpp"

namespace vstent::vessels {
namespace {

using tests::shared_data;

// The last level of the centring puts candidates 0.025 R apart in a normal disc: a point lies
// within half their square's diagonal, 0.018 R, of the ridge; smoothing only averages that.
constexpr double kCentring = 0.02;

std::size_t leaves(const Centerline& centerline) { return paths(centerline).size(); }

void expect_well_formed(const Centerline& centerline) {
  for (std::size_t b = 0; b < centerline.branches.size(); ++b) {
    const CenterlineBranch& branch = centerline.branches[b];
    EXPECT_EQ(branch.id, static_cast<int>(b));
    EXPECT_LT(branch.parent, branch.id);
    EXPECT_EQ(branch.parent < 0, b == 0);
    ASSERT_GE(branch.points.size(), 2u);
    ASSERT_EQ(branch.points.size(), branch.radii.size());
    if (branch.parent >= 0) {
      EXPECT_EQ(branch.points.front(),
                centerline.branches[static_cast<std::size_t>(branch.parent)].points.back());
    }
    for (const double radius : branch.radii) EXPECT_TRUE(std::isfinite(radius) && radius >= 0);
  }
}

/// Every boundary loop covered by a fan, as a mesher caps it.
TriangleMesh capped(const TriangleMesh& open) {
  return find_lumen_ends(make_surface(open, "generated")).closed;
}

void expect_on_axis(const Centerline& centerline, const IdealisedVessel& vessel) {
  expect_well_formed(centerline);
  ASSERT_EQ(centerline.branches.size(), 1u);
  const Polyline axis = idealised_axis(vessel, 0.01);
  const std::vector<double> s = arc_lengths(axis);
  const CenterlineBranch& branch = centerline.branches.front();
  // The way is as long as the axis, give or take a centring error at either end.
  EXPECT_NEAR(length(branch.points), s.back(), 2.0 * vessel.radius * kCentring + 0.01 * s.back());
  for (std::size_t i = 0; i < branch.points.size(); ++i) {
    const PolylinePlace place = vstent::nearest_place(axis, s, branch.points[i]);
    const double radius = idealised_radius(vessel, place.arc_length);
    EXPECT_LT(std::sqrt(place.squared_distance), kCentring * vessel.radius)
        << "at " << place.arc_length << " mm";
    // Chords of the edge length cut e^2 / 8R into a circle; the narrowing slopes, so that the ball
    // touches beside.
    const double chord = vessel.edge_length * vessel.edge_length / (8.0 * radius);
    double inscribed = radius;
    for (double along = -2.0 * vessel.radius; along <= 2.0 * vessel.radius; along += 0.05) {
      inscribed = std::min(inscribed,
                           std::hypot(along, idealised_radius(vessel, place.arc_length + along)));
    }
    EXPECT_LT(branch.radii[i], radius * (1.0 + 1e-9) + kCentring * vessel.radius);
    EXPECT_GT(branch.radii[i], inscribed - chord - kCentring * vessel.radius)
        << "at " << place.arc_length << " mm";
  }
}

TEST(ExtractCenterline, FollowsTheAxisOfAStraightTubeOpenOrCapped) {
  IdealisedVessel vessel;
  vessel.stenosis = 0;
  const TriangleMesh mesh = idealised_vessel(vessel);
  expect_on_axis(extract_centerline(make_surface(mesh, "open")), vessel);
  expect_on_axis(extract_centerline(make_surface(capped(mesh), "capped")), vessel);
}

TEST(ExtractCenterline, FollowsTheAxisOfABentTubeOpenOrCapped) {
  IdealisedVessel vessel;
  vessel.stenosis = 0;
  vessel.bend_angle = 0.5 * std::numbers::pi;
  const TriangleMesh mesh = idealised_vessel(vessel);
  expect_on_axis(extract_centerline(make_surface(mesh, "open")), vessel);
  expect_on_axis(extract_centerline(make_surface(capped(mesh), "capped")), vessel);
}

TEST(ExtractCenterline, PassesThroughAStenosisOf90Percent) {
  IdealisedVessel vessel;
  vessel.stenosis = 0.9;
  vessel.edge_length = 0.4;
  const Centerline centerline = extract_centerline(make_surface(idealised_vessel(vessel), "tube"));
  expect_on_axis(centerline, vessel);
  const auto& radii = centerline.branches.front().radii;
  const double tightest = idealised_radius(vessel, 0.5 * vessel.length);
  EXPECT_NEAR(*std::min_element(radii.begin(), radii.end()), tightest, 0.05 * tightest);
}

TEST(ExtractCenterline, StaysInsideAnEccentricStenosis) {
  IdealisedVessel vessel;
  vessel.stenosis = 0.8;
  vessel.eccentricity = 1;
  vessel.edge_length = 0.4;
  const Centerline centerline = extract_centerline(make_surface(idealised_vessel(vessel), "tube"));
  expect_well_formed(centerline);
  const auto& radii = centerline.branches.front().radii;
  const double tightest = idealised_radius(vessel, 0.5 * vessel.length);
  EXPECT_NEAR(*std::min_element(radii.begin(), radii.end()), tightest, 0.05 * tightest);
}

TEST(ExtractCenterline, FindsTheTipsOfAClosedTreeWithoutCaps) {
  sdf::Solid solid;
  const Vec3 fork(0, 0, 30);
  const std::array<Vec3, 3> tips{Vec3(0, 0, 0), Vec3(18, 0, 54), Vec3(-18, 0, 54)};
  const std::array<double, 3> radii{4, 3, 2.5};
  for (std::size_t i = 0; i < 3; ++i) {
    solid.segments.push_back({tips[i], fork, radii[i], radii[i], -1});
  }
  sdf::VoxelOptions voxels;
  voxels.voxel_size = 0.5;
  const TriangleMesh mesh = sdf::voxelise(solid, voxels).surface();
  const Centerline centerline = extract_centerline(make_surface(mesh, "tree"));
  expect_well_formed(centerline);
  EXPECT_EQ(centerline.branches.size(), 3u);
  for (std::size_t i = 0; i < 3; ++i) {
    const Vec3 middle = 0.5 * (tips[i] + fork);
    const CenterlinePlace place = nearest_place(centerline, middle);
    // The mesh is within a tenth of a voxel of the tubes away from the fork.
    EXPECT_LT(place.distance, kCentring * radii[i] + 0.1 * voxels.voxel_size);
    EXPECT_NEAR(place.radius, radii[i], kCentring * radii[i] + 0.1 * voxels.voxel_size);
    EXPECT_LT(nearest_place(centerline, tips[i]).distance, radii[i]);
  }
}

TEST(ExtractCenterline, StartsAtTheInletAskedFor) {
  IdealisedVessel vessel;
  const TriangleMesh mesh = idealised_vessel(vessel);
  ExtractionOptions options;
  options.inlet = Vec3(0, 0, vessel.length);
  const auto centerline = extract_centerline(make_surface(mesh, "tube"), options);
  EXPECT_LT((centerline.branches.front().points.front() - *options.inlet).norm(), 0.1);
  options.inlet = Vec3::Zero();
  const auto other = extract_centerline(make_surface(mesh, "tube"), options);
  EXPECT_LT(other.branches.front().points.front().norm(), 0.1);
}

TEST(ExtractCenterline, IsTheSameForAnyNumberOfThreads) {
  IdealisedVessel vessel;
  vessel.bend_angle = 1;
  const Surface surface = make_surface(idealised_vessel(vessel), "tube");
  const auto run = [&](std::size_t threads) {
    const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads);
    return extract_centerline(surface);
  };
  const Centerline one = run(1);
  const Centerline two = run(2);
  ASSERT_EQ(one.branches.size(), two.branches.size());
  EXPECT_EQ(one.branches.front().points, two.branches.front().points);
  EXPECT_EQ(one.branches.front().radii, two.branches.front().radii);
}

struct Reference {
  std::string surface, centerline;
  LengthUnit unit;
  std::size_t leaves;
};

void PrintTo(const Reference& reference, std::ostream* out) { *out << reference.surface; }

class RealVessel : public testing::TestWithParam<Reference> {};

TEST_P(RealVessel, AgreesWithItsReferenceCenterline) {
  const auto surface_path = shared_data(GetParam().surface);
  const auto centerline_path = shared_data(GetParam().centerline);
  SKIP_WITHOUT(surface_path);
  SKIP_WITHOUT(centerline_path);
  const Surface surface = read_surface(surface_path, GetParam().unit);
  const Centerline reference = read_centerline(centerline_path, GetParam().unit);
  const Centerline found = extract_centerline(surface);
  expect_well_formed(reference);
  expect_well_formed(found);
  EXPECT_EQ(leaves(reference), GetParam().leaves);
  EXPECT_EQ(leaves(found), GetParam().leaves);

  std::vector<Vec3> ends;
  for (const Centerline* tree : {&reference, &found}) {
    for (const CenterlinePath& path : paths(*tree)) {
      ends.push_back(path.points.front());
      ends.push_back(path.points.back());
    }
  }
  double distances = 0;
  double radius_errors = 0;
  int count = 0;
  for (const CenterlineBranch& branch : reference.branches) {
    for (std::size_t i = 0; i < branch.points.size(); ++i) {
      const Vec3& x = branch.points[i];
      const double radius = branch.radii[i];
      if (std::any_of(ends.begin(), ends.end(),
                      [&](const Vec3& end) { return (end - x).norm() < 2.0 * radius; })) {
        continue;
      }
      const CenterlinePlace place = nearest_place(found, x);
      distances += place.distance / radius;
      radius_errors += std::abs(place.radius / radius - 1.0);
      ++count;
    }
  }
  ASSERT_GT(count, 0);
  RecordProperty("mean_distance_percent", std::to_string(100.0 * distances / count));
  RecordProperty("mean_radius_error_percent", std::to_string(100.0 * radius_errors / count));
  EXPECT_LT(distances / count, 0.05);
  EXPECT_LT(radius_errors / count, 0.05);
}

INSTANTIATE_TEST_SUITE_P(
    SharedData, RealVessel,
    testing::Values(Reference{"aortoiliac_demo/aorta_fine.vtp", "aortoiliac_demo/aorta_fine_cl.vtp",
                              LengthUnit::cm, 2},
                    Reference{"aortoiliac_demo/rom_model_surface.vtp",
                              "aortoiliac_demo/rom_centerlines.vtp", LengthUnit::cm, 2},
                    Reference{"rpa_su201/SU201_2005_RPA1_exterior.vtp",
                              "rpa_su201/SU201_2005_RPA1_cl.vtp", LengthUnit::mm, 5},
                    Reference{"aorta_vmtk/aorta-surface-open-ends.stl",
                              "aorta_vmtk/aorta-centerline.vtp", LengthUnit::mm, 2},
                    Reference{"aorta_vmtk/aorta-surface.vtp",
                              "aorta_vmtk/aorta-centerline-attribute-branches.vtp", LengthUnit::mm,
                              2}));

TEST(ExtractCenterline, FindsTheCoarctationAndAllFourOutletsOpenOrCapped) {
  const auto open_path = shared_data("coa_patient1/wall_aorta.stl");
  const auto capped_path = shared_data("coa_patient1/capped_oriented.vtp");
  SKIP_WITHOUT(open_path);
  SKIP_WITHOUT(capped_path);
  const Centerline open = extract_centerline(read_surface(open_path, LengthUnit::mm));
  const Centerline closed = extract_centerline(read_surface(capped_path, LengthUnit::mm));
  expect_well_formed(open);
  EXPECT_EQ(leaves(open), 4u);
  EXPECT_EQ(leaves(closed), 4u);
  EXPECT_EQ(open.branches.size(), closed.branches.size());
  const CenterlinePlace tightest = nearest_place(open, Vec3(0.36, 0.16, -3.78));
  EXPECT_GT(tightest.radius, 2.1);
  EXPECT_LT(tightest.radius, 2.8);
  EXPECT_LT(tightest.distance, tightest.radius);
  for (const CenterlineBranch& branch : open.branches) {
    for (std::size_t i = 0; i < branch.points.size(); ++i) {
      EXPECT_LT(nearest_place(closed, branch.points[i]).distance,
                2.0 * kCentring * branch.radii[i] + 0.05);
    }
  }
}

TEST(ExtractCenterline, RunsThroughTheOtherRealVessels) {
  const std::vector<std::tuple<std::string, LengthUnit, double>> vessels{
      {"veingraft_stenosis/capped.vtp", LengthUnit::cm, 3.43},
      {"coronary_branch/fine.stl", LengthUnit::mm, 0.97},
      {"coronary_branch/coarse.stl", LengthUnit::mm, 0.97}};
  for (const auto& [name, unit, tightest_radius] : vessels) {
    SKIP_WITHOUT(shared_data(name));
    const Centerline centerline = extract_centerline(read_surface(shared_data(name), unit));
    expect_well_formed(centerline);
    EXPECT_EQ(centerline.branches.size(), 1u) << name;
    const auto& radii = centerline.branches.front().radii;
    // The inscribed ball is smaller than the circle of equal area that the vessels are described
    // by.
    EXPECT_LT(*std::min_element(radii.begin(), radii.end()), 1.1 * tightest_radius) << name;
    EXPECT_GT(*std::min_element(radii.begin(), radii.end()), 0.5 * tightest_radius) << name;
  }
}

TEST(ExtractCenterline, RefusesASphere) {
  sdf::Solid ball;
  ball.segments.push_back({Vec3::Zero(), Vec3(0, 0, 1e-3), 5, 5, -1});
  sdf::VoxelOptions voxels;
  voxels.voxel_size = 0.5;
  EXPECT_THROW(extract_centerline(make_surface(sdf::voxelise(ball, voxels).surface(), "ball")),
               Error);
}

Centerline small_tree() {
  Centerline tree;
  tree.branches.push_back({0, -1, {Vec3(0, 0, 0), Vec3(0, 0, 1), Vec3(0, 0.1, 2)}, {3, 2, 2}});
  tree.branches.push_back({1, 0, {Vec3(0, 0.1, 2), Vec3(1, 0, 3), Vec3(2, 0, 4)}, {2, 1, 1}});
  tree.branches.push_back({2, 0, {Vec3(0, 0.1, 2), Vec3(-1, 0, 3)}, {2, 1.5}});
  return tree;
}

TEST(CenterlineTree, PathsRunFromInletToLeavesWidestFirst) {
  const Centerline tree = small_tree();
  const auto all = paths(tree);
  ASSERT_EQ(all.size(), 2u);
  EXPECT_EQ(all[0].branch_of_point, (std::vector<int>{0, 0, 0, 2}));
  EXPECT_EQ(all[1].branch_of_point, (std::vector<int>{0, 0, 0, 1, 1}));
  EXPECT_DOUBLE_EQ(all[1].arc_length.back(),
                   length(tree.branches[0].points) + length(tree.branches[1].points));
  ASSERT_EQ(paths(tree, 1).size(), 1u);
  EXPECT_EQ(paths(tree, 1).front().points, all[1].points);
  EXPECT_EQ(paths(tree, 0).size(), 2u);
}

TEST(CenterlineTree, NearestPlaceIsThatOfTheBranchesTriedOneByOne) {
  const CenterlinePlace place = nearest_place(small_tree(), Vec3(1.5, 1, 3.5));
  EXPECT_EQ(place.branch, 1);
  EXPECT_NEAR((place.point - Vec3(1.5, 0, 3.5)).norm(), 0, 1e-12);
  EXPECT_NEAR(place.distance, 1, 1e-12);
  EXPECT_NEAR(place.radius, 1, 1e-12);
}

class CenterlineFile : public testing::Test {
 protected:
  std::filesystem::path path(const std::string& name) const {
    const auto folder = std::filesystem::path(testing::TempDir()) / "vstent_centerline_test";
    std::filesystem::create_directories(folder);
    return folder / name;
  }
  std::filesystem::path write(const std::string& name, const std::string& text) const {
    std::ofstream(path(name)) << text;
    return path(name);
  }
  /// A .vtp of the given points and two-point lines or polylines.
  std::filesystem::path polylines(const std::string& name,
                                  const std::vector<Polyline>& lines) const {
    write_polylines(lines, {}, {}, path(name));
    return path(name);
  }
};

TEST_F(CenterlineFile, ReadsWhatWasWritten) {
  const Centerline tree = small_tree();
  for (const LengthUnit unit : {LengthUnit::mm, LengthUnit::cm}) {
    write_centerline(tree, unit, path("tree.vtp"));
    const Centerline read = read_centerline(path("tree.vtp"), unit);
    ASSERT_EQ(read.branches.size(), tree.branches.size());
    for (std::size_t b = 0; b < tree.branches.size(); ++b) {
      EXPECT_EQ(read.branches[b].parent, tree.branches[b].parent);
      ASSERT_EQ(read.branches[b].points.size(), tree.branches[b].points.size());
      for (std::size_t i = 0; i < tree.branches[b].points.size(); ++i) {
        EXPECT_LT((read.branches[b].points[i] - tree.branches[b].points[i]).norm(), 1e-5);
        EXPECT_NEAR(read.branches[b].radii[i], tree.branches[b].radii[i], 1e-5);
      }
    }
  }
}

TEST_F(CenterlineFile, MergesBareLinesThatShareTheirTrunk) {
  Polyline left;
  Polyline right;
  for (int i = 0; i <= 40; ++i) {
    const double z = 0.5 * i;
    const double apart = i < 20 ? 0.0 : 0.3 * (i - 20);
    left.emplace_back(apart, 0, z);
    right.emplace_back(i < 20 ? 1e-3 * (i % 3) : -apart, 0, z);
  }
  const Centerline tree = read_centerline(polylines("two.vtp", {left, right}), LengthUnit::mm);
  expect_well_formed(tree);
  ASSERT_EQ(tree.branches.size(), 3u);
  EXPECT_LT((tree.branches[0].points.front() - left.front()).norm(), 0.01);
  EXPECT_NEAR(length(tree.branches[0].points), 10.0, 1.0);  // parted within two points of the fork
  EXPECT_EQ(tree.branches[0].radii.front(), 0);             // unknown
}

TEST_F(CenterlineFile, RefusesWhatIsNoTree) {
  const Polyline square{Vec3(0, 0, 0), Vec3(9, 0, 0), Vec3(9, 9, 0), Vec3(0, 9, 0), Vec3(0, 0, 0)};
  EXPECT_THROW(read_centerline(polylines("loop.vtp", {square}), LengthUnit::mm), Error);
  const Polyline a{Vec3(0, 0, 0), Vec3(0, 0, 1), Vec3(0, 0, 2)};
  const Polyline far{Vec3(90, 0, 0), Vec3(90, 0, 1), Vec3(90, 0, 2)};
  EXPECT_THROW(read_centerline(polylines("apart.vtp", {a, far}), LengthUnit::mm), Error);
}

TEST_F(CenterlineFile, RefusesDamagedFilesWithOneLine) {
  write_centerline(small_tree(), LengthUnit::mm, path("whole.vtp"));
  std::ifstream whole(path("whole.vtp"), std::ios::binary);
  const std::string bytes((std::istreambuf_iterator<char>(whole)), {});
  const std::vector<std::filesystem::path> bad{path("missing.vtp"), write("empty.vtp", ""),
                                               write("text.vtp", "no file of lines"),
                                               write("cut.vtp", bytes.substr(0, bytes.size() / 2))};
  for (const auto& file : bad) {
    try {
      read_centerline(file, LengthUnit::mm);
      ADD_FAILURE() << file << " was read";
    } catch (const Error& error) {
      EXPECT_EQ(error.code(), ExitCode::input_file);
      EXPECT_NE(std::string(error.what()).find(file.filename().string()), std::string::npos);
      EXPECT_EQ(std::string(error.what()).find('\n'), std::string::npos);
    }
  }
}

TEST_F(CenterlineFile, FillsUnknownRadiiFromTheWall) {
  IdealisedVessel vessel;
  vessel.stenosis = 0;
  Centerline axis;
  axis.branches.push_back({0, -1, idealised_axis(vessel, 1.0), {}});
  axis.branches[0].radii.assign(axis.branches[0].points.size(), 0.0);
  axis.branches[0].radii[3] = 7;
  fill_radii(axis, make_surface(capped(idealised_vessel(vessel)), "tube"));
  EXPECT_EQ(axis.branches[0].radii[3], 7);
  // Chords: e^2 / 8R below the circle, at most; the ends' caps do not count.
  const double chord = vessel.edge_length * vessel.edge_length / (8.0 * vessel.radius);
  EXPECT_NEAR(axis.branches[0].radii.front(), vessel.radius, 1.5 * chord);
  EXPECT_NEAR(axis.branches[0].radii[20], vessel.radius, 1.5 * chord);
}

}  // namespace
}  // namespace vstent::vessels
