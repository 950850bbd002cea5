// Design files: what is read back is what was written, and mistakes are named.
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "deployment/design_file.hpp"
#include "stents/catalogue.hpp"
#include "stents/fields.hpp"
#include "tests/temporary_folder.hpp"
#include "vessels/error.hpp"

namespace vstent::deployment {
namespace {

using nlohmann::json;
using stents::Provenance;
using stents::Specification;

std::string message(const std::string& text) {
  try {
    parse_design(json::parse(text), "my.json");
  } catch (const Error& error) {
    EXPECT_EQ(error.code(), ExitCode::usage);
    return error.what();
  }
  return "read without complaint";
}

TEST(DesignFile, EveryPresetReadsBackTheSame) {
  for (const Specification& s : stents::catalogue()) {
    const auto written = to_json(s);
    const Specification read = parse_design(json::parse(written.dump()), "my.json");
    EXPECT_EQ(to_json(read).dump(), written.dump());
    EXPECT_EQ(stents::described(read), stents::described(s)) << s.name;
    ASSERT_EQ(read.figures.size(), s.figures.size()) << s.name;
    for (std::size_t i = 0; i < s.figures.size(); ++i) {
      EXPECT_EQ(read.figures[i].name, s.figures[i].name);
      EXPECT_EQ(read.figures[i].value, s.figures[i].value);
      EXPECT_EQ(read.figures[i].provenance, s.figures[i].provenance);
      EXPECT_EQ(read.figures[i].source, s.figures[i].source);
    }
    const auto a = stents::make_design(s)->expanded(s.nominal_diameter);
    const auto b = stents::make_design(read)->expanded(s.nominal_diameter);
    EXPECT_EQ(a.length, b.length) << s.name;
    EXPECT_EQ(a.members.size(), b.members.size()) << s.name;
  }
}

TEST(DesignFile, ChangesAPresetAndSaysSo) {
  const Specification s = parse_design(
      json::parse(R"({"preset": "cp8", "name": "long", "rows": 8, "section": {"width": "0.4mm"}})"),
      "my.json");
  const auto& p = std::get<stents::DiamondParameters>(s.pattern);
  EXPECT_EQ(s.name, "long");
  EXPECT_EQ(p.rows, 8);
  EXPECT_EQ(p.crowns, 8);
  EXPECT_EQ(s.section.thickness, 0.4);
  EXPECT_EQ(s.section.edge_radius, 0.2);
  // eight rows instead of the preset's six: the length is what they come to
  EXPECT_EQ(s.nominal_length, stents::make_design(s)->expanded(12).length);
  for (const stents::Figure& f : s.figures) {
    const bool changed = f.name == "rows" || f.name == "nominal_length" ||
                         (f.name.starts_with("section/") && f.name != "section/round");
    EXPECT_EQ(f.source == "set in my.json", changed) << f.name;
    if (changed) {
      EXPECT_EQ(f.provenance, Provenance::tunable);
    }
  }
}

TEST(DesignFile, ADesignOfOnesOwnNeedsOnlyItsParameters) {
  const Specification s = parse_design(json::parse(R"({
    "family": "rings", "crowns": 6, "rings": 4, "straight_length": "0.8mm", "crown_arc": "0.19mm",
    "connectors": {"phase": "facing", "count": 3, "length": "0.5mm"},
    "section": {"round": false, "width": "0.08mm", "thickness": "0.09mm"},
    "nominal_diameter": "3mm", "crimped_diameter": "0.11cm"})"),
                                       "my.json");
  EXPECT_EQ(s.name, "my.json");
  EXPECT_EQ(s.crimped_diameter, 1.1);
  const auto design = stents::make_design(s);
  EXPECT_EQ(design->cell(), stents::Cell::open);
  EXPECT_EQ(s.nominal_length, design->expanded(3).length);
  EXPECT_TRUE(s.figures.empty());
}

TEST(DesignFile, MistakesAreNamedWithTheirKey) {
  EXPECT_EQ(message(R"({"preset": "cp8", "rowz": 8})"),
            "my.json: /rowz: unknown key; did you mean \"rows\"?");
  EXPECT_EQ(message(R"({"preset": "xience_s", "connectors": {"phase": "in-phase"}})"),
            "my.json: /connectors/phase: must be one of facing, in_phase, offset, far_peak, is "
            "\"in-phase\"");
  EXPECT_EQ(message(R"({"preset": "cp8", "strut_length": 6})"),
            "my.json: /strut_length: must be a length with its unit, such as \"11mm\", is 6");
  EXPECT_EQ(message(R"({"preset": "cp8", "strut_length": "-6mm"})"),
            "my.json: /strut_length: must be positive, is -6mm");
  EXPECT_NE(message(R"({"family": "rings", "crowns": 6})").find("/rings: is missing"),
            std::string::npos);
  EXPECT_NE(message(R"({"preset": "palmaz"})").find("/preset: must be one of xience_s"),
            std::string::npos);
  EXPECT_NE(message(R"({"crowns": 6})").find("/family: is missing"), std::string::npos);
  EXPECT_NE(message(R"({"family": "ring"})").find("must be one of rings, diamonds"),
            std::string::npos);
  EXPECT_NE(message(R"({"family": "rings", "preset": "cp8"})").find("family diamonds"),
            std::string::npos);
  EXPECT_NE(message(R"({"preset": "cp8", "crowns": 40})").find("crimped diameter of at least"),
            std::string::npos);
  EXPECT_NE(message(R"({"preset": "cp8", "section": {"thickness": "0.2mm"}})").find("one width"),
            std::string::npos);
  EXPECT_NE(message(R"({"preset": "maxld", "section": {"edge_radius": "0.2mm"}})").find("at most"),
            std::string::npos);
  EXPECT_NE(message(R"([1])").find("must be an object"), std::string::npos);
}

TEST(DesignFile, IsFoundByNameOrPath) {
  EXPECT_EQ(find_design("cp8").name, "cp8");
  const tests::TemporaryFolder folder;
  tests::write_text(folder / "own.json", R"({"preset": "ir2", "name": "own"})");
  EXPECT_EQ(find_design((folder / "own.json").string()).name, "own");
  try {
    find_design("cp9");
    FAIL();
  } catch (const Error& error) {
    EXPECT_NE(std::string(error.what()).find("did you mean \"cp8\""), std::string::npos);
  }
  EXPECT_THROW(find_design((folder / "absent.json").string()), Error);
  tests::write_text(folder / "twice.json", R"({"preset": "ir2", "rings": 3, "rings": 4})");
  EXPECT_THROW(find_design((folder / "twice.json").string()), Error);
}

}  // namespace
}  // namespace vstent::deployment
