// Stents given as surfaces.
#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <random>

#include "deployment/strut_solid.hpp"
#include "deployment/surface_design.hpp"
#include "sdf/mesh_distance.hpp"
#include "sdf/polyline.hpp"
#include "sdf/signed_mesh_distance.hpp"
#include "stents/catalogue.hpp"
#include "tests/deployment/whole_run.hpp"
#include "tests/stents/pipes.hpp"
#include "vessels/error.hpp"
#include "vessels/idealised.hpp"

namespace vstent::deployment {
namespace {

using tests::TemporaryFolder;

void write(const TriangleMesh& mesh, const std::filesystem::path& path) {
  const vessels::Surface surface = vessels::make_surface(mesh, "generated");
  vessels::write_surface(surface, mesh.points, std::vector<char>(mesh.points.size(), 0), path);
}

TriangleMesh tube(double radius, double length, double bend_angle, double edge) {
  vessels::IdealisedVessel vessel;
  vessel.radius = radius;
  vessel.length = length;
  vessel.bend_angle = bend_angle;
  vessel.stenosis = 0;
  vessel.edge_length = edge;
  return vessels::idealised_vessel(vessel);
}

/// A catalogue design, straight along z, as `vstent stent` draws it.
TriangleMesh drawn(const std::string& name, double diameter, double length, double voxel) {
  const auto design = stents::make_design(*stents::find_preset(name), length);
  const stents::Pattern pattern = design->expanded(diameter);
  const stents::AxisWithFrames axis =
      stents::with_frames({Vec3::Zero(), pattern.length * Vec3::UnitZ()}, Vec3::UnitX());
  return sdf::voxelise(strut_solid(stents::place(pattern, axis, 0, stents::Bending::affine)),
                       {voxel, 3})
      .surface();
}

std::string refusal(const std::function<void()>& attempt, ExitCode code) {
  try {
    attempt();
  } catch (const Error& error) {
    EXPECT_EQ(error.code(), code) << error.what();
    const std::string line = error.what();
    EXPECT_EQ(line.find('\n'), std::string::npos);
    return line;
  }
  return "";
}

TEST(SurfaceDesign, KnowsItsStruts) {
  const TemporaryFolder folder;
  write(drawn("xience_s", 3, 2.5, 0.02), folder / "stent.stl");
  const SurfaceDesign design = read_surface_design((folder / "stent.stl").string());
  const stents::CrossSection& section = stents::find_preset("xience_s")->section;
  // Points of a level set's surface stand a part of a voxel out where it is sharply curved.
  EXPECT_NEAR(design.surface.outer_radius, 1.5, 0.25 * 0.02);
  EXPECT_NEAR(design.thickness, section.thickness, 0.002);
  // Rounded edges take a few per cent of the area away, crowns and welds some more.
  EXPECT_NEAR(design.width, section.width, 0.2 * section.width);
  EXPECT_EQ(design.name, "stent");
  EXPECT_EQ(design.findings.size(), 1u);  // that its unit was not given

  tests::Pipe pipe;
  write(tests::pipe(pipe), folder / "pipe.vtp");
  std::ofstream(folder / "pipe.json") << R"({"surface": "pipe.vtp", "unit": "cm", "cell": "closed",
      "axis": [0, 0, -1], "name": "mine", "crimped_diameter": "12mm", "largest_diameter": "40mm"})";
  const SurfaceDesign sleeve = read_surface_design((folder / "pipe.json").string());
  EXPECT_EQ(sleeve.name, "mine");
  EXPECT_EQ(sleeve.cell, stents::Cell::closed);
  EXPECT_NEAR(sleeve.surface.outer_radius, 15, 1e-5);  // the file holds floats
                                                       // From chord to chord of 48 around.
  EXPECT_NEAR(sleeve.thickness, 1, 1.001 * (1 - std::cos(std::numbers::pi / 48)));
  EXPECT_TRUE(sleeve.findings.empty());
  EXPECT_GT(sleeve.width, 20);  // a sheet has no width but its own way round
  EXPECT_NE(limits_of(sleeve, 33).find("1.1 times"), std::string::npos) << limits_of(sleeve, 33);
}

