// Ostia and what covers them, on a fork of two tubes.
#include <gtest/gtest.h>

#include "tests/measure/vessels.hpp"

namespace vstent::measure {
namespace {

using std::numbers::pi;
using tests::kBranch;
using tests::kFork;
using tests::kTrunk;
using tests::TestVessel;

StentBody bar(double across, double radius) {
  sdf::Solid solid;
  solid.segments.push_back({Vec3(across, 0, 10), Vec3(across, 0, 30), radius, radius, -1, -1});
  return StentBody(sdf::voxelise(solid, {0.1, 3}));
}

/// The branches of a fork that became `after`, with a stent in it or none.
std::vector<SideBranch> branches_of(const TestVessel& fork, const vessels::Surface& after,
                                    const TriangleMesh& stent = {}) {
  const CutSurface before(fork.surface), then(after);
  const vessels::CenterlinePath way = vessels::paths(fork.centerline, 1).front();
  const Profile profile = sample_profile(before, then, true, fork.centerline, way, 2, 38, 0.5);
  return measure_side_branches(before, then, true, profile, fork.centerline, way, stent);
}

TEST(SideBranch, HasTheOstiumOfItsTubeWhateverItsAngle) {
  for (const double angle : {pi / 2, pi / 3, pi / 4}) {
    const TestVessel fork = tests::forked(angle);
    const std::vector<SideBranch> branches = branches_of(fork, fork.surface);
    ASSERT_EQ(branches.size(), 1u);
    const SideBranch& b = branches[0];
    EXPECT_EQ(b.branch, 2);
    ASSERT_TRUE(b.ostium_before && b.ostium_after);
    // Within the fillet that facets of a voxel leave at the acute corner.
    EXPECT_NEAR(*b.ostium_before, pi * kBranch * kBranch, 0.05 * pi * kBranch * kBranch)
        << "at " << angle;
    EXPECT_EQ(*b.ostium_before, *b.ostium_after);
    EXPECT_FALSE(b.coverage);
    // Somewhere over the branch's root.
    EXPECT_GT(b.arc_length, kFork - 1);
    EXPECT_LT(b.arc_length, kFork + (kTrunk + 3 * kBranch) / std::tan(angle) + 1);
  }
}

TEST(SideBranch, KeepsItsLoopWhenTheWallMoves) {
  const TestVessel fork = tests::forked(pi / 2);
  // Longer along z by a tenth: the loop, across x, becomes an ellipse.
  TriangleMesh mesh = fork.surface.mesh;
  for (Vec3& x : mesh.points) x.z() = kFork + 1.1 * (x.z() - kFork);
  const auto branches = branches_of(fork, vessels::make_surface(mesh, "after"));
  ASSERT_EQ(branches.size(), 1u);
  EXPECT_NEAR(*branches[0].ostium_after / *branches[0].ostium_before, 1.1, 1e-9);
  EXPECT_NEAR(*branches[0].symmetry_after / *branches[0].symmetry_before, 1 / 1.1, 0.03);
}

TEST(SideBranch, IsCoveredByWhatPassesBeforeIt) {
  const TestVessel fork = tests::forked(pi / 2);
  const auto coverage = [&](const StentBody& stent) {
    const auto branches = branches_of(fork, fork.surface, stent.surface());
    return branches.size() == 1 ? branches[0].coverage.value_or(-1) : -2;
  };
  EXPECT_EQ(coverage(tests::straight_stent(10, 30, 3.8)), 100);
  EXPECT_EQ(coverage(tests::straight_stent(28, 36, 3.8)), 0);
  // A bar of half width w along the trunk before the ostium hides a strip of a disc: w above and
  // below a diameter, 2 (w sqrt(r^2 - w^2) + r^2 asin(w / r)) of pi r^2.
  const double w = 0.4, r = kBranch;
  const double strip = 2 * (w * std::sqrt(r * r - w * w) + r * r * std::asin(w / r)) / (pi * r * r);
  // The strip's two edges may be off by half a step of the grid and by facets of 0.1 mm: 0.02 mm
  // each on a width of 0.8 mm; the ostium's diameter by as much on 4 mm.
  EXPECT_NEAR(coverage(bar(3.4, w)), 100 * strip, 100 * strip * (2 * 0.02 / (2 * w) + 0.01));
  EXPECT_EQ(coverage(bar(-3.4, w)), 0) << "behind the trunk's axis";
}

TEST(Measure, GoesAlongTheBranchesThatTheStentLiesIn) {
  const TestVessel fork = tests::forked(pi / 2);
  const StentBody across_the_root = bar(3.4, 0.4);
  const Metrics m =
      measure({fork.surface, fork.surface, fork.centerline, &across_the_root}).metrics;
  EXPECT_NEAR(m.treated_from, 10, 0.5);
  EXPECT_NEAR(m.treated_to, 30, 0.5);
}

}  // namespace
}  // namespace vstent::measure
