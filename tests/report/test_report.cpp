// The page as a file: what it holds, what it refuses, what it leaves out and says so.
#include <gtest/gtest.h>

#include <cmath>
#include <nlohmann/json.hpp>
#include <numbers>

#include "measure/definitions.hpp"
#include "report/page.hpp"
#include "report/report.hpp"
#include "tests/temporary_folder.hpp"
#include "vessels/error.hpp"
#include "vessels/surface.hpp"

namespace vstent::report {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;
using tests::read_text;
using tests::TemporaryFolder;
using tests::write_text;

constexpr int kAround = 24, kAlong = 20;

/// An open tube of radius `radius` along z, 20 mm long.
TriangleMesh tube(double radius) {
  TriangleMesh mesh;
  for (int j = 0; j <= kAlong; ++j) {
    for (int i = 0; i < kAround; ++i) {
      const double angle = 2 * std::numbers::pi * i / kAround;
      mesh.points.emplace_back(radius * std::cos(angle), radius * std::sin(angle), j);
    }
  }
  for (int j = 0; j < kAlong; ++j) {
    for (int i = 0; i < kAround; ++i) {
      const int a = j * kAround + i, b = j * kAround + (i + 1) % kAround;
      mesh.triangles.push_back({a, b, b + kAround});
      mesh.triangles.push_back({a, b + kAround, a + kAround});
    }
  }
  return mesh;
}

/// Points in mm; the file is in mm too, or `scale` times as large in numbers.
void write_mesh(const TriangleMesh& mesh, const fs::path& path, double scale = 1,
                const vessels::Fields& fields = {}) {
  TriangleMesh scaled = mesh;
  for (Vec3& p : scaled.points) p *= scale;
  const vessels::Surface surface = vessels::make_surface(scaled, "tube");
  vessels::write_surface(surface, surface.mesh.points,
                         std::vector<char>(surface.mesh.points.size(), 0), path, fields);
}

const char* const kMetrics = R"({
  "lumen": {"narrowest_before_mm": 8.000000000000002, "narrowest_after_mm": 10.0},
  "stations": [{"arc_length_mm": 0.0}, {"arc_length_mm": 10.0}],
  "warnings": ["from </script><script>alert(1)</script> <!-- <b>"]
})";

json specification(const std::string& units) {
  return {{"vessel", {{"surface", "a</script>.stl"}, {"units", units}}},
          {"stent", {{"at", {{"branch", 0}, {"arc_length", "10mm"}}}, {"towards", 0}}}};
}

/// A result as deploy leaves it: a tube of radius 4 opened to 5 mm.
void write_result(const fs::path& folder, const std::string& units = "mm") {
  const double scale = units == "cm" ? 0.1 : 1;
  const TriangleMesh before = tube(4), after = tube(5);
  std::vector<double> displacement;
  for (std::size_t v = 0; v < before.points.size(); ++v) {
    for (int k = 0; k < 3; ++k) displacement.push_back(after.points[v][k] - before.points[v][k]);
  }
  write_mesh(after, folder / "stented.vtp", scale, {{"Displacement", displacement}});
  write_mesh(tube(4.9), folder / "stent.vtp", scale);
  Polyline axis;
  for (int j = 0; j <= 20; ++j) axis.push_back(Vec3(0, 0, j));
  vessels::write_polylines({axis}, {{"MaximumInscribedSphereRadius", std::vector<double>(21, 4.0)}},
                           {}, folder / "centerline.vtp", scale);
  write_text(folder / "case.json", specification(units).dump(2) + "\n");
  write_text(folder / "metrics.json", kMetrics);
}

void write_steps(const fs::path& folder, int count) {
  fs::create_directory(folder / "steps");
  std::string list;
  for (int step = 1; step <= count; ++step) {
    const std::string number = std::to_string(step);
    write_mesh(tube(4 + 1.0 * step / count), folder / ("steps/wall_" + number + ".vtp"));
    write_mesh(tube(3.9 + 1.0 * step / count), folder / ("steps/stent_" + number + ".vtp"));
    for (const char* part : {"0", "1"}) {
      list += "<DataSet timestep=\"" + number + "\" part=\"" + part + "\" file=\"steps/" +
              (*part == '0' ? "wall_" : "stent_") + number + ".vtp\"/>\n";
    }
  }
  write_text(folder / "steps.pvd", list);
}