TEST(SurfaceDesign, CutsFacetsThatCouldNotFollowABend) {
  const TemporaryFolder folder;
  write(tests::pipe({.along = 1}), folder / "pipe.vtp");
  const SurfaceDesign design = read_surface_design((folder / "pipe.vtp").string());
  const TriangleMesh& mesh = design.surface.mesh;
  double longest = 0, volume = 0;
  for (const Triangle& t : mesh.triangles) {
    const Vec3& a = mesh.points[static_cast<std::size_t>(t[0])];
    const Vec3& b = mesh.points[static_cast<std::size_t>(t[1])];
    const Vec3& c = mesh.points[static_cast<std::size_t>(t[2])];
    longest = std::max({longest, (b - a).norm(), (c - b).norm(), (a - c).norm()});
    volume += a.dot(b.cross(c)) / 6;
  }
  EXPECT_LT(longest, std::sqrt(8 * 1.5 * 0.05 * design.thickness) + 1e-9);
  EXPECT_NEAR(volume, design.surface.volume, 1e-9 * volume);
}

TEST(SurfaceDesign, RefusesWhatIsNoStent) {
  const TemporaryFolder folder;
  const auto read = [&](const std::string& name, ExitCode code = ExitCode::geometry) {
    return refusal([&] { read_surface_design((folder / name).string()); }, code);
  };
  TriangleMesh open = tests::pipe({});
  open.triangles.resize(open.triangles.size() - 7);
  write(open, folder / "open.stl");
  EXPECT_NE(read("open.stl").find("1 open rim"), std::string::npos) << read("open.stl");
  TriangleMesh solid = tests::pipe({.inner = 0.001});
  write(solid, folder / "rod.stl");
  EXPECT_NE(read("rod.stl").find("not tube-like"), std::string::npos);
  write(tests::pipe({.outer = 0.14, .inner = 0.13, .length = 2.5}), folder / "cm.stl");
  EXPECT_NE(read("cm.stl", ExitCode::usage).find("give the surface's unit"), std::string::npos);
  read("absent.stl", ExitCode::input_file);
  write(tests::pipe({}), folder / "pipe.stl");
  const auto keys = [&](const std::string& json) {
    std::ofstream(folder / "own.json") << json;
    return read("own.json", ExitCode::usage);
  };
  EXPECT_NE(keys(R"({"surface": "pipe.stl"})").find("/unit"), std::string::npos);
  EXPECT_NE(keys(R"({"surface": "pipe.stl", "unit": "inch"})").find("/unit"), std::string::npos);
  EXPECT_NE(keys(R"({"surface": "pipe.stl", "unit": "mm", "axis": [0, 0]})").find("/axis"),
            std::string::npos);
  EXPECT_NE(keys(R"({"surface": "pipe.stl", "unit": "mm", "cells": "open"})").find("/cells"),
            std::string::npos);
  EXPECT_EQ(keys(R"({"surface": "pipe.stl", "unit": "mm", "flip": true})"), "");

  const SurfaceDesign pipe = read_surface_design((folder / "pipe.stl").string());
  EXPECT_NO_THROW(require_reachable(pipe, 0.3, 9, "k"));
  // The wall is 0.1 mm and what the inner chords sag thick.
  const std::string small = refusal([&] { require_reachable(pipe, 0.2, 3, "k"); }, ExitCode::usage);
  EXPECT_NE(small.find("0.2 mm is too small"), std::string::npos) << small;
  SurfaceDesign limited = pipe;
  limited.crimped_diameter = 1;
  limited.largest_diameter = 4;
  EXPECT_NE(refusal([&] { require_reachable(limited, 0.9, 3, "k"); }, ExitCode::usage), "");
  EXPECT_NE(refusal([&] { require_reachable(limited, 3, 4.1, "k"); }, ExitCode::usage), "");
}

