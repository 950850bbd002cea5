// Stents that give way to the wall, in vessels whose answers are known.
#include <gtest/gtest.h>
#include <oneapi/tbb/global_control.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "sdf/polyline.hpp"
#include "stents/axis.hpp"
#include "tests/data.hpp"
#include "tests/deployment/whole_run.hpp"
#include "vessels/error.hpp"
#include "vessels/idealised.hpp"

namespace vstent::deployment {
namespace {

using nlohmann::json;
using tests::TemporaryFolder;
using tests::WholeRun;

constexpr double kRadius = 5, kMiddle = 30;  // of the vessel, and of its lesion along z

vessels::IdealisedVessel eccentric(double eccentricity = 1, double edge = 0.8) {
  vessels::IdealisedVessel vessel;
  vessel.stenosis = 0.5;
  vessel.eccentricity = eccentricity;
  vessel.edge_length = edge;
  return vessel;
}

Case make_case(const TemporaryFolder& folder, const vessels::IdealisedVessel& vessel,
               const json& stent) {
  const vessels::Surface surface =
      vessels::make_surface(vessels::idealised_vessel(vessel), "ideal");
  vessels::write_surface(surface, surface.mesh.points,
                         std::vector<char>(surface.mesh.points.size(), 0), folder / "vessel.vtp");
  json whole = {{"at", "lesion"}, {"length", "24mm"}, {"diameter", "10mm"}};
  whole.update(stent);
  return tests::make_case(folder / "vessel.vtp", "mm", whole);
}

WholeRun run(const vessels::IdealisedVessel& vessel, const json& stent) {
  const TemporaryFolder folder;
  return tests::run(folder, make_case(folder, vessel, stent));
}

struct Walls {
  double near = 0, far = 0;  // radius from the vessel's axis over that of the healthy vessel
};

/// Of the written surface, over 5 mm around the lesion's middle: means over 90 degrees around the
/// side where the lumen is (x > 0) and around the lesion.
Walls stretches(const TriangleMesh& before, const std::vector<Vec3>& after) {
  Walls sum;
  int near = 0, far = 0;
  for (std::size_t v = 0; v < after.size(); ++v) {
    const Vec3& x = before.points[v];
    if (std::abs(x.z() - kMiddle) > 2.5) continue;
    // Around the lumen's own middle: the lesion touches the vessel's axis.
    const double centre = kRadius - 0.5 * 0.5 * 2 * kRadius;
    const double angle = std::atan2(x.y(), x.x() - centre);
    const double stretch = std::hypot(after[v].x(), after[v].y()) / kRadius;
    if (std::abs(angle) < std::numbers::pi / 4) sum.near += stretch, ++near;
    if (std::abs(angle) > 3 * std::numbers::pi / 4) sum.far += stretch, ++far;
  }
  return {sum.near / near, sum.far / far};
}

Walls written_stretches(const vessels::IdealisedVessel& vessel, const json& stent,
                        Outcome* outcome = nullptr) {
  const TemporaryFolder folder;
  const WholeRun r = tests::run(folder, make_case(folder, vessel, stent));
  EXPECT_TRUE(r.outcome.converged);
  EXPECT_EQ(r.metrics.inverted_triangles, 0u);
  EXPECT_EQ(r.metrics.new_self_intersections, 0u);
  EXPECT_NEAR(r.metrics.opened_mean_over_target, 1, 0.005);
  const vessels::Surface written =
      vessels::read_surface(folder / "stented.vtp", vessels::LengthUnit::mm);
  if (outcome) *outcome = r.outcome;
  return stretches(r.setup.surface.mesh, written.mesh.points);
}

// A stent of 10 mm in a vessel of 10 mm whose lesion takes half of the diameter from one side. On
// the lumen's own axis, 2.5 mm off the vessel's, it blows the healthy wall up by nearly a half and
// leaves the lesion as far behind. Where it gives way both walls come to where a healthy one is.
TEST(GiveWay, WallsOfAnEccentricStenosisAreStretchedAlike) {
  const Walls prescribed = written_stretches(eccentric(), json::object());
  EXPECT_GT(prescribed.near, 1.4);
  EXPECT_LT(prescribed.far, 0.6);
  Outcome outcome;
  const Walls given = written_stretches(
      eccentric(), {{"gives_way", true}, {"bending_stiffness_N_mm2", 20}}, &outcome);
  std::printf("near and far: %.3f %.3f, giving way %.3f %.3f\n", prescribed.near, prescribed.far,
              given.near, given.far);
  EXPECT_LT(given.near, 1.05);
  EXPECT_LT(std::abs(given.near - given.far), 0.08);
  ASSERT_TRUE(outcome.given_way.has_value());
  EXPECT_LT(outcome.given_way->unbalanced, 2e-4);
  EXPECT_GT(outcome.given_way->shift, 2);
  // The lesion's plane of symmetry is the axis's.
  for (const Vec3& x : outcome.axis) EXPECT_NEAR(x.y(), 0, 0.01 * kRadius);
  // The better the stent bends, the more so.
  const Walls softer =
      written_stretches(eccentric(), {{"gives_way", true}, {"bending_stiffness_N_mm2", 1}});
  EXPECT_LT(std::abs(softer.near - softer.far), 0.03);
}

// What is unbalanced, 2e-4 of the contact force at most, moves a stent that all sides press alike
// by less than 0.1 % of its radius.
TEST(GiveWay, AConcentricStentStaysWhereItIs) {
  const WholeRun r = run(eccentric(0), {{"gives_way", true}, {"bending_stiffness_N_mm2", 20}});
  EXPECT_TRUE(r.outcome.converged);
  EXPECT_LT(r.outcome.given_way->shift, 0.001 * kRadius);
}

TEST(GiveWay, AStentThatDoesNotBendShiftsAndTurnsAsAWhole) {
  const WholeRun r = run(eccentric(), {{"gives_way", true}});
  EXPECT_TRUE(r.outcome.converged);
  EXPECT_GT(r.outcome.given_way->shift, 0.5);
  const Polyline& before = r.setup.placement.axis;
  const Polyline& after = r.outcome.axis;
  for (std::size_t i = 0; i < before.size(); ++i)
    EXPECT_NEAR((after[i] - after.front()).norm(), (before[i] - before.front()).norm(), 1e-9);
  // Its middle does not slide along it.
  EXPECT_NEAR(after[after.size() / 2].z(), before[before.size() / 2].z(), 0.05);
  const WholeRun stiff = run(eccentric(), {{"gives_way", true}, {"bending_stiffness_N_mm2", 1e8}});
  for (std::size_t i = 0; i < before.size(); ++i)
    EXPECT_LT((stiff.outcome.axis[i] - after[i]).norm(), 0.004 * kRadius);
}

// A straight stent in a vessel that turns by 45 degrees over 30 mm: how straight it makes the
// vessel is between what closed cells prescribe and the vessel's own bend.
TEST(GiveWay, AStraightStentFollowsTheVesselTheBetterTheSofterItBends) {
  vessels::IdealisedVessel curved = eccentric(0, 1.0);
  curved.bend_angle = std::numbers::pi / 4;
  const auto bend = [&](double stiffness) {
    const TemporaryFolder folder;
    const deployment::Setup setup = prepare(make_case(
        folder, curved,
        {{"cell", "closed"}, {"gives_way", true}, {"bending_stiffness_N_mm2", stiffness}}));
    const Outcome outcome = deploy(setup);
    EXPECT_TRUE(outcome.converged) << stiffness;
    EXPECT_NEAR(length(outcome.axis), length(setup.placement.axis), 1e-9);
    return stents::end_tangent_angle(outcome.axis) /
           stents::end_tangent_angle(setup.placement.axis);
  };
  const double stiff = bend(1e7), medium = bend(100), soft = bend(0.1);
  std::printf("bends %g %g %g\n", stiff, medium, soft);
  EXPECT_LT(stiff, 0.01);
  EXPECT_GT(medium, stiff + 0.1);
  EXPECT_GT(soft, medium + 0.1);
  EXPECT_GT(soft, 0.8);
}

TEST(GiveWay, NeitherThreadsNorStepsShowInTheResult) {
  const TemporaryFolder folder;
  const json stent = {
      {"gives_way", true}, {"bending_stiffness_N_mm2", 20}, {"radial_stiffness_N_per_mm2", 20}};
  const Case c = make_case(folder, eccentric(0.7, 1.2), stent);
  const deployment::Setup setup = prepare(c);
  const Outcome reference = deploy(setup);
  EXPECT_TRUE(reference.converged);
  for (const std::size_t threads : {1u, 2u, 3u, 8u}) {
    const oneapi::tbb::global_control limit(oneapi::tbb::global_control::max_allowed_parallelism,
                                            threads);
    const Outcome again = deploy(prepare(c));
    EXPECT_EQ(again.positions, reference.positions) << threads << " threads";
    EXPECT_EQ(again.axis, reference.axis) << threads << " threads";
  }
  deployment::Setup half = setup;
  half.specification.growth_per_step = 0.5 * *setup.specification.growth_per_step;
  const Outcome other = deploy(half);
  double largest = 0;
  for (std::size_t i = 0; i < other.axis.size(); ++i)
    largest = std::max(largest, (other.axis[i] - reference.axis[i]).norm() +
                                    std::abs(other.radii[i] - reference.radii[i]));
  for (std::size_t v = 0; v < other.positions.size(); ++v)
    largest = std::max(largest, (other.positions[v] - reference.positions[v]).norm());
  std::printf("half step: %g mm\n", largest);
  EXPECT_GT(largest, 0);
  EXPECT_LT(largest, 0.001 * kRadius);
}

}  // namespace
}  // namespace vstent::deployment
