// `vstent cfd` as a person runs it, with meshers that work and meshers that do not.
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdlib>
#include <nlohmann/json.hpp>
#include <set>
#include <sstream>

#include "meshing/cap.hpp"
#include "meshing/program.hpp"
#include "tests/apps/command.hpp"
#include "vessels/idealised.hpp"
#include "vessels/mesh_write.hpp"
#include "vessels/surface_part.hpp"

namespace vstent::tests {
namespace {

namespace fs = std::filesystem;

struct Vessel {
  TriangleMesh mesh;  // cm, every coordinate a float
  std::vector<int> faces;
};

/// A narrowed tube with caps: faces 4 (wall), 7 and 9.
Vessel vessel() {
  Vessel result;
  result.mesh = vessels::idealised_vessel({2, 10, 0.6, 0.4, 4, 0, 0.55});
  result.faces.assign(result.mesh.triangles.size(), 4);
  for (const meshing::Opening& opening : meshing::find_openings(result.mesh)) {
    meshing::close(result.mesh, opening, vessels::LengthUnit::mm);
    result.faces.resize(result.mesh.triangles.size(), result.faces.back() == 4 ? 7 : 9);
  }
  for (Vec3& p : result.mesh.points) p = (p / 10).cast<float>().cast<double>();
  return result;
}

/// A folder with model.vtp (cm), names.json, bc.json; and environment for one command.
struct Workplace {
  TemporaryFolder folder;
  Vessel model = vessel();

  Workplace() {
    vessels::write_triangles(model.mesh, {}, {{"ModelFaceID", model.faces}}, folder / "model.vtp");
    write_text(folder / "names.json", R"({"4": "lumen", "7": "aorta", "9": "left"})");
    write_text(folder / "bc.json", conditions("50 mL/s"));
    unsetenv("VSTENT_GMSH");
  }
  ~Workplace() { unsetenv("VSTENT_GMSH"); }

  static std::string conditions(const std::string& inflow) {
    return R"({"faces": {"aorta": {"inflow": ")" + inflow +
           R"("}, "left": {"resistance": "1000 dyn s/cm5"}}})";
  }
  void fake_mesher(const std::string& script) const {
    write_text(folder / "fake", "#!/bin/sh\n" + script + "\n");
    fs::permissions(folder / "fake", fs::perms::owner_all);
    setenv("VSTENT_GMSH", (folder / "fake").c_str(), 1);
  }
  CommandResult cfd(const std::string& arguments) const {
    return vstent(folder, "cfd " + arguments + " --no-picture -o OUT");
  }
  CommandResult cfd() const {
    return cfd("model.vtp --units cm --face-names names.json --boundary-conditions bc.json");
  }
};

/// One line on standard error besides notes and warnings, the exit code, and nothing written.
testing::AssertionResult refused(const Workplace& place, const CommandResult& run, int code,
                                 const std::string& part) {
  std::istringstream lines(run.err);
  std::vector<std::string> errors;
  for (std::string line; std::getline(lines, line);) {
    if (!line.starts_with("note: ") && !line.starts_with("warning: ")) errors.push_back(line);
  }
  bool left_behind = false;
  for (const auto& entry : fs::directory_iterator(place.folder.path()))
    left_behind = left_behind || entry.path().filename().string().starts_with("OUT");
  if (run.exit_code == code && errors.size() == 1 && errors[0].starts_with("error: ") &&
      errors[0].find(part) != std::string::npos && !left_behind)
    return testing::AssertionSuccess();
  return testing::AssertionFailure() << "exit code " << run.exit_code << ", "
                                     << (left_behind ? "files left behind, " : "") << run.err;
}

using Corners = std::array<std::array<double, 3>, 3>;

std::multiset<Corners> corners_of(const TriangleMesh& mesh, const std::vector<int>& faces, int face,
                                  double scale) {
  std::multiset<Corners> result;
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    if (!faces.empty() && faces[t] != face) continue;
    Corners corners{};
    for (std::size_t k = 0; k < 3; ++k) {
      const Vec3 p = mesh.points[static_cast<std::size_t>(mesh.triangles[t][k])] / scale;
      corners[k] = {p.x(), p.y(), p.z()};
    }
    std::rotate(corners.begin(), std::min_element(corners.begin(), corners.end()), corners.end());
    result.insert(corners);
  }
  return result;
}

