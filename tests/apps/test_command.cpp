// The command as a person runs it: exit codes, messages, files, interruptions.
#include <gtest/gtest.h>
#include <signal.h>

#include <chrono>
#include <cmath>
#include <nlohmann/json.hpp>
#include <thread>

#include "tests/apps/command.hpp"
#include "vessels/idealised.hpp"
#include "vessels/surface.hpp"

namespace vstent::apps {
namespace {

namespace fs = std::filesystem;
using tests::read_text;
using Result = tests::CommandResult;
using tests::start;
using tests::TemporaryFolder;
using tests::vstent;
using tests::write_text;

fs::path ideal_vessel(const TemporaryFolder& folder) {
  vessels::IdealisedVessel vessel;
  vessel.edge_length = 1.0;
  const vessels::Surface surface =
      vessels::make_surface(vessels::idealised_vessel(vessel), "ideal");
  const fs::path path = folder / "vessel.vtp";
  vessels::write_surface(surface, surface.mesh.points,
                         std::vector<char>(surface.mesh.points.size(), 0), path);
  return path;
}

std::string stent_options(const fs::path& surface) {
  return "deploy " + surface.string() +
         " --units mm --at lesion --length 24mm --diameter 10mm --no-pictures --no-report";
}

const char* const kFiles[] = {"stented.vtp",    "stent.vtp",    "stent.vdb",
                              "centerline.vtp", "case.json",    "metrics.json",
                              "history.csv",    "profiles.csv", "sections.vtp"};

TEST(Command, DeploysAndItsCaseFileGivesTheSameBytesAgain) {
  const TemporaryFolder folder;
  const fs::path surface = ideal_vessel(folder);
  const Result first = vstent(folder, stent_options(surface) + " -o " + (folder / "a").string());
  ASSERT_EQ(first.exit_code, 0) << first.err;
  EXPECT_NE(first.out.find("not for clinical use"), std::string::npos);
  EXPECT_EQ(first.err.find('\r'), std::string::npos) << "progress is for terminals";
  for (const std::string threads : {"1", "2"}) {
    const Result again =
        vstent(folder, "deploy " + (folder / "a/case.json").string() + " --no-pictures --threads " +
                           threads + " -o " + (folder / "b").string());
    ASSERT_EQ(again.exit_code, 0) << again.err;
    for (const char* file : kFiles) {
      EXPECT_TRUE(read_text(folder / "a" / file) == read_text(folder / "b" / file))
          << file << ", " << threads << " threads";
      EXPECT_FALSE(read_text(folder / "a" / file).empty()) << file;
    }
  }
  const auto metrics = nlohmann::json::parse(read_text(folder / "a/metrics.json"));
  EXPECT_NEAR(metrics["lumen"]["opened_mean_diameter_over_target"].get<double>(), 1, 0.01);
}

TEST(Command, DrawsThePictureWhereItCan) {
  const TemporaryFolder folder;
  const fs::path surface = ideal_vessel(folder);
  std::string options = stent_options(surface);
  options.erase(options.find(" --no-pictures"), std::string(" --no-pictures").size());
  const Result result = vstent(folder, options + " -o " + (folder / "a").string());
  ASSERT_EQ(result.exit_code, 0) << result.err;
  if (result.err.find("no picture") != std::string::npos) GTEST_SKIP() << "no Xvfb on this machine";
  const std::string png = read_text(folder / "a/stages.png");
  ASSERT_GT(png.size(), 10000u);
  EXPECT_EQ(png.substr(1, 3), "PNG");
}

TEST(Command, AKilledRunLeavesTheOutputFolderAsItWas) {
  const TemporaryFolder folder;
  const fs::path surface = ideal_vessel(folder);
  fs::create_directory(folder / "a");
  write_text(folder / "a/metrics.json", "old");
  for (const int signal : {SIGKILL, SIGINT, SIGTERM}) {
    const pid_t child =
        start(folder, stent_options(surface) + " --save-steps 1 -o " + (folder / "a").string());
    while (!fs::exists(folder / ("a.partial-" + std::to_string(child)) / "steps")) {
      ASSERT_EQ(waitpid(child, nullptr, WNOHANG), 0) << "ended before it could be killed";
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
    }
    kill(child, signal);
    int status = 0;
    waitpid(child, &status, 0);
    if (signal == SIGKILL) {
      EXPECT_TRUE(WIFSIGNALED(status));
    } else {
      EXPECT_EQ(WEXITSTATUS(status), 130) << read_text(folder / "err.txt");
    }
    EXPECT_EQ(read_text(folder / "a/metrics.json"), "old");
    EXPECT_EQ(std::distance(fs::directory_iterator(folder / "a"), fs::directory_iterator{}), 1);
  }
}

TEST(Command, ComparesDesignsInOneVessel) {
  const TemporaryFolder folder;
  vessels::IdealisedVessel vessel;
  vessel.radius = 1.5;
  vessel.length = 8;
  vessel.stenosis = 0;
  vessel.edge_length = 0.3;
  const vessels::Surface surface =
      vessels::make_surface(vessels::idealised_vessel(vessel), "ideal");
  vessels::write_surface(surface, surface.mesh.points,
                         std::vector<char>(surface.mesh.points.size(), 0), folder / "vessel.vtp");
  write_text(folder / "case.json", R"({"vessel": {"surface": "vessel.vtp", "units": "mm"},
    "stent": {"at": [0, 0, 4], "length": "2.5mm", "diameter": "3.2mm", "cell": "closed"}})");
  // Fewer crowns reach less far.
  write_text(folder / "too_small.json",
             R"({"preset": "xience_s", "crowns": 4, "nominal_diameter": "2.5mm",
    "connectors": {"count": 2}})");
  const Result result = vstent(
      folder, "compare case.json --designs smooth,xience_s,too_small.json --no-pictures -o out");
  const auto table = nlohmann::json::parse(read_text(folder / "out/compare.json"));
  ASSERT_EQ(table["designs"].size(), 3u);
  const std::string csv = read_text(folder / "out/compare.csv");
  EXPECT_EQ(csv.find("measure,unit,key,smooth,xience_s,too_small\n"), 0u);
  EXPECT_TRUE(table["designs"][2].contains("refused"));
  EXPECT_NE(result.exit_code, 0);
  EXPECT_NE(result.err.find("not deployed: too_small"), std::string::npos) << result.err;
  EXPECT_FALSE(fs::exists(folder / "out/too_small"));
  for (const auto& row : table["designs"]) {
    if (row.contains("refused")) continue;
    const std::string name = row["folder"];
    const auto own = nlohmann::json::parse(read_text(folder / "out" / name / "metrics.json"));
    EXPECT_EQ(row["metrics"]["/lumen/narrowest_after_mm"], own["lumen"]["narrowest_after_mm"]);
  }
  EXPECT_FALSE(table["designs"][0].contains("refused"));
  EXPECT_FALSE(table["designs"][1].contains("refused"));
  EXPECT_NE(result.out.find("largest prolapse"), std::string::npos);

