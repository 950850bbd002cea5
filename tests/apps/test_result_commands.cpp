// Figures and windows of a result folder, as a person asks for them.
#include <gtest/gtest.h>

#include "tests/apps/command.hpp"
#include "vessels/idealised.hpp"
#include "vessels/surface.hpp"

namespace vstent::apps {
namespace {

namespace fs = std::filesystem;
using tests::CommandResult;
using tests::read_text;
using tests::TemporaryFolder;
using tests::vstent;

/// One deployment for all tests; it writes no report.
class ResultCommands : public testing::Test {
 protected:
  static void SetUpTestSuite() {
    folder = new TemporaryFolder;
    vessels::IdealisedVessel vessel;
    vessel.edge_length = 1.0;
    const vessels::Surface surface =
        vessels::make_surface(vessels::idealised_vessel(vessel), "ideal");
    vessels::write_surface(surface, surface.mesh.points,
                           std::vector<char>(surface.mesh.points.size(), 0),
                           *folder / "vessel.vtp");
    const CommandResult done =
        vstent(*folder,
               "deploy vessel.vtp --units mm --at lesion --length 24mm --diameter 10mm "
               "--no-pictures --no-report -o OUT");
    ASSERT_EQ(done.exit_code, 0) << done.err;
  }
  static void TearDownTestSuite() { delete folder; }
  static inline TemporaryFolder* folder = nullptr;
};

std::size_t count(const std::string& text, const std::string& what) {
  std::size_t found = 0;
  for (std::size_t at = text.find(what); at != std::string::npos; at = text.find(what, at + 1))
    ++found;
  return found;
}

TEST_F(ResultCommands, ReportWritesWhatDeployLeftOut) {
  ASSERT_FALSE(fs::exists(*folder / "OUT/report.html"));
  const CommandResult done = vstent(*folder, "report OUT -o page.html");
  if (done.err.find("VSTENT_REPORT=OFF") != std::string::npos) {
    EXPECT_EQ(done.exit_code, 2);
    GTEST_SKIP() << "built with VSTENT_REPORT=OFF";
  }
  ASSERT_EQ(done.exit_code, 0) << done.err;
  const std::string page = read_text(*folder / "page.html");
  EXPECT_EQ(page.substr(0, 15), "<!doctype html>");
  EXPECT_NE(page.find("not for clinical use"), std::string::npos);
  const CommandResult none = vstent(*folder, "report NOWHERE");
  EXPECT_EQ(none.exit_code, 3);
  EXPECT_EQ(count(none.err, "\n"), 1u) << none.err;
}

TEST_F(ResultCommands, TheProfileIsDrawnAsLinesWithUnits) {
  const CommandResult done = vstent(*folder, "render OUT --figure profile -o profile.svg");
  ASSERT_EQ(done.exit_code, 0) << done.err;
  const std::string svg = read_text(*folder / "profile.svg");
  EXPECT_EQ(svg.substr(0, 4), "<svg");
  for (const char* text : {"(mm)", ">before<", ">after<", ">nominal<", "not for clinical use"})
    EXPECT_NE(svg.find(text), std::string::npos) << text;
  EXPECT_EQ(svg.find("nan"), std::string::npos);
  EXPECT_EQ(svg.find("inf"), std::string::npos);
}

TEST_F(ResultCommands, PicturesAreDrawnOffScreen) {
  for (const std::string figure : {"stages", "compare", "profile"}) {
    const CommandResult done =
        vstent(*folder, "render OUT --figure " + figure + " -o " + figure + ".png");
    if (done.err.find("Xvfb") != std::string::npos) GTEST_SKIP() << "no Xvfb on this machine";
    ASSERT_EQ(done.exit_code, 0) << done.err;
    const std::string png = read_text(*folder / (figure + ".png"));
    EXPECT_EQ(png.substr(1, 3), "PNG") << figure;
    EXPECT_GT(png.size(), 10000u) << figure;
  }
}

TEST_F(ResultCommands, WhatCannotBeDrawnIsSaidInOneLine) {
  const CommandResult svg = vstent(*folder, "render OUT --figure stages -o stages.svg");
  EXPECT_EQ(svg.exit_code, 2);
  EXPECT_NE(svg.err.find(".png"), std::string::npos) << svg.err;
  const CommandResult none = vstent(*folder, "render NOWHERE --figure profile -o p.svg");
  EXPECT_EQ(none.exit_code, 3);
  EXPECT_NE(none.err.find("metrics.json"), std::string::npos) << none.err;
  EXPECT_FALSE(fs::exists(*folder / "stages.svg") || fs::exists(*folder / "p.svg"));
}

TEST_F(ResultCommands, AWindowNeedsADisplay) {
  for (const char* display : {"", ":9876"}) {
    setenv("DISPLAY", display, 1);
    const CommandResult done = vstent(*folder, "view OUT");
    EXPECT_EQ(done.exit_code, 6) << display;
    EXPECT_EQ(done.err.find("error: no display"), 0u) << done.err;
    EXPECT_EQ(count(done.err, "\n"), 1u) << done.err;
  }
  unsetenv("DISPLAY");
}

}  // namespace
}  // namespace vstent::apps
