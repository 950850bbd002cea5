// vstent measure as a person runs it.
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "tests/apps/command.hpp"
#include "vessels/idealised.hpp"
#include "vessels/surface.hpp"

namespace vstent::apps {
namespace {

using nlohmann::json;
using tests::read_text;
using tests::TemporaryFolder;
using tests::vstent;

void write_tube(const TemporaryFolder& folder, const std::string& name, double radius, double edge,
                double stenosis = 0, double length = 60) {
  vessels::IdealisedVessel vessel;
  vessel.radius = radius;
  vessel.edge_length = edge;
  vessel.stenosis = stenosis;
  vessel.length = length;
  const vessels::Surface surface = vessels::make_surface(vessels::idealised_vessel(vessel), name);
  vessels::write_surface(surface, surface.mesh.points,
                         std::vector<char>(surface.mesh.points.size(), 0), folder / name);
}

TEST(MeasureCommand, AgreesWithWhatDeployMeasured) {
  const TemporaryFolder folder;
  write_tube(folder, "vessel.vtp", 5, 1, 0.5);
  const auto deployed = vstent(folder,
                               "deploy vessel.vtp --units mm --at lesion --length 24mm "
                               "--diameter 10mm --no-pictures -o out");
  ASSERT_EQ(deployed.exit_code, 0) << deployed.err;
  const auto measured =
      vstent(folder,
             "measure vessel.vtp out/stented.vtp --unit mm --centerline out/centerline.vtp "
             "--stent out/stent.vdb --diameter 10mm -o m.json --profiles p.csv --sections s.vtp "
             "--surface f.vtp");
  ASSERT_EQ(measured.exit_code, 0) << measured.err;
  EXPECT_NE(measured.out.find("Acute gain"), std::string::npos);
  EXPECT_NE(measured.out.find("not for clinical use"), std::string::npos);
  const json a = json::parse(read_text(folder / "out/metrics.json"));
  const json b = json::parse(read_text(folder / "m.json"));
  // The same mesh, whole; the patch is known to deploy alone.
  for (const auto& [key, value] : a["mesh"].items()) {
    if (key != "changed_vertices_outside_patch") {
      EXPECT_EQ(value, b["mesh"][key]) << key;
    }
  }
  // The stent's ends are read off its surface: stations differ by less than their spacing, 0.5 mm,
  // so the places do, and lumens by what they change over that.
  EXPECT_NEAR(a["lumen"]["treated_from_mm"], b["lumen"]["treated_from_mm"].get<double>(), 0.6);
  EXPECT_NEAR(a["lumen"]["treated_to_mm"], b["lumen"]["treated_to_mm"].get<double>(), 0.6);
  for (const char* key : {"narrowest_before_mm", "narrowest_after_mm"})
    EXPECT_NEAR(a["lumen"][key], b["lumen"][key].get<double>(), 0.05) << key;
  EXPECT_NEAR(a["apposition"]["largest_gap_mm"], b["apposition"]["largest_gap_mm"].get<double>(),
              0.01);
  EXPECT_NEAR(a["wall"]["circumferential_stretch_p95"],
              b["wall"]["circumferential_stretch_p95"].get<double>(), 0.05);
  for (const char* file : {"p.csv", "s.vtp", "f.vtp"})
    EXPECT_FALSE(read_text(folder / file).empty()) << file;
}

TEST(MeasureCommand, ExtractsTheCenterlineAndComparesOtherTriangles) {
  const TemporaryFolder folder;
  write_tube(folder, "a.stl", 5, 1.0);
  write_tube(folder, "b.stl", 6, 1.3);
  const auto r = vstent(folder, "measure a.stl b.stl --units mm -o m.json");
  ASSERT_EQ(r.exit_code, 0) << r.err;
  const json m = json::parse(read_text(folder / "m.json"));
  // Polygons of 31 and 29 sides lack 0.4 % of their circles' diameters at most.
  EXPECT_NEAR(m["lumen"]["narrowest_before_mm"].get<double>(), 10, 0.05);
  EXPECT_NEAR(m["lumen"]["narrowest_after_mm"].get<double>(), 12, 0.06);
  EXPECT_TRUE(m["wall"]["area_ratio_p50"].is_null());
  EXPECT_NE(r.out.find("/wall: the surfaces do not have the same"), std::string::npos) << r.out;
}

TEST(MeasureCommand, RefusesInOneLineAndWritesNothing) {
  const TemporaryFolder folder;
  write_tube(folder, "a.vtp", 5, 1.0);
  write_tube(folder, "b.vtp", 0.5, 0.1, 0, 6);
  tests::write_text(folder / "stent.vdb", "no level set");
  tests::write_text(folder / "cl.vtp", "");
  const auto refused = [&](const std::string& arguments, int code, const std::string& words) {
    const auto r = vstent(folder, "measure " + arguments + " -o m.json");
    EXPECT_EQ(r.exit_code, code) << arguments << ": " << r.err;
    EXPECT_NE(r.err.find(words), std::string::npos) << r.err;
    EXPECT_EQ(std::count(r.err.begin(), r.err.end(), '\n'), 1) << r.err;
    EXPECT_FALSE(std::filesystem::exists(folder / "m.json")) << arguments;
  };
  refused("a.vtp a.vtp", 2, "--units");
  refused("a.vtp", 2, "the surface after is missing");
  refused("a.vtp a.vtp --units ft", 2, "not a length unit");
  refused("a.vtp a.vtp --units mm --diameter -3mm", 2, "--diameter");
  refused("a.vtp nowhere.vtp --units mm", 3, "nowhere.vtp");
  refused("a.vtp a.vtp --units mm --stent stent.vdb", 3, "stent.vdb");
  refused("a.vtp a.vtp --units mm --centerline cl.vtp", 3, "cl.vtp");
  refused("a.vtp b.vtp --units mm", 4, "b.vtp: is 10 times smaller");
}

}  // namespace
}  // namespace vstent::apps