Options options() {
  return {.name = "a <b> & \"c\"", .version = "1", .disclaimer = "no", .shown_folder = "OUT"};
}

std::size_t count(const std::string& text, const std::string& what) {
  std::size_t found = 0;
  for (std::size_t at = text.find(what); at != std::string::npos; at = text.find(what, at + 1))
    ++found;
  return found;
}

/// The content of a data block, as a browser hands it to the page's script.
std::string block(const std::string& html, const std::string& id) {
  const std::string head = "id=\"data-" + id + "\">";
  const std::size_t begin = html.find(head);
  if (begin == std::string::npos) return {};
  return html.substr(begin + head.size(), html.find("</script>", begin) - begin - head.size());
}

class Report : public testing::Test {
 protected:
  void SetUp() override {
    if (!available()) GTEST_SKIP() << "built with VSTENT_REPORT=OFF";
  }
  TemporaryFolder folder;
};

TEST_F(Report, HoldsTheFiguresAsTheyWereWritten) {
  write_result(folder.path());
  const Written written = write_report(folder.path(), folder / "r.html", options());
  const std::string html = read_text(folder / "r.html");
  EXPECT_EQ(written.bytes, html.size());
  EXPECT_EQ(json::parse(block(html, "metrics")), json::parse(kMetrics));
  EXPECT_NE(block(html, "metrics").find("8.000000000000002"), std::string::npos);
  EXPECT_EQ(json::parse(block(html, "case")), specification("mm"));
  const json summary = json::parse(block(html, "summary"));
  EXPECT_EQ(summary["name"], options().name);
  EXPECT_EQ(summary["definitions"].size(), measure::definitions().size());
  EXPECT_TRUE(written.warnings.empty());
  write_report(folder.path(), folder / "again.html", options());
  EXPECT_TRUE(html == read_text(folder / "again.html"));
}

TEST_F(Report, DataEndNoScriptAndOpenNone) {
  write_result(folder.path());
  write_report(folder.path(), folder / "r.html", options());
  const std::string html = read_text(folder / "r.html");
  const std::string bare(page());
  constexpr std::size_t kBlocks = 4;  // summary, scene, metrics, case
  EXPECT_EQ(count(html, "<script"), count(bare, "<script") + kBlocks);
  EXPECT_EQ(count(html, "</script"), count(bare, "</script") + kBlocks);
  EXPECT_EQ(count(html, "<!--"), count(bare, "<!--") - 1) << "the mark is replaced";
  EXPECT_EQ(html.find("<b>"), std::string::npos);
}

TEST_F(Report, IsInMillimetresWhateverTheFilesAreIn) {
  write_result(folder.path(), "cm");
  write_report(folder.path(), folder / "r.html", options());
  const json scene = json::parse(block(read_text(folder / "r.html"), "scene"));
  // The box of wall before and after: radius 5 mm, 20 mm long. Only right when the wall before is
  // narrower, that is, when Displacement is taken as the mm it is in.
  const json& box = scene["pack"]["arrays"][0]["box"];
  for (int k = 0; k < 3; ++k) {
    EXPECT_NEAR(box[0][k].get<double>(), k < 2 ? -5 : 0, 1e-6);
    EXPECT_NEAR(box[1][k].get<double>(), k < 2 ? 5 : 20, 1e-6);
  }
  // Outlines of before and after at both stations, less those that end openings leave open.
  const json& states = scene["outline_arrays"]["After"];
  EXPECT_GE(states.size(), 2u);
  EXPECT_EQ(scene["outline_arrays"]["Station"].size(), states.size());
}

TEST_F(Report, SaysWhichFilesItLacks) {
  write_result(folder.path());
  fs::remove(folder / "stent.vtp");
  const Written written = write_report(folder.path(), folder / "r.html", options());
  ASSERT_EQ(written.warnings.size(), 1u);
  EXPECT_NE(written.warnings[0].find("stent.vtp"), std::string::npos);
  const json summary = json::parse(block(read_text(folder / "r.html"), "summary"));
  EXPECT_EQ(summary["warnings"], json(written.warnings));
}