  const Result unknown =
      vstent(folder, "compare case.json --designs smooth,nosuch --no-pictures -o other");
  EXPECT_NE(unknown.exit_code, 0);
  EXPECT_NE(unknown.err.find("nosuch"), std::string::npos);
  EXPECT_FALSE(fs::exists(folder / "other"));
}

TEST(Command, RefusesWithOneLineAndWritesNothing) {
  const TemporaryFolder folder;
  const fs::path surface = ideal_vessel(folder);
  const std::string whole = read_text(surface);
  write_text(folder / "truncated.vtp", whole.substr(0, whole.size() / 2));
  write_text(folder / "empty.vtp", "");
  write_text(folder / "nan.stl",
             "solid a\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex nan 1 0\nvertex 1 0 "
             "0\nendloop\nendfacet\n"
             "endsolid a\n");
  write_text(folder / "bad.json", "{ \"vessel\": ");
  const std::string sizes = " --units mm --length 24mm --diameter 10mm";
  const std::pair<std::string, int> cases[] = {
      {(folder / "truncated.vtp").string() + sizes, 3},
      {(folder / "empty.vtp").string() + sizes, 3},
      {(folder / "nan.stl").string() + sizes, 3},
      {(folder / "absent.stl").string() + sizes, 3},
      {folder.path().string() + sizes, 3},
      {(folder / "bad.json").string(), 2},
      {surface.string() + " --units mm --length 24 --diameter 10mm", 2},
      {surface.string() + " --length 24mm --diameter 10mm", 2},
      {surface.string() + " --units m --length 24mm --diameter 10mm", 3},
      {surface.string() + " --units mm --length 24mm --diameter 4mm", 4},
      {surface.string() + " --units mm --length 70mm --diameter 10mm", 4},
      {surface.string() + sizes + " --at 1,2", 2},
      {surface.string() + sizes + " --no-such-option", 2},
  };
  for (const auto& [arguments, exit_code] : cases) {
    const Result result =
        vstent(folder, "deploy " + arguments + " -o " + (folder / "result").string());
    EXPECT_EQ(result.exit_code, exit_code) << arguments << "\n" << result.err;
    EXPECT_TRUE(result.err.starts_with("error: ")) << arguments << "\n" << result.err;
    EXPECT_EQ(std::count(result.err.begin(), result.err.end(), '\n'), 1) << result.err;
    for (const auto& entry : fs::directory_iterator(folder.path())) {
      EXPECT_FALSE(entry.path().filename().string().starts_with("result")) << entry.path();
    }
  }
}

TEST(Command, ChecksAndExtractsCenterlines) {
  const TemporaryFolder folder;
  const fs::path surface = ideal_vessel(folder);
  const Result check = vstent(folder, "check " + surface.string() + " --units mm --json");
  EXPECT_EQ(check.exit_code, 0) << check.err;
  const auto report = nlohmann::json::parse(check.out);
  EXPECT_TRUE(report["stentable"].get<bool>());
  EXPECT_EQ(report["openings"].size(), 2u);
  const Result centerline = vstent(
      folder, "centerline " + surface.string() + " --units mm -o " + (folder / "cl.vtp").string());
  EXPECT_EQ(centerline.exit_code, 0) << centerline.err;
  const Result deploy =
      vstent(folder, stent_options(surface) + " --centerline " + (folder / "cl.vtp").string() +
                         " -o " + (folder / "a").string());
  EXPECT_EQ(deploy.exit_code, 0) << deploy.err;
}

TEST(Command, HelpHasExamplesAtEveryLevel) {
  const TemporaryFolder folder;
  for (const std::string level : {"", "deploy", "check", "centerline", "demo"}) {
    const Result help = vstent(folder, level + " --help");
    EXPECT_EQ(help.exit_code, 0);
    EXPECT_NE(help.out.find("Example"), std::string::npos) << level;
  }
  EXPECT_NE(vstent(folder, "--help").out.find("not for clinical use"), std::string::npos);
}

}  // namespace
}  // namespace vstent::apps
