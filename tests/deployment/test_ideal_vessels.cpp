// Whole runs on generated vessels, whose answers are known.
#include <gtest/gtest.h>
#include <oneapi/tbb/global_control.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>

#include "deployment/stent_model.hpp"
#include "sdf/polyline.hpp"
#include "stents/axis.hpp"
#include "tests/deployment/whole_run.hpp"
#include "vessels/error.hpp"
#include "vessels/idealised.hpp"

namespace vstent::deployment {
namespace {

using nlohmann::json;
using tests::TemporaryFolder;
using tests::WholeRun;

constexpr double kEdge = 0.8;

vessels::IdealisedVessel stenosed(double bend_angle = 0) {
  vessels::IdealisedVessel vessel;
  vessel.stenosis = 0.5;
  vessel.bend_angle = bend_angle;
  vessel.edge_length = kEdge;
  return vessel;
}

void write(const vessels::IdealisedVessel& vessel, const std::filesystem::path& path) {
  const vessels::Surface surface =
      vessels::make_surface(vessels::idealised_vessel(vessel), "ideal");
  vessels::write_surface(surface, surface.mesh.points,
                         std::vector<char>(surface.mesh.points.size(), 0), path);
}

Case make_case(const std::filesystem::path& surface, const json& stent) {
  json whole = {{"at", "lesion"}, {"length", "24mm"}, {"diameter", "10mm"}};
  whole.update(stent);
  return tests::make_case(surface, "mm", whole);
}

WholeRun run(const TemporaryFolder& folder, const vessels::IdealisedVessel& vessel,
             const json& stent = json::object()) {
  write(vessel, folder / "vessel.vtp");
  return tests::run(folder, make_case(folder / "vessel.vtp", stent));
}

// With rigid contact the wall's vertices come to rest on the stent; between them, chords sag by h^2
// / (8 R).
double sag() { return kEdge * kEdge / (8 * 5); }

TEST(IdealVessel, StenosisOpensToThePrescribedDiameter) {
  const TemporaryFolder folder;
  const WholeRun r = run(folder, stenosed());
  EXPECT_TRUE(r.outcome.converged);
  EXPECT_GE(r.metrics.opened_min_diameter, 10 - 2 * sag() - 0.01);
  EXPECT_NEAR(r.metrics.opened_mean_over_target, 1, 0.005);
  EXPECT_EQ(r.metrics.inverted_triangles, 0u);
  EXPECT_EQ(r.metrics.new_self_intersections, 0u);
  EXPECT_EQ(r.metrics.changed_outside_patch, 0u);
  EXPECT_EQ(r.metrics.openings_after, 2u);
  EXPECT_LE(r.metrics.deepest_penetration, 0.01);
}

// The sweep's order must not turn an axisymmetric case about its axis.
TEST(IdealVessel, AxisymmetricCaseDoesNotTurn) {
  const TemporaryFolder folder;
  const WholeRun r = run(folder, stenosed());
  double turn = 0;
  int counted = 0;
  for (std::size_t v = 0; v < r.outcome.positions.size(); ++v) {
    if (!r.outcome.moved[v]) continue;
    const Vec3& before = r.setup.surface.mesh.points[v];
    const Vec3& after = r.outcome.positions[v];
    turn += std::atan2(before.x() * after.y() - before.y() * after.x(),
                       before.x() * after.x() + before.y() * after.y());
    ++counted;
  }
  EXPECT_LT(std::abs(turn / counted) * 180 / std::numbers::pi, 0.05);
}

TEST(IdealVessel, OpenCellsKeepTheBendAndClosedCellsTakeItAway) {
  const TemporaryFolder folder;
  const vessels::IdealisedVessel curved = stenosed(std::numbers::pi / 3);
  const WholeRun open = run(folder, curved);
  EXPECT_GT(open.metrics.bend_before, 40);
  EXPECT_NEAR(open.metrics.bend_after, open.metrics.bend_before, 1e-9);

  const WholeRun straight = run(folder, curved, {{"cell", "closed"}});
  EXPECT_LT(straight.metrics.bend_after, 2);
  EXPECT_NEAR(length(straight.outcome.axis), length(straight.setup.placement.axis), 1e-9);
  EXPECT_EQ(straight.metrics.inverted_triangles, 0u);
  EXPECT_EQ(straight.metrics.new_self_intersections, 0u);
  // The vessel follows: the lumen's narrowest part was forced onto the straight axis.
  EXPECT_LT(straight.metrics.lumen_bend_after, 0.6 * open.metrics.lumen_bend_after);

  const WholeRun native = run(folder, curved, {{"cell", "closed"}, {"straightening", 0.0}});
  EXPECT_NEAR(native.metrics.bend_after, native.metrics.bend_before, 2);
}

TEST(IdealVessel, AutoTakesTheReferenceLumen) {
  const TemporaryFolder folder;
  write(stenosed(), folder / "vessel.vtp");
  const deployment::Setup setup = prepare(make_case(folder / "vessel.vtp", {{"diameter", "auto"}}));
  EXPECT_NEAR(*setup.specification.diameter, 10,
              0.05);  // a polygon of 39 sides lacks 0.2 % of the circle's diameter
}

TEST(IdealVessel, LesionIsFoundWhereItWasMade) {
  const TemporaryFolder folder;
  write(stenosed(), folder / "vessel.vtp");
  const deployment::Setup setup = prepare(make_case(folder / "vessel.vtp", json::object()));
  EXPECT_NEAR(setup.placement.centre, 30, 1.0);  // 60 mm long, narrowest in the middle
}

TEST(IdealVessel, TaperAndFlareReachTheirDiameters) {
  const TemporaryFolder folder;
  const WholeRun taper =
      run(folder, stenosed(), {{"diameter", "11mm"}, {"distal_diameter", "9mm"}});
  EXPECT_NEAR(taper.outcome.radii.front(), 5.5, 1e-9);
  EXPECT_NEAR(taper.outcome.radii.back(), 4.5, 1e-9);
  EXPECT_NEAR(taper.metrics.opened_mean_over_target, 1, 0.01);
  const WholeRun flare =
      run(folder, stenosed(), {{"flare", {{"diameter", "12mm"}, {"length", "4mm"}}}});
  const auto in_stent = [](const auto& station) { return station.in_stent; };
  const auto& stations = flare.metrics.stations;
  const auto& last = *std::find_if(stations.rbegin(), stations.rend(), in_stent);
  ASSERT_TRUE(last.after.has_value());
  // The flare rises by at most pi/2 (6 - 5)/4 per mm; between two rows of vertices the wall is a
  // chord of it.
  const double rise = 0.5 * std::numbers::pi * (6.0 - 5.0) / 4.0 * kEdge;
  EXPECT_NEAR(last.after->equivalent_diameter, last.target, rise);
}

TEST(IdealVessel, SoftContactEndsShortOfTheStent) {
  const TemporaryFolder folder;
  const WholeRun soft = run(folder, stenosed());
  write(stenosed(), folder / "vessel.vtp");
  Case c = make_case(folder / "vessel.vtp", json::object());
  c.contact_stiffness = 1.0;
  const deployment::Setup setup = prepare(c);
  const Outcome outcome = deploy(setup);
  const Metrics m = write_results(setup, outcome, folder.path());
  EXPECT_LT(m.narrowest_after, soft.metrics.narrowest_after - 0.05);
}

TEST(IdealVessel, ThePapersWallOpensToo) {
  const TemporaryFolder folder;
  write(stenosed(), folder / "vessel.vtp");
  Case c = make_case(folder / "vessel.vtp", json::object());
  c.wall_preset = "paper";
  const WholeRun r = tests::run(folder, c);
  EXPECT_TRUE(r.outcome.converged);
  EXPECT_EQ(r.metrics.inverted_triangles, 0u);
  EXPECT_GE(r.metrics.opened_min_diameter, 10 - 2 * sag() - 0.01);
}

TEST(IdealVessel, ResultsDoNotDependOnTheNumberOfThreads) {
  const TemporaryFolder folder;
  write(stenosed(std::numbers::pi / 4), folder / "vessel.vtp");
  const deployment::Setup setup = prepare(make_case(folder / "vessel.vtp", json::object()));
  const Outcome all = deploy(setup);
  for (const std::size_t threads : {1u, 2u, 3u, 8u}) {
    const oneapi::tbb::global_control limit(oneapi::tbb::global_control::max_allowed_parallelism,
                                            threads);
    const deployment::Setup again = prepare(make_case(folder / "vessel.vtp", json::object()));
    EXPECT_EQ(deploy(again).positions, all.positions) << threads << " threads";
  }
}

// Neither the number of sweeps nor the size of a step may show in the result: no vertex moves by
// more than 0.1 % of the stent's radius.
TEST(IdealVessel, TheShapeDoesNotDependOnIterationsOrSteps) {
  const TemporaryFolder folder;
  write(stenosed(std::numbers::pi / 4), folder / "vessel.vtp");
  const deployment::Setup setup = prepare(make_case(folder / "vessel.vtp", {{"diameter", "11mm"}}));
  const Outcome reference = deploy(setup);
  for (const auto& [growth, sweeps] : {std::pair{1.0, 2}, {0.5, 1}, {0.5, 2}}) {
    deployment::Setup other = setup;
    other.specification.growth_per_step = growth * *setup.specification.growth_per_step;
    other.specification.iterations = sweeps * *setup.specification.iterations;
    const Outcome outcome = deploy(other);
    EXPECT_GE(outcome.history.size(), reference.history.size() - 3);
    double largest = 0;
    for (std::size_t v = 0; v < reference.positions.size(); ++v)
      largest = std::max(largest, (outcome.positions[v] - reference.positions[v]).norm());
    EXPECT_GT(largest, 0) << "the options had no effect at all";
    EXPECT_LT(largest, 0.001 * 5.5) << growth << " of the step, " << sweeps << " times the sweeps";
  }
}

/// Mean radius of each ring of vertices of a straight vessel along z, by its mean place.
std::map<double, double> radius_profile(const TriangleMesh& rest,
                                        const std::vector<Vec3>& positions) {
  struct Ring {
    double z = 0, radius = 0;
    int count = 0;
  };
  std::map<long, Ring> rings;
  for (std::size_t v = 0; v < positions.size(); ++v) {
    Ring& ring = rings[std::lround(1e5 * rest.points[v].z())];
    ring.z += positions[v].z();
    ring.radius += std::hypot(positions[v].x(), positions[v].y());
    ++ring.count;
  }
  std::map<double, double> profile;
  for (const auto& [at, ring] : rings) profile[ring.z / ring.count] = ring.radius / ring.count;
  return profile;
}

double interpolated(const std::map<double, double>& profile, double z) {
  const auto above = profile.lower_bound(z), below = std::prev(above);
  const double share = (z - below->first) / (above->first - below->first);
  return below->second + share * (above->second - below->second);
}

// How far the wall's own places have moved along the vessel, in the mean over the stent's length.
double axial_motion(const WholeRun& r) {
  double moved = 0;
  int counted = 0;
  for (std::size_t v = 0; v < r.outcome.positions.size(); ++v) {
    const Vec3& before = r.setup.surface.mesh.points[v];
    if (!r.outcome.moved[v] || std::abs(before.z() - 30) > 12) continue;
    moved += std::abs(r.outcome.positions[v].z() - before.z());
    ++counted;
  }
  return moved / counted;
}

// A wall that slides is drawn together along the stent as it widens; friction hinders that, more of
// it more.
TEST(IdealVessel, FrictionHoldsTheWallWhereItTouches) {
  std::vector<double> motions;
  for (const double coefficient : {0.0, 0.05, 0.5}) {
    const TemporaryFolder folder;
    write(stenosed(), folder / "vessel.vtp");
    Case specification = make_case(folder / "vessel.vtp", {{"at", {0, 0, 30}}});
    specification.friction = coefficient;
    const WholeRun r = tests::run(folder, specification);
    EXPECT_TRUE(r.outcome.converged);
    EXPECT_EQ(r.metrics.inverted_triangles, 0u);
    EXPECT_NEAR(r.metrics.opened_mean_over_target, 1, 0.005);
    // What pictures and saved steps are chosen by.
    const auto growing = std::count_if(r.outcome.history.begin(), r.outcome.history.end(),
                                       [](const StepRecord& record) { return !record.settling; });
    EXPECT_EQ(growing, growth_steps(r.setup));
    motions.push_back(axial_motion(r));
    std::printf("friction %.2f: %.3f mm along the vessel\n", coefficient, motions.back());
  }
  EXPECT_LT(motions[1], 0.95 * motions[0]);
  EXPECT_LT(motions[2], 0.6 * motions[0]);
}

// The wall is oversized by 0.5 mm beyond the lesion, so that the transition zones are compared too.
TEST(IdealVessel, TheShapeDoesNotDependOnTheMesh) {
  std::vector<std::map<double, double>> profiles;
  for (const double edge : {0.5, 0.25, 0.125}) {
    const TemporaryFolder folder;
    vessels::IdealisedVessel vessel = stenosed();
    vessel.length = 40;
    vessel.stenosis_length = 14;
    vessel.edge_length = edge;
    write(vessel, folder / "vessel.vtp");
    // At a place: where a lesion is narrowest is found to a tenth of its radius only.
    Case specification = make_case(folder / "vessel.vtp",
                                   {{"at", {0, 0, 20}}, {"length", "16mm"}, {"diameter", "11mm"}});
    specification.contact_distance = 0.25;  // the stent's edge is as round for all
    specification.thickness = 0.5;
    const deployment::Setup setup = prepare(specification);
    const Outcome outcome = deploy(setup);
    EXPECT_TRUE(outcome.converged);
    profiles.push_back(radius_profile(setup.surface.mesh, outcome.positions));
  }
  // Edges of 0.5 mm cut across the stent's edge, which is round by half of that.
  for (const auto& [coarse, tolerance] : {std::pair{0, 0.01}, std::pair{1, 0.005}}) {
    double worst = 0;
    for (double z = 2; z < 38; z += 0.1)
      worst = std::max(worst, std::abs(interpolated(profiles[coarse], z) -
                                       interpolated(profiles[coarse + 1], z)));
    EXPECT_LT(worst, tolerance * 5);
    std::printf("radii differ by at most %.4f of the radius\n", worst / 5);
  }
}

TEST(IdealVessel, ARunStopsWhenAsked) {
  const TemporaryFolder folder;
  write(stenosed(), folder / "vessel.vtp");
  const deployment::Setup setup = prepare(make_case(folder / "vessel.vtp", json::object()));
  int steps = 0;
  try {
    deploy(setup, [&](const StepRecord&, std::span<const Vec3>) { return ++steps < 3; });
    FAIL() << "did not stop";
  } catch (const Error& error) {
    EXPECT_EQ(error.code(), ExitCode::interrupted);
  }
  EXPECT_EQ(steps, 3);
}

TEST(IdealVessel, TooFewStepsEndUnconverged) {
  const TemporaryFolder folder;
  write(stenosed(), folder / "vessel.vtp");
  Case c = make_case(folder / "vessel.vtp", json::object());
  c.max_settling_steps = 1;
  EXPECT_FALSE(deploy(prepare(c)).converged);
  // Nor when a coarser wall has used them up: the shape is then what it handed on.
  vessels::IdealisedVessel fine = stenosed();
  fine.edge_length = 0.5;
  write(fine, folder / "fine.vtp");
  Case early = make_case(folder / "fine.vtp", json::object());
  early.max_settling_steps = 1;
  const deployment::Setup setup = prepare(early);
  const Outcome outcome = deploy(setup);
  EXPECT_LT(outcome.history.back().vertices, static_cast<int>(setup.region.vertices.size()));
  EXPECT_FALSE(outcome.converged);
  ASSERT_EQ(outcome.patch.size(), setup.region.vertices.size());
  for (const Vec3& p : outcome.patch) EXPECT_TRUE(p.allFinite());
}

std::string refusal(const Case& c) {
  try {
    prepare(c);
  } catch (const Error& error) {
    EXPECT_EQ(error.code(), ExitCode::geometry);
    return error.what();
  }
  return "accepted";
}

TEST(IdealVessel, RefusesToGrowInMoreThanAMillionSteps) {
  const TemporaryFolder folder;
  write(stenosed(), folder / "vessel.vtp");
  Case specification = make_case(folder / "vessel.vtp", json::object());
  specification.growth_per_step = 1e-12;
  EXPECT_THROW(deploy(prepare(specification)), Error);
}

TEST(IdealVessel, RefusesWhatCannotBe) {
  const TemporaryFolder folder;
  write(stenosed(), folder / "vessel.vtp");
  const auto refusal_of = [&](const json& stent) {
    return refusal(make_case(folder / "vessel.vtp", stent));
  };
  EXPECT_NE(refusal_of({{"length", "70mm"}}).find("mm over the vessel's"), std::string::npos);
  EXPECT_NE(refusal_of({{"length", "59mm"}}).find("must lie beyond it"), std::string::npos);
  EXPECT_NE(refusal_of({{"diameter", "4mm"}}).find("nothing to open"), std::string::npos);
  EXPECT_NE(refusal_of({{"diameter", "26mm"}}).find("times the reference lumen"),
            std::string::npos);
  EXPECT_NE(refusal_of({{"at", {500, 0, 0}}}).find("from the nearest centerline"),
            std::string::npos);
  vessels::IdealisedVessel healthy = stenosed();
  healthy.stenosis = 0;
  write(healthy, folder / "vessel.vtp");
  EXPECT_NE(refusal_of({{"diameter", "12mm"}}).find("no lesion found"), std::string::npos);
}

TEST(IdealVessel, SavedStepsAreListedForParaView) {
  const TemporaryFolder folder;
  write(stenosed(), folder / "vessel.vtp");
  const deployment::Setup setup = prepare(make_case(folder / "vessel.vtp", json::object()));
  StepSaver saver(setup, folder.path());
  deploy(setup, [&](const StepRecord& record, std::span<const Vec3> positions) {
    if (record.step == 1 || record.step == 3) saver.save(record, positions);
    return true;
  });
  saver.write_list();
  const std::string list = tests::read_text(folder / "steps.pvd");
  EXPECT_NE(list.find("steps/wall_00003.vtp"), std::string::npos);
  EXPECT_TRUE(std::filesystem::exists(folder / "steps/stent_00001.vtp"));
  EXPECT_EQ(vessels::read_surface(folder / "steps/wall_00003.vtp", vessels::LengthUnit::mm)
                .mesh.points.size(),
            setup.surface.mesh.points.size());
}

}  // namespace
}  // namespace vstent::deployment