TEST_F(Report, DropsStepsEvenlyToStayBelowTheLimitAndSaysSo) {
  write_result(folder.path());
  write_steps(folder.path(), 12);
  write_report(folder.path(), folder / "all.html", options());
  const std::string all = read_text(folder / "all.html");
  EXPECT_EQ(count(all, "id=\"data-step-"), 12u);
  std::size_t steps = 0;
  for (int s = 1; s <= 12; ++s) steps += block(all, "step-" + std::to_string(s)).size();

  Options small = options();
  small.size_limit = 1e-6 * (static_cast<double>(all.size()) - 0.5 * static_cast<double>(steps));
  const Written written = write_report(folder.path(), folder / "r.html", small);
  const std::string html = read_text(folder / "r.html");
  EXPECT_LE(static_cast<double>(html.size()), 1e6 * small.size_limit);
  std::vector<int> shown;
  for (int s = 1; s <= 12; ++s) {
    if (!block(html, "step-" + std::to_string(s)).empty()) shown.push_back(s);
  }
  ASSERT_GE(shown.size(), 2u);
  ASSERT_LT(shown.size(), 12u);
  EXPECT_EQ(shown.back(), 12);
  const double even = 12.0 / static_cast<double>(shown.size());
  for (std::size_t i = 0; i < shown.size(); ++i)
    EXPECT_NEAR(shown[i], even * static_cast<double>(i + 1), 0.5 + 1e-9) << "rounded to a step";
  ASSERT_EQ(written.warnings.size(), 1u);
  const std::string said = std::to_string(shown.size()) + " of 12 saved steps";
  EXPECT_NE(written.warnings[0].find(said), std::string::npos) << written.warnings[0];
}

TEST_F(Report, RefusesALimitThatTheResultItselfExceedsAndLeavesAnOldPage) {
  write_result(folder.path());
  write_text(folder / "r.html", "old");
  Options tiny = options();
  tiny.size_limit = 0.1;
  try {
    write_report(folder.path(), folder / "r.html", tiny);
    FAIL() << "a page of more than 0.1 MB was written";
  } catch (const Error& error) {
    EXPECT_EQ(error.code(), ExitCode::resources);
    EXPECT_NE(std::string(error.what()).find("--size-limit"), std::string::npos);
  }
  EXPECT_EQ(read_text(folder / "r.html"), "old");
}

struct Damage {
  const char* name;
  void (*damage)(const fs::path& folder);
  const char* named;
};

class DamagedResult : public Report, public testing::WithParamInterface<Damage> {};

TEST_P(DamagedResult, IsRefusedInOneLineThatNamesTheFile) {
  write_result(folder.path());
  GetParam().damage(folder.path());
  try {
    write_report(folder.path(), folder / "r.html", options());
    FAIL() << "a report was written";
  } catch (const Error& error) {
    EXPECT_EQ(error.code(), ExitCode::input_file);
    EXPECT_NE(std::string(error.what()).find(GetParam().named), std::string::npos) << error.what();
    EXPECT_EQ(std::string(error.what()).find('\n'), std::string::npos);
  }
  EXPECT_FALSE(fs::exists(folder / "r.html"));
}

INSTANTIATE_TEST_SUITE_P(
    Files, DamagedResult,
    testing::Values(
        Damage{"NoMetrics", [](const fs::path& f) { fs::remove(f / "metrics.json"); },
               "metrics.json"},
        Damage{"BrokenMetrics",
               [](const fs::path& f) { write_text(f / "metrics.json", "{\"a\":"); },
               "metrics.json"},
        Damage{"NoUnit", [](const fs::path& f) { write_text(f / "case.json", "{}"); },
               "/vessel/units"},
        Damage{"NoDisplacement", [](const fs::path& f) { write_mesh(tube(5), f / "stented.vtp"); },
               "Displacement"},
        Damage{"EmptyStepList",
               [](const fs::path& f) { write_text(f / "steps.pvd", "<VTKFile/>"); }, "steps.pvd"},
        Damage{"MissingStep",
               [](const fs::path& f) {
                 write_steps(f, 2);
                 fs::remove(f / "steps/stent_2.vtp");
               },
               "stent_2.vtp"},
        Damage{"NoFolder", [](const fs::path& f) { fs::remove_all(f); }, "is no folder"}),
    [](const auto& damage) { return damage.param.name; });

}  // namespace
}  // namespace vstent::report
