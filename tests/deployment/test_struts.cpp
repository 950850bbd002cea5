#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <numbers>

#include "deployment/strut_contacts.hpp"
#include "deployment/strut_solid.hpp"
#include "sdf/exact_field.hpp"
#include "tests/data.hpp"
#include "tests/deployment/whole_run.hpp"
#include "tests/measure/defined.hpp"
#include "vessels/error.hpp"
#include "vessels/idealised.hpp"

namespace vstent::deployment {
namespace {

using measure::measure_struts;
using measure::StrutMetrics;

TriangleMesh straight_tube(double radius, double length, double edge) {
  vessels::IdealisedVessel vessel;
  vessel.radius = radius;
  vessel.length = length;
  vessel.stenosis = 0;
  vessel.edge_length = edge;
  return vessels::idealised_vessel(vessel);
}

/// A wire around the z axis.
stents::PlacedStent wire_ring(double radius, double z, double diameter) {
  stents::PlacedStent stent;
  stent.section = {true, diameter, diameter, 0.5 * diameter};
  stents::PlacedMember& ring = stent.members.emplace_back();
  ring.closed = true;
  for (int i = 0; i < 720; ++i) {
    const double angle = 2 * std::numbers::pi * i / 720;
    const Vec3 outward(std::cos(angle), std::sin(angle), 0);
    ring.points.push_back(radius * outward + z * Vec3::UnitZ());
    ring.outward.push_back(outward);
  }
  return stent;
}

TEST(StrutMetrics, ARingInsideATubeHasTheGapBetweenTheirRadii) {
  const TriangleMesh tube = straight_tube(2, 6, 0.2);
  const std::vector<char> all(tube.triangles.size(), 1);
  const stents::PlacedStent ring = wire_ring(1.5, 3, 0.1);
  const StrutMetrics m = measure_struts(tube, all, ring, strut_solid(ring),
                                        {{Vec3(0, 0, 1), Vec3(0, 0, 5)}, {1.55, 1.55}});
  // Facets sag by e^2 / (8 R) at most.
  const double sag = 0.2 * 0.2 / (8 * 2) * 1.5;
  EXPECT_NEAR(m.mean_gap, 0.45, sag);
  EXPECT_NEAR(m.largest_gap, 0.45, sag);
  EXPECT_NEAR(m.strut_length, 2 * std::numbers::pi * 1.5, 1e-3);
  EXPECT_EQ(m.share_with_gap[3], 1.0);
  EXPECT_EQ(m.share_over_openings, 0.0);
  EXPECT_EQ(m.largest_prolapse, 0.0);
  EXPECT_EQ(m.deepest_penetration, 0.0);
}

TEST(StrutMetrics, ARingThroughATubeShowsProlapseAndPenetration) {
  const TriangleMesh tube = straight_tube(2, 6, 0.1);
  const std::vector<char> all(tube.triangles.size(), 1);
  const stents::PlacedStent ring = wire_ring(2, 3, 0.2);
  const StrutMetrics m = measure_struts(tube, all, ring, strut_solid(ring),
                                        {{Vec3(0, 0, 1), Vec3(0, 0, 5)}, {2.1, 2.1}});
  const double sag = 0.1 * 0.1 / (8 * 2) * 1.5;
  EXPECT_NEAR(m.largest_prolapse, 0.1, sag);
  // The wall runs through the wire's middle; samples are a quarter of it apart.
  EXPECT_GT(m.deepest_penetration, 0.1 - 0.5 * 0.05 - sag);
  EXPECT_LE(m.deepest_penetration, 0.1 + 1e-9);
}

TEST(StrutContacts, HoldEdgesAndTrianglesOutOfAWireThinnerThanTheMesh) {
  const TriangleMesh tube = straight_tube(2, 6, 0.5);
  const std::vector<char> none(tube.points.size(), 0);
  const double wire = 0.1, voxel = 0.0125;
  const sdf::Solid solid = strut_solid(wire_ring(1.97, 3.1, wire));
  const sdf::LevelSet field = sdf::voxelise(solid, {voxel, 30});
  const StrutContactOptions options{.reach = 0.05, .spacing = voxel, .sink = 0.002};
  StrutContacts contacts(tube.triangles, none, options);
  contacts.update(field, tube.points, 1.0);
  ASSERT_FALSE(contacts.contacts().empty());
  const sdf::ExactField exact(solid);
  // The field's error in value where its curvature is that of a wire seen from this distance.
  const auto value = [&](double distance) {
    return 1.1 * voxel * voxel / (8 * (wire / 2 + distance)) + 1e-5;
  };
  double highest = 0;
  for (const xpbd::SpanContact& c : contacts.contacts()) {
    Vec3 place = Vec3::Zero();
    for (std::size_t k = 0; k < 3; ++k)
      place += c.weights[k] * tube.points[static_cast<std::size_t>(c.vertices[k])];
    const double distance = exact.sample(place).distance;
    const bool vertex = c.vertices[1] == c.vertices[0] && c.vertices[2] == c.vertices[0];
    const double lift = c.offset - c.normal.dot(place);
    EXPECT_NEAR(lift, -distance - (vertex ? 0 : options.sink), value(distance));
    EXPECT_LT(distance, options.reach + value(distance));
    highest = std::max(highest, lift);
  }
  EXPECT_NEAR(contacts.deepest(), highest, 1e-12);
  // The deepest place of the wall in the wire, by brute force over the triangles.
  double deepest = 0;
  for (const Triangle& t : tube.triangles) {
    const auto p = [&](std::size_t k) { return tube.points[static_cast<std::size_t>(t[k])]; };
    constexpr int kParts = 60;
    for (int i = 0; i <= kParts; ++i) {
      for (int j = 0; i + j <= kParts; ++j) {
        const Vec3 x = p(0) + (p(1) - p(0)) * i / kParts + (p(2) - p(0)) * j / kParts;
        if (std::abs(x.z() - 3.1) < 0.1) deepest = std::max(deepest, -exact.sample(x).distance);
      }
    }
  }
  // Between places looked at, s apart, the depth in a round wire changes by s^2 / (8 rho) at most.
  EXPECT_NEAR(highest, deepest - options.sink,
              value(-deepest) + voxel * voxel / (8 * (wire / 2 - deepest)));
}

/// Edge length (mm) that the stented wall is refined to.
class RoundWireInAStraightTube : public testing::TestWithParam<double> {};

/// Strut radius 0.045 mm, deployed from a lumen of 1.5 mm to an outer radius of 1.845 mm.
TEST_P(RoundWireInAStraightTube, CarriesTheWallWithinHalfAVoxel) {
  const tests::TemporaryFolder folder;
  const double edge = GetParam();
  const vessels::Surface vessel =
      vessels::make_surface(straight_tube(1.5, 8, std::max(0.2, edge)), "tube");
  vessels::write_surface(vessel, vessel.mesh.points,
                         std::vector<char>(vessel.mesh.points.size(), 0), folder / "tube.vtp");
  std::ofstream(folder / "design.json")
      << R"({"preset": "xience_s", "section": {"round": true, "width": "0.09mm",
             "thickness": "0.09mm", "edge_radius": "0.045mm"}})";
  nlohmann::json specification = {
      {"vessel", {{"surface", (folder / "tube.vtp").string()}, {"units", "mm"}}},
      {"stent",
       {{"at", {0, 0, 4}},
        {"design", (folder / "design.json").string()},
        {"length", "2.5mm"},
        {"diameter", "3.69mm"}}},
      {"patch", {{"edge_length", std::to_string(edge) + "mm"}}}};
  const tests::WholeRun r = tests::run(folder, parse_case(specification, "test", "/"));
  EXPECT_TRUE(r.outcome.converged);
  EXPECT_EQ(r.metrics.inverted_triangles, 0u);
  EXPECT_EQ(r.metrics.new_self_intersections, 0u);
  EXPECT_EQ(r.metrics.changed_outside_patch, 0u);
  ASSERT_TRUE(r.metrics.struts.has_value());
  const double half_voxel = 0.5 * *r.setup.specification.voxel_size;
  EXPECT_LT(r.metrics.struts->deepest_penetration, half_voxel);
  EXPECT_LT(r.metrics.struts->mean_gap, 0.2 * half_voxel);
  // kGaps[0] is just below half a voxel, 0.01125 mm. Facets longer than a crown is wide bridge it.
  EXPECT_LT(r.metrics.struts->share_with_gap[0], edge > 0.1 ? 0.04 : 0.01);
  // Twelve half-waves: over a span of 30 degrees a chord lies R (1 - cos 15 deg) = 0.063 mm below,
  // so tissue must show between the struts. It reaches the native lumen at the stent's end at most,
  // where a shell that is lifted by 0.345 mm undershoots by exp(-pi) of that (case V8).
  EXPECT_GT(r.metrics.struts->largest_prolapse, 0.05);
  EXPECT_LT(r.metrics.struts->largest_prolapse, 0.345 * (1 + std::exp(-std::numbers::pi)));
}