/// The same metal, once from its parameters and once as a surface, in the same straight tube.
TEST(SurfaceDeployment, ADesignsOwnSurfaceGivesTheWallThatTheDesignGives) {
  const TemporaryFolder folder;
  write(tube(1.35, 5, 0, 0.3), folder / "tube.vtp");
  write(drawn("cypher", 3, 1, 0.045), folder / "stent.stl");
  nlohmann::json specification = {
      {"vessel", {{"surface", (folder / "tube.vtp").string()}, {"units", "mm"}}},
      {"stent",
       {{"at", {0, 0, 2.5}}, {"design", "cypher"}, {"length", "1mm"}, {"diameter", "3mm"}}},
      {"patch", {{"edge_length", "0.15mm"}, {"margin", "1.2mm"}}},
      {"level_set", {{"voxel_size", "0.03mm"}}},
      // Tissue sags slowly at the end: settled to 0.01, walls that came from elsewhere differ more.
      {"solver", {{"growth_per_step", "0.03mm"}, {"tolerance", 0.003}}}};
  const tests::WholeRun by_parameters = tests::run(folder, parse_case(specification, "test", "/"));
  specification["stent"].erase("length");
  specification["stent"]["design"] = (folder / "stent.stl").string();
  const TemporaryFolder second;
  const tests::WholeRun by_surface = tests::run(second, parse_case(specification, "test", "/"));
  EXPECT_TRUE(by_surface.outcome.converged);
  const auto wall = [](const tests::WholeRun& r) {
    TriangleMesh mesh = r.setup.surface.mesh;
    mesh.points = r.outcome.positions;
    return mesh;
  };
  const TriangleMesh a = wall(by_parameters), b = wall(by_surface);
  double largest = 0, sum = 0, count = 0;
  for (const auto& [from, to] : {std::pair(&a, &b), std::pair(&b, &a)}) {
    const sdf::MeshDistance distance(*to);
    for (const Vec3& p : from->points) {
      if (std::abs(p.z() - 2.5) > 1) continue;
      const double d = distance.closest(p).distance;
      largest = std::max(largest, d);
      sum += d;
      count += 1;
    }
  }
  // What the file's facets lie off the metal (a quarter of the voxels that it was drawn with), and
  // half a voxel for each of the two fields.
  constexpr double drawn_voxel = 0.045, voxel = 0.03;
  EXPECT_LT(sum / count, 0.25 * drawn_voxel);
  EXPECT_LT(largest, 0.25 * drawn_voxel + voxel);
  const StrutMetrics &p = *by_parameters.metrics.struts, &s = *by_surface.metrics.struts;
  EXPECT_NEAR(s.mean_prolapse, p.mean_prolapse, 0.5 * voxel);
  EXPECT_NEAR(s.largest_prolapse, p.largest_prolapse, voxel);
  EXPECT_LT(s.deepest_penetration, voxel);
  EXPECT_EQ(s.strut_length, 0);
  // The outer side is what the struts cover: their length times their width less the edges.
  EXPECT_NEAR(s.outer_area / p.strut_length, 0.13 - 2 * 0.025, 0.025);
}

struct BentCase {
  TemporaryFolder folder;
  nlohmann::json specification;

  explicit BentCase(const char* cell) {
    write(tube(1.35, 8, 0.7, 0.3), folder / "tube.vtp");
    write(drawn("cypher", 3, 3, 0.045), folder / "stent.stl");
    const nlohmann::json design = {
        {"surface", "stent.stl"}, {"unit", "mm"}, {"name", "mine"}, {"cell", cell}};
    std::ofstream(folder / "design.json") << design;
    specification = {{"vessel", {{"surface", "tube.vtp"}, {"units", "mm"}}},
                     {"stent",
                      {{"at", {{"branch", 0}, {"arc_length", "4mm"}}},
                       {"design", "design.json"},
                       {"diameter", "3mm"}}},
                     {"patch", {{"edge_length", "0.2mm"}, {"margin", "1.5mm"}}}};
  }
  Case parsed() const { return parse_case(specification, "test", folder.path()); }
};

