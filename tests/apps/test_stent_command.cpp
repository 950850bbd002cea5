// `vstent designs` and `vstent stent` as a person runs them.
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "tests/apps/command.hpp"
#include "vessels/centerline.hpp"
#include "vessels/surface.hpp"

namespace vstent::apps {
namespace {

namespace fs = std::filesystem;
using tests::read_text;
using Result = tests::CommandResult;
using tests::TemporaryFolder;
using tests::vstent;
using tests::write_text;

/// Files in the folder other than what the command printed.
std::size_t files(const TemporaryFolder& folder) {
  std::size_t count = 0;
  for (const auto& entry : fs::directory_iterator(folder.path())) {
    const std::string name = entry.path().filename().string();
    count += name != "out.txt" && name != "err.txt";
  }
  return count;
}

TEST(DesignsCommand, ListsAndExplains) {
  const TemporaryFolder folder;
  const Result list = vstent(folder, "designs");
  ASSERT_EQ(list.exit_code, 0) << list.err;
  for (const char* name : {"xience_s", "cp8", "ped", "coil", "zstent"}) {
    EXPECT_NE(list.out.find(name), std::string::npos) << name;
  }
  EXPECT_NE(list.out.find("patterned after"), std::string::npos);
  const Result one = vstent(folder, "designs cp8");
  ASSERT_EQ(one.exit_code, 0) << one.err;
  EXPECT_NE(one.out.find("remembered"), std::string::npos);
  EXPECT_NE(one.out.find("geometric limit"), std::string::npos);
  EXPECT_NE(one.out.find("after deflation"), std::string::npos);
}

TEST(DesignsCommand, JsonIsADesignFile) {
  const TemporaryFolder folder;
  const Result first = vstent(folder, "designs element --json");
  ASSERT_EQ(first.exit_code, 0) << first.err;
  write_text(folder / "mine.json", first.out);
  EXPECT_EQ(vstent(folder, "designs mine.json --json").out, first.out);
  const auto all = nlohmann::json::parse(vstent(folder, "designs --json").out);
  EXPECT_EQ(all.size(), 16u);
}

TEST(StentCommand, WritesCentreLinesSurfaceAndLevelSet) {
  const TemporaryFolder folder;
  const std::string options = "stent palmaz_l --diameter 10mm --length 8mm ";
  for (const char* file : {"s.vtp", "s.stl", "s.vdb"}) {
    const std::string voxel = std::string(file) == "s.vtp" ? "" : "--voxel 0.05mm ";
    const Result result = vstent(folder, options + voxel + "-o " + file);
    ASSERT_EQ(result.exit_code, 0) << result.err;
    EXPECT_NE(result.out.find("2 rings"), std::string::npos) << result.out;
    EXPECT_GT(fs::file_size(folder / file), 1000u);
  }
  // the surface reaches from end to end and to the outer diameter, to within half a voxel
  const vessels::Surface surface = vessels::read_surface(folder / "s.stl", vessels::LengthUnit::mm);
  double low = 1e9, high = -1e9, radius = 0;
  for (const Vec3& p : surface.mesh.points) {
    low = std::min(low, p.z());
    high = std::max(high, p.z());
    radius = std::max(radius, p.head<2>().norm());
  }
  EXPECT_NEAR(low, 0, 0.025);
  EXPECT_NEAR(high, 2 * 3.5847 + 0.14, 0.025);  // rows of sqrt(3.905^2 - (pi 4.93 / 10)^2)
  EXPECT_NEAR(radius, 5, 0.025);
  const std::string lines = read_text(folder / "s.vtp");
  for (const char* array : {"Radius", "Outward", "Kind", "Ring", "NextRing"}) {
    EXPECT_NE(lines.find(std::string("Name=\"") + array), std::string::npos) << array;
  }
}

TEST(StentCommand, FollowsACenterline) {
  const TemporaryFolder folder;
  vessels::Centerline centerline;
  centerline.branches.push_back({});
  for (int i = 0; i <= 200; ++i) {
    const double angle = 0.01 * i;  // a bend of 20 mm
    centerline.branches[0].points.emplace_back(20 * std::cos(angle), 20 * std::sin(angle), 0);
    centerline.branches[0].radii.push_back(1.5);
  }
  vessels::write_centerline(centerline, vessels::LengthUnit::cm, folder / "cl.vtp");
  const Result result = vstent(folder,
                               "stent xience_s --diameter 3mm --length 10mm --centerline cl.vtp "
                               "--units cm --at 0:20mm --voxel 0.04mm -o s.stl");
  ASSERT_EQ(result.exit_code, 0) << result.err;
  const vessels::Surface surface = vessels::read_surface(folder / "s.stl", vessels::LengthUnit::cm);
  for (const Vec3& p : surface.mesh.points) {
    // the torus around the bend, give or take what stiff rings of 0.9 mm poke out: h^2/(8 (20 - R))
    const double off = std::hypot(p.head<2>().norm() - 20, p.z());
    EXPECT_LT(off, 1.5 + 0.04);
    EXPECT_GT(off, 1.5 - 0.081 - 0.04);
  }
}

TEST(StentCommand, DrawsASurfaceAtAnotherDiameterOnACenterline) {
  const TemporaryFolder folder;
  ASSERT_EQ(vstent(folder, "stent palmaz_l --diameter 10mm --length 8mm --voxel 0.1mm -o s.stl")
                .exit_code,
            0);
  vessels::Centerline centerline;
  centerline.branches.push_back({});
  for (int i = 0; i <= 200; ++i) {
    const double angle = 0.01 * i;  // a bend of 20 mm
    centerline.branches[0].points.emplace_back(20 * std::cos(angle), 20 * std::sin(angle), 0);
    centerline.branches[0].radii.push_back(5);
  }
  vessels::write_centerline(centerline, vessels::LengthUnit::cm, folder / "cl.vtp");
  const Result result = vstent(
      folder, "stent s.stl --diameter 11mm --centerline cl.vtp --units cm --at 0:20mm -o t.vtp");
  ASSERT_EQ(result.exit_code, 0) << result.err;
  EXPECT_NE(result.err.find("without a mechanism"), std::string::npos) << result.err;
  const vessels::Surface before = vessels::read_surface(folder / "s.stl", vessels::LengthUnit::mm);
  const vessels::Surface after = vessels::read_surface(folder / "t.vtp", vessels::LengthUnit::cm);
  EXPECT_EQ(before.mesh.triangles.size(), after.mesh.triangles.size());
  double innermost = 1e9, outermost = 0;
  for (const Vec3& p : after.mesh.points) {
    const double off = std::hypot(p.head<2>().norm() - 20, p.z());
    innermost = std::min(innermost, off);
    outermost = std::max(outermost, off);
  }
  // The axis is smoothed over 4 mm, which moves a bend of 20 mm by less than this.
  EXPECT_NEAR(outermost, 5.5, 0.02);
  // As thick as it was, 0.14 mm, to within the voxels that it was drawn with.
  EXPECT_NEAR(outermost - innermost, 0.14, 0.1);
  const Result voxels = vstent(folder, "stent s.stl --diameter 9mm --voxel 0.1mm -o t.vdb");
  EXPECT_EQ(voxels.exit_code, 0) << voxels.err;
  for (const auto& [arguments, reason] : {std::pair("--length 9mm -o n.stl", "--length"),
                                          {"--bending rigid -o n.stl", "--bending"},
                                          {"--voxel 0.1mm -o n.stl", "--voxel"}}) {
    const std::string centre =
        std::string("stent s.stl --diameter 9mm ") +
        (std::string(arguments).starts_with("--bending") ? "--centerline cl.vtp --units cm " : "");
    const Result refused = vstent(folder, centre + arguments);
    EXPECT_EQ(refused.exit_code, 2) << refused.err;
    EXPECT_NE(refused.err.find(reason), std::string::npos) << refused.err;
    EXPECT_FALSE(fs::exists(folder / "n.stl"));
  }
}

TEST(StentCommand, RefusesWithTheReasonAndLeavesNothing) {
  const TemporaryFolder folder;
  const auto refused = [&](const std::string& arguments, int code, const std::string& reason) {
    const Result result = vstent(folder, "stent " + arguments);
    EXPECT_EQ(result.exit_code, code) << arguments << ": " << result.err;
    EXPECT_NE(result.err.find(reason), std::string::npos) << result.err;
    EXPECT_EQ(files(folder), 0u) << arguments;
  };
  refused("xience_s --diameter 6mm -o s.stl", 2, "largest, 4.573 mm");
  refused("xience_s --diameter 3 -o s.stl", 2, "with its unit");
  refused("xience --diameter 3mm -o s.stl", 2, "did you mean \"xience_s\"");
  refused("xience_s --diameter 3mm -o s.ply", 2, ".vdb (level set)");
  refused("xience_s --diameter 3mm --at 0:3mm -o s.stl", 2, "needs a --centerline");
  refused("xience_s --diameter 3mm --voxel 0.0005mm -o s.vdb", 7, "voxels of 0.00");
  refused("xience_s --diameter 3mm -o absent/s.vtp", 6, "no folder");
  refused("absent.json --diameter 3mm -o s.vtp", 2, "cannot be read");
}

}  // namespace
}  // namespace vstent::apps