INSTANTIATE_TEST_SUITE_P(MeshDensities, RoundWireInAStraightTube,
                         testing::Values(0.18, 0.09, 0.045));

TEST(StrutDeployment, OpensANarrowedCoronaryArteryAtItsLesion) {
  const auto surface = tests::shared_data("coronary_branch/fine.stl");
  SKIP_WITHOUT(surface);
  const tests::TemporaryFolder folder;
  const tests::WholeRun r = tests::run(
      folder,
      tests::make_case(
          surface, "mm",
          {{"at", "lesion"}, {"design", "xience_s"}, {"length", "6mm"}, {"diameter", "3mm"}}));
  EXPECT_TRUE(r.outcome.converged);
  EXPECT_EQ(r.metrics.inverted_triangles, 0u);
  EXPECT_EQ(r.metrics.new_self_intersections, 0u);
  EXPECT_EQ(r.metrics.changed_outside_patch, 0u);
  EXPECT_LT(r.metrics.narrowest_before, 2.0);
  EXPECT_GT(r.metrics.narrowest_after, 2.3);  // tissue between the rings sags into the lumen
  EXPECT_LT(r.metrics.struts->share_with_gap[1], 0.02);  // the stent is wider than the vessel
  EXPECT_LT(r.metrics.struts->deepest_penetration,
            0.5 * 0.081);  // nowhere through a strut's middle
}