TEST(CfdCommand, AnUneditedModelComesOutWithItsFacesNamesAndGeometry) {
  if (meshing::find_program("gmsh").empty()) GTEST_SKIP() << "needs gmsh, which is not installed";
  const Workplace place;
  const CommandResult run = place.cfd();
  ASSERT_EQ(run.exit_code, 0) << run.err;
  for (const auto& [name, id] : {std::pair{"lumen", 4}, {"aorta", 7}, {"left", 9}}) {
    const fs::path file =
        place.folder / "OUT" / "mesh-complete" / "mesh-surfaces" / (std::string(name) + ".vtp");
    const vessels::Surface face = vessels::read_surface_part(file, vessels::LengthUnit::cm);
    EXPECT_EQ(corners_of(face.mesh, {}, 0, 10),
              corners_of(place.model.mesh, place.model.faces, id, 1))
        << name;
    EXPECT_EQ(std::set<int>(face.face_of_triangle.begin(), face.face_of_triangle.end()),
              std::set<int>{id});
  }
  const std::string xml = read_text(place.folder / "OUT" / "solver.xml");
  for (const char* name : {"lumen", "aorta", "left"}) {
    const std::string face = std::string("<Add_face name=\"") + name + "\">";
    const std::string bc = std::string("<Add_BC name=\"") + name + "\">";
    EXPECT_NE(xml.find(face), std::string::npos);
    EXPECT_EQ(xml.find(face), xml.rfind(face));
    EXPECT_NE(xml.find(bc), std::string::npos);
    EXPECT_EQ(xml.find(bc), xml.rfind(bc));
  }
  EXPECT_NE(xml.find("<Value> -50 </Value>"), std::string::npos);
  const auto json = nlohmann::json::parse(read_text(place.folder / "OUT" / "cfd.json"));
  EXPECT_EQ(json["units"], "cm");
  EXPECT_EQ(json["faces"].size(), 3u);
  EXPECT_GT(json["core"]["smallest_dihedral_deg"], 5);
  EXPECT_NE(run.out.find("in cm whatever the input's unit"), std::string::npos);
  EXPECT_FALSE(fs::exists(place.folder / "OUT" / "mesher"));
}

TEST(CfdCommand, LayersAndRemeshingKeepNames) {
  if (meshing::find_program("gmsh").empty()) GTEST_SKIP() << "needs gmsh, which is not installed";
  const Workplace place;
  const CommandResult run = place.cfd(
      "model.vtp --units cm --face-names names.json --boundary-conditions bc.json --layers 2 "
      "--edge 0.6mm");
  ASSERT_EQ(run.exit_code, 0) << run.err;
  const auto json = nlohmann::json::parse(read_text(place.folder / "OUT" / "cfd.json"));
  EXPECT_EQ(json["remesh"]["region"], "all");
  EXPECT_EQ(json["layers"]["count"], 2);
  EXPECT_GT(json["layers"]["smallest_thickness_mm"], 0);
  EXPECT_TRUE(fs::exists(place.folder / "OUT" / "mesh-complete" / "mesh-surfaces" / "left.vtp"));
}

TEST(CfdCommand, MeshersThatFailAreToldInOneLine) {
  const Workplace place;
  setenv("VSTENT_GMSH", "/no/such/gmsh", 1);
  EXPECT_TRUE(refused(place, place.cfd(), 2, "/no/such/gmsh: there is no such program"));
  place.fake_mesher("exit 0");
  EXPECT_TRUE(refused(place, place.cfd(), 5, "left no mesh"));
  place.fake_mesher("echo nonsense > volume.msh");
  EXPECT_TRUE(refused(place, place.cfd(), 5, "wrote nonsense"));
  place.fake_mesher("echo 'Error : No tetrahedra' >&2; exit 1");
  EXPECT_TRUE(refused(place, place.cfd(), 5, "it said \"Error : No tetrahedra\""));
  place.fake_mesher("kill -9 $$");
  EXPECT_TRUE(refused(place, place.cfd(), 7, "perhaps for want of memory"));
  place.fake_mesher("sleep 60");
  EXPECT_TRUE(refused(place, place.cfd("model.vtp --units cm --time-limit 0.5"), 7,
                      "stopped after 0.5 s without a mesh"));
}

