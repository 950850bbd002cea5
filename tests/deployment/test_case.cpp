#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "deployment/case.hpp"
#include "tests/temporary_folder.hpp"
#include "vessels/error.hpp"

namespace vstent::deployment {
namespace {

using nlohmann::json;
using tests::TemporaryFolder;

json minimal() {
  return {{"vessel", {{"surface", "wall.stl"}, {"units", "mm"}}},
          {"stent", {{"at", {0.36, 0.16, -3.78}}, {"length", "30mm"}, {"diameter", "11mm"}}}};
}

std::string refusal(const json& specification) {
  try {
    parse_case(specification, "case.json", "/data");
  } catch (const Error& error) {
    EXPECT_EQ(error.code(), ExitCode::usage);
    return error.what();
  }
  return "accepted";
}

TEST(CaseFile, ReadsWhatItSays) {
  json specification = minimal();
  specification["stent"]["length"] = "3cm";
  const Case c = parse_case(specification, "case.json", "/data");
  EXPECT_EQ(c.surface, "/data/wall.stl");
  EXPECT_DOUBLE_EQ(c.length, 30);
  EXPECT_DOUBLE_EQ(*c.diameter, 11);
  EXPECT_EQ(std::get<AtPoint>(c.at).point, Vec3(0.36, 0.16, -3.78));
  EXPECT_EQ(c.cell, stents::Cell::open);
  EXPECT_FALSE(c.contact_stiffness.has_value());
}

TEST(CaseFile, AStentMayGiveWay) {
  json specification = minimal();
  EXPECT_FALSE(parse_case(specification, "case.json", "/data").gives_way);
  specification["stent"]["gives_way"] = true;
  specification["stent"]["bending_stiffness_N_mm2"] = 20;
  specification["stent"]["radial_stiffness_N_per_mm2"] = 0.3;
  const Case c = parse_case(specification, "case.json", "/data");
  EXPECT_TRUE(c.gives_way);
  EXPECT_EQ(c.bending_stiffness, 20);
  EXPECT_EQ(c.radial_stiffness, 0.3);
  const auto once = to_json(c);
  EXPECT_EQ(to_json(parse_case(json::parse(once.dump()), "case.json", "/")).dump(), once.dump());
}

TEST(CaseFile, WritingAndReadingAgainIsTheSame) {
  json specification = minimal();
  specification["stent"]["diameter"] = "10.1234567890123mm";
  specification["stent"]["at"] = {{"branch", 2}, {"arc_length", "12.7mm"}};
  specification["stent"]["cell"] = "closed";
  specification["stent"]["straightening"] = 0.3;
  specification["stent"]["flare"] = {{"diameter", "12mm"}, {"length", "2mm"}};
  specification["wall"] = {
      {"youngs_modulus_MPa", 0.7}, {"thickness", "1.1mm"}, {"poisson_ratio", 0.4}};
  specification["contact"] = {{"distance", "0.2mm"}, {"stiffness_N_per_mm", 3.5}};
  specification["solver"] = {{"growth_per_step", "0.05mm"},
                             {"iterations", 3},
                             {"tolerance", 0.01},
                             {"max_settling_steps", 7}};
  specification["save_steps"] = 4;
  const auto once = to_json(parse_case(specification, "case.json", "/data"));
  const auto twice = to_json(parse_case(json::parse(once.dump()), "case.json", "/elsewhere"));
  EXPECT_EQ(once.dump(), twice.dump());
  EXPECT_EQ(once["stent"]["diameter"], "10.1234567890123mm");
}

TEST(CaseFile, FrictionIsForRigidTubesThatFollowTheVessel) {
  json specification = minimal();
  specification["contact"] = {{"friction", 0.3}};
  const Case c = parse_case(specification, "case.json", "/data");
  EXPECT_EQ(c.friction, 0.3);
  EXPECT_EQ(to_json(c)["contact"]["friction"], 0.3);
  specification["contact"] = {{"friction", 0.3}, {"stiffness_N_per_mm", 1.0}};
  EXPECT_NE(refusal(specification).find("/contact/friction: is for rigid"), std::string::npos);
  specification["contact"] = {{"friction", -1.0}};
  EXPECT_NE(refusal(specification).find("/contact/friction"), std::string::npos);
  specification["contact"] = {{"friction", 0.3}};
  specification["stent"]["cell"] = "closed";
  EXPECT_NE(refusal(specification).find("straightens"), std::string::npos);
}

TEST(CaseFile, WallsByVesselAndByVertexSurviveWriting) {
  json specification = minimal();
  specification["wall"] = {
      {"preset", "coronary"},           {"membrane", "springs"},
      {"thickness_array", "Thickness"}, {"modulus_array", "Elasticity_modulus"},
      {"modulus_unit", "dyn/cm2"},      {"tissue_support_MPa_per_mm", 0.02}};
  const Case c = parse_case(specification, "case.json", "/data");
  EXPECT_EQ(c.wall_preset, "coronary");
  EXPECT_EQ(json::parse(to_json(c)["wall"].dump()), specification["wall"]);

  specification["wall"].erase("modulus_unit");
  EXPECT_NE(refusal(specification).find("/wall/modulus_unit: is missing"), std::string::npos);
  specification["wall"] = {{"thickness", "1mm"}, {"thickness_array", "Thickness"}};
  EXPECT_NE(refusal(specification).find("/wall/thickness_array: is given as well as thickness"),
            std::string::npos);
  specification["wall"] = {{"preset", "paper"}, {"membrane", "neo_hookean"}};
  EXPECT_NE(refusal(specification).find("/wall/preset"), std::string::npos);
  specification["wall"] = {{"preset", "paper"}, {"thickness_array", "Thickness"}};
  EXPECT_NE(refusal(specification).find("/wall/preset"), std::string::npos);
  specification["wall"] = {{"preset", "cerebral"}};
  EXPECT_NE(refusal(specification).find("iliofemoral"), std::string::npos);
}

TEST(CaseFile, NamesFileAndKeyOfWhatIsWrong) {
  json c = minimal();
  c["stent"]["diametre"] = "11mm";
  EXPECT_EQ(refusal(c), "case.json: /stent/diametre: unknown key; did you mean \"diameter\"?");
  c = minimal();
  c["stent"]["diameter"] = 11;
  EXPECT_NE(refusal(c).find("case.json: /stent/diameter: must be a length with its unit"),
            std::string::npos);
  c = minimal();
  c["stent"]["diameter"] = "11";
  EXPECT_NE(refusal(c).find("/stent/diameter: needs a unit"), std::string::npos);
  c = minimal();
  c["stent"]["length"] = "-3mm";
  EXPECT_NE(refusal(c).find("/stent/length: must be positive"), std::string::npos);
  c = minimal();
  c["stent"].erase("length");
  EXPECT_NE(refusal(c).find("/stent/length: is missing"), std::string::npos);
  c = minimal();
  c["vessel"]["units"] = "inch";
  EXPECT_NE(refusal(c).find("/vessel/units: must be mm, cm or m"), std::string::npos);
  c = minimal();
  c["stent"]["at"] = {1, 2};
  EXPECT_NE(refusal(c).find("/stent/at: must be a point"), std::string::npos);
  c = minimal();
  c["stent"]["straightening"] = 0.5;
  EXPECT_NE(refusal(c).find("/stent/straightening: an open-cell stent follows the vessel"),
            std::string::npos);
  c = minimal();
  c["stent"]["bending_stiffness_N_mm2"] = 20;
  EXPECT_NE(refusal(c).find("/stent/bending_stiffness_N_mm2: is for a stent that gives way"),
            std::string::npos);
  c["stent"]["gives_way"] = true;
  c["contact"]["stiffness_N_per_mm"] = 0.1;
  EXPECT_NE(refusal(c).find("/contact/stiffness_N_per_mm: is a soft contact"), std::string::npos);
  c = minimal();
  c["stent"]["gives_way"] = true;
  c["stent"]["radial_stiffness_N_per_mm2"] = -1;
  EXPECT_NE(refusal(c).find("/stent/radial_stiffness_N_per_mm2: must be a positive stiffness"),
            std::string::npos);
  c = minimal();
  c["stent"]["cell"] = "half-open";
  EXPECT_NE(refusal(c).find("/stent/cell: must be one of open, closed"), std::string::npos);
  c = minimal();
  c["solver"]["iterations"] = 0;
  EXPECT_NE(refusal(c).find("/solver/iterations: must be a whole number from 1"),
            std::string::npos);
  c = minimal();
  c["solver"]["tolerance"] = "small";
  EXPECT_NE(refusal(c).find("/solver/tolerance: must be a number"), std::string::npos);
  c = minimal();
  c["stent"]["flare"] = {{"diameter", "12mm"}};
  EXPECT_NE(refusal(c).find("/stent/flare: needs both"), std::string::npos);
  c = minimal();
  c["wall"] = {{"preset", "paper"}, {"thickness", "1mm"}};
  EXPECT_NE(refusal(c).find("/wall/preset: \"paper\" has its own constants"), std::string::npos);
  c = minimal();
  c["stent"] = 5;
  EXPECT_NE(refusal(c).find("/stent: must be an object"), std::string::npos);
}

TEST(CaseFile, RefusesWhatIsNoJson) {
  const TemporaryFolder folder;
  const auto refusal_of = [&](const std::string& text) -> std::string {
    tests::write_text(folder / "c.json", text);
    try {
      read_case(folder / "c.json");
    } catch (const Error& error) {
      return error.what();
    }
    return "accepted";
  };
  EXPECT_NE(refusal_of("{\n  \"vessel\": }").find("not JSON, at line 2"), std::string::npos);
  EXPECT_NE(refusal_of("").find("not JSON"), std::string::npos);
  EXPECT_NE(refusal_of(R"({"stent": {"length": "1mm", "length": "2mm"}})")
                .find("length: the key appears twice"),
            std::string::npos);
  EXPECT_THROW(read_case(folder / "absent.json"), Error);
  EXPECT_THROW(read_case(folder.path()), Error);
}

}  // namespace
}  // namespace vstent::deployment