TEST(SurfaceDeployment, LiesInABentTubeWithTheWallOutsideOfItAndItsCaseReadsBack) {
  BentCase bent("open");
  bent.specification["stent"]["distal_diameter"] = "2.8mm";
  const tests::WholeRun r = tests::run(bent.folder, bent.parsed());
  EXPECT_TRUE(r.outcome.converged);
  EXPECT_EQ(r.metrics.inverted_triangles, 0u);
  EXPECT_EQ(r.metrics.new_self_intersections, 0u);
  EXPECT_EQ(r.metrics.changed_outside_patch, 0u);
  ASSERT_TRUE(r.metrics.struts.has_value());
  EXPECT_LT(r.metrics.struts->deepest_penetration, *r.setup.specification.voxel_size);
  EXPECT_LT(r.metrics.struts->share_with_gap[1], 0.01);
  EXPECT_GT(r.metrics.bend_after, 15);
  const vessels::Surface stent =
      vessels::read_surface(bent.folder / "stent.vtp", vessels::LengthUnit::mm);
  EXPECT_EQ(stent.mesh.triangles.size(), r.setup.surface_design->surface.mesh.triangles.size());
  EXPECT_FALSE(std::filesystem::exists(bent.folder / "struts.vtp"));
  // All warnings that a surface brings along.
  const std::string said = nlohmann::json(r.setup.warnings).dump();
  EXPECT_NE(said.find("without a mechanism"), std::string::npos) << said;

  const deployment::Setup again = prepare(read_case(bent.folder / "case.json"));
  EXPECT_EQ(to_json(again.specification).dump(), to_json(r.setup.specification).dump());
  EXPECT_EQ(again.strut.width, r.setup.strut.width);
}

TEST(SurfaceDeployment, ClosedCellsEndStraightAsTheSurfaceThatTheyWere) {
  const BentCase bent("closed");
  const deployment::Setup setup = prepare(bent.parsed());
  const StentShape shape = shape_of(setup, stent_state(setup, 1));
  const stents::StraightSurface straight = stents::on_its_axis(std::get<TriangleMesh>(shape));
  EXPECT_NEAR(straight.outer_radius, 1.5, 1e-6);
  EXPECT_NEAR(straight.length, setup.surface_design->surface.length, 1e-6);
  // A third of the way it is still bent.
  const StentState midway = stent_state(setup, 0.3);
  EXPECT_NEAR(midway.straightening, 0.3, 1e-12);
  EXPECT_GT(stents::largest_curvature(midway.axis), 0.1);
}

TEST(SurfaceDeployment, RefusesWhatDoesNotFitNamingTheFigures) {
  BentCase bent("open");
  nlohmann::json& stent = bent.specification["stent"];
  const auto refused = [&](ExitCode code) {
    return refusal([&] { prepare(bent.parsed()); }, code);
  };
  stent["length"] = "9mm";
  EXPECT_NE(refused(ExitCode::usage).find("leave the length out"), std::string::npos);
  stent.erase("length");
  stent["straightening"] = 0.5;
  EXPECT_NE(refused(ExitCode::usage).find("open cells"), std::string::npos);
  stent.erase("straightening");
  stent["cell"] = "closed";
  EXPECT_NE(refused(ExitCode::usage).find("/stent/cell"), std::string::npos);
  stent.erase("cell");
  std::ofstream(bent.folder / "design.json")
      << R"({"surface": "stent.stl", "unit": "mm", "largest_diameter": "2.9mm"})";
  EXPECT_NE(refused(ExitCode::usage).find("2.9 mm"), std::string::npos);
}

}  // namespace
}  // namespace vstent::deployment
