// vstent flow and vstent sweep as a person runs them.
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "tests/apps/command.hpp"
#include "vessels/file_arrays.hpp"
#include "vessels/idealised.hpp"
#include "vessels/surface.hpp"

namespace vstent::apps {
namespace {

using nlohmann::json;
using tests::CommandResult;
using tests::read_text;
using tests::TemporaryFolder;
using tests::vstent;
using tests::write_text;
namespace fs = std::filesystem;

void write_vessel(const TemporaryFolder& folder) {
  vessels::IdealisedVessel vessel;
  vessel.length = 50;
  vessel.edge_length = 1.5;
  const vessels::Surface surface =
      vessels::make_surface(vessels::idealised_vessel(vessel), "vessel");
  vessels::write_surface(surface, surface.mesh.points,
                         std::vector<char>(surface.mesh.points.size(), 0), folder / "vessel.vtp");
  write_text(folder / "case.json", R"({"vessel": {"surface": "vessel.vtp", "units": "mm"},
    "stent": {"at": "lesion", "length": "20mm", "diameter": "auto"}})");
  write_text(folder / "bc.json", R"({"faces": {
    "inlet": {"inflow": "60 mL/s"},
    "outlet": {"rcr": {"Rp": "100 dyn s/cm5", "C": "0.0008 cm5/dyn", "Rd": "1900 dyn s/cm5"}}}})");
}

double figure(const json& answer) { return answer["mean_pressure_drop_mmHg"].get<double>(); }

void expect_refused(const TemporaryFolder& folder, const std::string& arguments, int exit_code,
                    const std::string& why) {
  const CommandResult result = vstent(folder, arguments + " -o refused");
  EXPECT_EQ(result.exit_code, exit_code) << arguments << '\n' << result.err;
  EXPECT_NE(result.err.find(why), std::string::npos) << arguments << '\n' << result.err;
  EXPECT_EQ(std::count(result.err.begin(), result.err.end(), '\n'), 1) << result.err;
  for (const auto& entry : fs::directory_iterator(folder.path()))
    EXPECT_EQ(entry.path().filename().string().find("refused"), std::string::npos) << arguments;
}

TEST(FlowCommand, ComparesBeforeAndAfter) {
  const TemporaryFolder folder;
  write_vessel(folder);
  const auto deployed = vstent(folder, "deploy case.json --no-pictures --no-report -o out");
  ASSERT_EQ(deployed.exit_code, 0) << deployed.err;
  const auto result = vstent(folder, "flow out --case bc.json");
  ASSERT_EQ(result.exit_code, 0) << result.err;
  EXPECT_NE(result.out.find("uncertainty"), std::string::npos);
  EXPECT_NE(result.out.find("not for clinical use"), std::string::npos);
  const json flow = json::parse(read_text(folder / "out/flow/flow.json"));
  EXPECT_EQ(flow["pressure_drop"]["stretch"], "the treated stretch");
  EXPECT_GT(figure(flow["before"]), 5 * figure(flow["after"]));
  EXPECT_GT(flow["after"]["distal_over_inlet_pressure"],
            flow["before"]["distal_over_inlet_pressure"]);
  // 60 mL/s through 2000 dyn s/cm5 are 90.0 mmHg at the outlet, whatever the stent.
  for (const char* when : {"before", "after"})
    EXPECT_NEAR(flow[when]["faces"]["outlet"]["mean_pressure_mmHg"], 60 * 2000 / 1333.22387415,
                1e-6);
  for (const char* name : {"flow.svg", "flow.vtp", "svzerod_before.json", "svzerod_after.json"})
    EXPECT_TRUE(fs::exists(folder / "out/flow" / name)) << name;
  EXPECT_EQ(
      vessels::read_polylines(folder / "out/flow/flow.vtp", vessels::LengthUnit::mm).lines.size(),
      1u);
  // The whole of a folder: the same bytes again, by any number of threads.
  const auto again = vstent(folder, "flow out --case bc.json --picture --threads 1 -o again");
  ASSERT_EQ(again.exit_code, 0) << again.err;
  for (const char* name : {"flow.json", "flow.svg", "svzerod_after.json"})
    EXPECT_EQ(read_text(folder / "again" / name), read_text(folder / "out/flow" / name)) << name;
}

TEST(FlowCommand, TakesASurfaceAlone) {
  const TemporaryFolder folder;
  write_vessel(folder);
  const auto result = vstent(folder, "flow vessel.vtp --units mm --inflow \"3.6 L/min\" -o flow");
  ASSERT_EQ(result.exit_code, 0) << result.err;
  const json flow = json::parse(read_text(folder / "flow/flow.json"));
  EXPECT_TRUE(flow["before"].is_null());
  EXPECT_NEAR(flow["inflow"]["mean_mL_per_s"], 60, 1e-9);
  EXPECT_NEAR(flow["after"]["faces"]["outlet"]["mean_pressure_mmHg"], 93, 1e-6);
  const auto faces = vstent(folder, "flow vessel.vtp --units mm --list-faces");
  EXPECT_NE(faces.out.find("inlet at ("), std::string::npos) << faces.out;
  EXPECT_NE(faces.out.find("outlet at ("), std::string::npos) << faces.out;
}