TEST(CfdCommand, AFailureLeavesAnOlderFolderAsItWas) {
  const Workplace place;
  place.fake_mesher("exit 0");
  fs::create_directories(place.folder / "OUT" / "mesh-complete");
  write_text(place.folder / "OUT" / "mesh-complete" / "mine", "mine");
  EXPECT_EQ(place.cfd().exit_code, 5);
  EXPECT_EQ(read_text(place.folder / "OUT" / "mesh-complete" / "mine"), "mine");
  std::size_t entries = 0;
  for (const auto& entry : fs::directory_iterator(place.folder / "OUT")) {
    EXPECT_EQ(entry.path().filename(), "mesh-complete");
    ++entries;
  }
  EXPECT_EQ(entries, 1u);
}

TEST(CfdCommand, AnInterruptEndsTheMesherAndLeavesNothing) {
  const Workplace place;
  place.fake_mesher("touch " + (place.folder / "started").string() + "; sleep 60");
  const pid_t child = start(place.folder, "cfd model.vtp --units cm --no-picture -o OUT");
  for (int wait = 0; wait < 1000 && !fs::exists(place.folder / "started"); ++wait) usleep(10'000);
  kill(child, SIGINT);
  int status = 0;
  waitpid(child, &status, 0);
  EXPECT_EQ(WEXITSTATUS(status), 130);
  EXPECT_FALSE(fs::exists(place.folder / "OUT"));
}

TEST(CfdCommand, ConditionsFacesAndUnitsMustFit) {
  const Workplace place;
  place.fake_mesher("touch " + (place.folder / "ran").string());
  EXPECT_TRUE(refused(place, place.cfd("model.vtp"), 2, "--units is missing"));
  EXPECT_TRUE(refused(place, place.cfd("model.vtp --units mm"), 3, "which is no vessel"));
  write_text(place.folder / "bc.json",
             R"({"faces": {"aorta": {"inflow": "50 mL/s"}, "right": {"pressure": "90 mmHg"}}})");
  EXPECT_TRUE(refused(place, place.cfd(), 2, "no condition for left"));
  write_text(place.folder / "bc.json", Workplace::conditions("-50 mL/s"));
  EXPECT_TRUE(refused(place, place.cfd(), 2, "flow into the vessel is positive here"));
  // A cap whose file is missing.
  fs::create_directory(place.folder / "caps");
  TriangleMesh cap{place.model.mesh.points, {}};
  for (std::size_t t = 0; t < place.model.faces.size(); ++t) {
    if (place.model.faces[t] == 7) cap.triangles.push_back(place.model.mesh.triangles[t]);
  }
  vessels::write_triangles(cap, {}, {}, place.folder / "caps" / "aorta.vtp");
  EXPECT_TRUE(refused(place, place.cfd("model.vtp --units cm --faces caps"), 4, "cap"));
  // A result folder says its unit itself.
  fs::create_directory(place.folder / "result");
  fs::copy_file(place.folder / "model.vtp", place.folder / "result" / "stented.vtp");
  write_text(place.folder / "result" / "case.json",
             R"({"vessel": {"surface": "wall.vtp", "units": "cm"},
                 "stent": {"at": "lesion", "length": "8mm", "diameter": "4mm"}})");
  EXPECT_TRUE(refused(place, place.cfd("result --units mm"), 2, "--units mm contradicts"));
  EXPECT_TRUE(
      refused(place, place.cfd("result --remesh region"), 3, "no point array Displacement"));
  EXPECT_FALSE(fs::exists(place.folder / "ran"));
}

}  // namespace
}  // namespace vstent::tests