// The sleeve carries the wall between the struts too: it rests 0.1 mm outside the metal everywhere,
// up to the sag e^2 / (8 R) of its facets and the contact tolerance.
TEST(StrutDeployment, ACoverKeepsTissueOutOfTheCells) {
  const tests::TemporaryFolder folder;
  const vessels::Surface vessel = vessels::make_surface(straight_tube(1.5, 9, 0.3), "tube");
  vessels::write_surface(vessel, vessel.mesh.points,
                         std::vector<char>(vessel.mesh.points.size(), 0), folder / "tube.vtp");
  std::ofstream(folder / "design.json") << R"({"preset": "xience_s", "cover": {"outer": "0.1mm"}})";
  nlohmann::json specification = {
      {"vessel", {{"surface", (folder / "tube.vtp").string()}, {"units", "mm"}}},
      {"stent",
       {{"at", {0, 0, 4.5}},
        {"design", (folder / "design.json").string()},
        {"length", "2.5mm"},
        {"diameter", "3.3mm"}}},
      {"patch", {{"edge_length", "0.15mm"}}}};
  const tests::WholeRun r = tests::run(folder, parse_case(specification, "test", "/"));
  EXPECT_TRUE(r.outcome.converged);
  EXPECT_TRUE(std::filesystem::exists(folder / "cover.vtp"));
  EXPECT_EQ(r.metrics.struts->largest_prolapse, 0);
  EXPECT_EQ(r.metrics.deepest_penetration, 0);
  const double sag = 0.3 * 0.3 / (8 * 1.75);  // of the file's own facets, which refining keeps
  EXPECT_NEAR(r.metrics.struts->mean_gap, 0.1, sag + 0.01);
}