TEST(FlowCommand, BadInputIsOneLineAndNothingWritten) {
  const TemporaryFolder folder;
  write_vessel(folder);
  const std::string flow = "flow vessel.vtp --units mm ";
  expect_refused(folder, flow, 2, "give either --case");
  expect_refused(folder, flow + "--case absent.json", 2, "absent.json");
  expect_refused(folder, "flow absent.vtp --units mm --case bc.json", 3, "absent.vtp");
  expect_refused(folder, "flow vessel.vtp --case bc.json", 2, "--units is missing");
  expect_refused(folder, flow + "--inflow \"-5 mL/s\"", 2, "must be positive");
  expect_refused(folder, flow + "--inflow \"5 mmHg\"", 2, "is the unit of a pressure");
  expect_refused(folder, "flow . --case bc.json", 3, "has no centerline.vtp");
  const auto with = [&](const std::string& text, const std::string& why) {
    write_text(folder / "wrong.json", text);
    expect_refused(folder, flow + "--case wrong.json", 2, why);
  };
  const std::string outlet = R"("outlet": {"resistance": "1000 dyn s/cm5"})";
  with(R"({"faces": {"inlet": {"inflow": "5 L/min"}, )" + outlet + R"(}, "colour": 1})",
       "/colour: unknown key");
  with(R"({"faces": {"inlet": {"inflow": "5 L/min"}, "left": {"pressure": "80 mmHg"}}})",
       "no condition for outlet");
  with(R"({"faces": {"inlet": {"inflow": {"file": "no.flow", "units": "mL/s"}}, )" + outlet + "}}",
       "no.flow does not exist");
  write_text(folder / "in.flow", "0 50\n1 50\n");
  with(
      R"({"faces": {"inlet": {"inflow": {"file": "in.flow", "units": "mL/s", "positive": "out"}}, )" +
          outlet + "}}",
      "contradicts");
  with(R"({"faces": {"inlet": {"inflow": "5000 mL/s"}, )" + outlet + "}}", "is a unit wrong?");
}

TEST(SweepCommand, DropsFallWithTheDiameterAndTheTargetIsFound) {
  const TemporaryFolder folder;
  write_vessel(folder);
  // 4 mm is below the present lumen of 5 mm: refused, the others go on.
  const auto result = vstent(
      folder, "sweep case.json --diameter 4mm,6mm,7.5mm,9mm --flow bc.json --no-pictures -o sweep");
  EXPECT_EQ(result.exit_code, 4) << result.err;
  EXPECT_NE(result.err.find("not deployed: 4mm"), std::string::npos) << result.err;
  const json sweep = json::parse(read_text(folder / "sweep/sweep.json"));
  ASSERT_EQ(sweep["diameters"].size(), 4u);
  EXPECT_TRUE(sweep["diameters"][0].contains("refused"));
  double last = figure(sweep["before"]);
  for (std::size_t i = 1; i < 4; ++i) {
    const json& entry = sweep["diameters"][i];
    EXPECT_LT(figure(entry), last) << entry;
    last = figure(entry);
    EXPECT_TRUE(fs::exists(folder / "sweep" / entry["folder"].get<std::string>() / "stented.vtp"));
  }
  EXPECT_TRUE(fs::exists(folder / "sweep/sweep.csv") && fs::exists(folder / "sweep/sweep.svg"));

  // One after the other instead of side by side, with a target between two diameters.
  const double target = 0.5 * (figure(sweep["diameters"][1]) + figure(sweep["diameters"][2]));
  const auto found = vstent(folder,
                            "sweep case.json --diameter 6mm,7.5mm,9mm --flow bc.json "
                            "--no-pictures --threads 1 -o found --target-gradient " +
                                std::to_string(target) + "mmHg");
  ASSERT_EQ(found.exit_code, 0) << found.err;
  const json answer = json::parse(read_text(folder / "found/sweep.json"));
  ASSERT_TRUE(answer["target"]["reached"].get<bool>());
  EXPECT_LE(answer["target"]["drop_there_mmHg"], target);
  EXPECT_GT(answer["target"]["diameter_mm"], 6);
  EXPECT_LT(answer["target"]["diameter_mm"], 7.5);
  for (const char* name : {"6mm", "9mm"}) {
    for (const char* file : {"stented.vtp", "flow/flow.json"})
      EXPECT_EQ(read_text(folder / "found" / name / file),
                read_text(folder / "sweep" / name / file))
          << name << ' ' << file;
  }
}

TEST(SweepCommand, SaysWhenNoDiameterReachesTheTarget) {
  const TemporaryFolder folder;
  write_vessel(folder);
  const auto none = vstent(folder,
                           "sweep case.json --diameter 6mm,7mm --inflow \"60 mL/s\" "
                           "--no-pictures --target-gradient 0.001mmHg -o none");
  ASSERT_EQ(none.exit_code, 0) << none.err;
  EXPECT_NE(none.out.find("none of the diameters from 6 mm to 7 mm reaches"), std::string::npos)
      << none.out;
  const json answer = json::parse(read_text(folder / "none/sweep.json"));
  EXPECT_FALSE(answer["target"]["reached"].get<bool>());
}

TEST(SweepCommand, BadInputIsOneLineAndNothingWritten) {
  const TemporaryFolder folder;
  write_vessel(folder);
  expect_refused(folder, "sweep case.json --diameter 6:9:4 --flow bc.json", 2, "needs a unit");
  expect_refused(folder, "sweep case.json --diameter 6mm,7mm", 2, "give either --flow");
  expect_refused(folder, "sweep absent.json --diameter 6mm,7mm --flow bc.json", 2, "absent.json");
  expect_refused(folder, "sweep case.json --diameter 6mm,7mm --flow bc.json --target-gradient 5mm",
                 2, "--target-gradient");
}

}  // namespace
}  // namespace vstent::apps