TEST(StrutDeployment, ResultsOnTheInputsOwnVerticesKeepItsMesh) {
  const tests::TemporaryFolder folder;
  const vessels::Surface vessel = vessels::make_surface(straight_tube(1.5, 9, 0.3), "tube");
  vessels::write_surface(vessel, vessel.mesh.points,
                         std::vector<char>(vessel.mesh.points.size(), 0), folder / "tube.vtp");
  nlohmann::json specification = {
      {"vessel", {{"surface", (folder / "tube.vtp").string()}, {"units", "mm"}}},
      {"stent",
       {{"at", {0, 0, 4.5}}, {"design", "xience_s"}, {"length", "2.5mm"}, {"diameter", "3.3mm"}}},
      {"patch", {{"edge_length", "0.12mm"}, {"keep_refined", false}}}};
  const tests::WholeRun r = tests::run(folder, parse_case(specification, "test", "/"));
  ASSERT_TRUE(r.setup.unrefined.has_value());
  const vessels::Surface written =
      vessels::read_surface(folder / "stented.vtp", vessels::LengthUnit::mm);
  EXPECT_EQ(written.mesh.triangles, vessel.mesh.triangles);
  EXPECT_GT(r.setup.surface.mesh.points.size(), 2 * written.mesh.points.size());
  EXPECT_GT(r.metrics.moved_vertices, 100u);
  const auto json = nlohmann::ordered_json::parse(tests::read_text(folder / "metrics.json"));
  const auto met = tests::defined_in(json);
  tests::expect_absences_stated(met);
  for (const char* key :
       {"/struts/mean_gap_mm", "/struts/malapposed/*/percent_of_struts", "/design/name",
        "/design/percent_metal_to_artery", "/simulation/converged"})
    EXPECT_TRUE(met.contains(key)) << key;
  EXPECT_EQ(json["stent"]["foreshortening_percent"], json["design"]["foreshortening_percent"]);
  EXPECT_FALSE(json["stent"]["recoil_percent"].is_null());
}

TEST(StrutDeployment, RefusesWhatOnlySmoothTubesHave) {
  const auto refusal = [](nlohmann::json stent, const nlohmann::json& extra) {
    stent.update({{"at", {0, 0, 4.5}}, {"design", "xience_s"}, {"diameter", "3.3mm"}});
    nlohmann::json specification = {{"vessel", {{"surface", "tube.vtp"}, {"units", "mm"}}},
                                    {"stent", stent}};
    specification.update(extra);
    try {
      parse_case(specification, "case.json", "/");
    } catch (const Error& error) {
      return std::string(error.what());
    }
    return std::string();
  };
  EXPECT_EQ(refusal(nlohmann::json::object(), nlohmann::json::object()), "");
  EXPECT_NE(refusal({{"shape", "capsule"}}, nlohmann::json::object()).find("/stent/shape"),
            std::string::npos);
  EXPECT_NE(refusal({{"cell", "closed"}}, nlohmann::json::object()).find("/stent/cell"),
            std::string::npos);
  EXPECT_NE(refusal(nlohmann::json::object(), {{"contact", {{"stiffness_N_per_mm", 1}}}})
                .find("/contact"),
            std::string::npos);
}

TEST(StrutDeployment, RefusesADiameterBeyondTheDesignsLimitNamingIt) {
  const tests::TemporaryFolder folder;
  const vessels::Surface vessel = vessels::make_surface(straight_tube(1.5, 9, 0.3), "tube");
  vessels::write_surface(vessel, vessel.mesh.points,
                         std::vector<char>(vessel.mesh.points.size(), 0), folder / "tube.vtp");
  try {
    prepare(tests::make_case(
        folder / "tube.vtp", "mm",
        {{"at", {0, 0, 4.5}}, {"design", "xience_s"}, {"length", "4mm"}, {"diameter", "6mm"}}));
    FAIL();
  } catch (const Error& error) {
    EXPECT_EQ(error.code(), ExitCode::usage);
    EXPECT_NE(std::string(error.what()).find("4.57"), std::string::npos) << error.what();
  }
}

}  // namespace
}  // namespace vstent::deployment
