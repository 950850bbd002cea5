// From surfaces to pressures.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <numbers>

#include "flow/report.hpp"
#include "tests/data.hpp"
#include "tests/temporary_folder.hpp"
#include "vessels/error.hpp"
#include "vessels/idealised.hpp"

namespace vstent::flow {
namespace {

constexpr double kPi = std::numbers::pi;

struct Tube {
  vessels::IdealisedVessel shape;
  vessels::Surface surface;
  vessels::Centerline centerline;

  explicit Tube(const vessels::IdealisedVessel& vessel) : shape(vessel) {
    surface = vessels::make_surface(vessels::idealised_vessel(vessel), "tube");
    vessels::CenterlineBranch branch;
    branch.points = vessels::idealised_axis(vessel, 0.5);
    for (std::size_t i = 0; i < branch.points.size(); ++i) {
      const double s =
          vessel.length * static_cast<double>(i) / static_cast<double>(branch.points.size() - 1);
      branch.radii.push_back(vessels::idealised_radius(vessel, s));
    }
    centerline.branches = {branch};
  }
  Question question() const { return {surface, surface, centerline}; }
};

vessels::IdealisedVessel vessel(double stenosis, double edge) {
  vessels::IdealisedVessel v;
  v.stenosis = stenosis;
  v.edge_length = edge;
  return v;
}

BoundaryConditions conditions(double flow) {
  BoundaryConditions bc;
  bc.source = "bc.json";
  bc.faces = {{"inlet", Inflow{constant(flow), false}, {}, {}},
              {"outlet", Resistance{1000, 0}, {}, {}}};
  return bc;
}

TEST(Study, AStraightTubeLosesWhatPoiseuilleSays) {
  const Tube tube(vessel(0, 0.7));
  const double flow = 20;
  const Study result = study(tube.question(), conditions(flow));
  EXPECT_FALSE(result.before);
  EXPECT_EQ(result.stretch_is, "the widest way, as none narrows");
  const double length = (result.distal.along - result.proximal.along) / 10;
  const double exact = 128 * 0.04 * length * flow / (kPi * std::pow(1.0, 4));
  // A polygon of edges 0.7 mm in a circle of radius 5 mm has the area of that circle but for
  // (2 pi / n)^2 / 6 = 0.33 %, n = 45; the loss goes with its inverse square.
  EXPECT_GE(result.after.drop, exact);
  EXPECT_NEAR(result.after.drop, exact, 0.01 * exact);
  EXPECT_NEAR(result.after.mean_flow[0], flow, 1e-9);
  EXPECT_NEAR(result.after.mean_pressure[0].back(), 1000 * flow, 1e-6 * 1000 * flow);
}

TEST(Study, AStenosisLosesWhatItsProfileSays) {
  const Tube tube(vessel(0.5, 0.5));
  const double flow = 30;
  const Study result = study(tube.question(), conditions(flow));
  // The same of the exact radii, at many more places.
  Lumen lumen;
  for (int i = 0; i <= 6000; ++i) {
    const double s = tube.shape.length * i / 6000;
    const double radius = vessels::idealised_radius(tube.shape, s) / 10;
    lumen.arc.push_back(s / 10);
    lumen.area.push_back(kPi * radius * radius);
  }
  Network exact;
  exact.branches = {{-1, lumen, losses_along(lumen, exact.blood)}};
  exact.outlets = {{0, Resistance{1000, 0}}};
  const auto pressure = pressures(exact, solve_steady(exact, flow))[0];
  const auto at = [&](double along) {
    return pressure[static_cast<std::size_t>(std::lround(along / tube.shape.length * 6000))];
  };
  const double drop = at(result.distal.along) - at(result.proximal.along);
  // Sections of polygons of n = 2 pi 2.5 / 0.5 = 31 corners lack 0.7 % of area in the throat, and
  // the throat lies up to half a spacing (0.7 mm) beside a section, where the cosine is 0.6 % wider
  // in area: losses, of at most the inverse square of the area, change by less than 3 %.
  EXPECT_NEAR(-drop, result.after.drop, 0.03 * result.after.drop);
  ASSERT_EQ(result.after.network.branches[0].losses.stenoses.size(), 1u);
  EXPECT_NEAR(result.after.network.branches[0].losses.stenoses[0].percent, 50, 1);
  EXPECT_LE(result.after.lowest_drop, result.after.drop);
  EXPECT_GE(result.after.highest_drop, result.after.drop);
}

TEST(Study, ABeatsMeanIsAboveThatOfTheMeanFlow) {
  // What grows with the square of the flow has a larger mean than the square of the mean.
  const Tube tube(vessel(0.5, 1));
  BoundaryConditions pulsatile = conditions(0);
  pulsatile.faces[0].condition = Inflow{{{0, 0.3, 0.8}, {0, 75, 0}}, false};
  const Study beat = study(tube.question(), pulsatile);
  const Study steady_flow = study(tube.question(), conditions(37.5));
  ASSERT_TRUE(beat.after.beat);
  EXPECT_GT(beat.after.drop, 1.1 * steady_flow.after.drop);
  EXPECT_GT(*beat.after.peak_drop, beat.after.drop);
  EXPECT_NEAR(beat.after.mean_flow[0], 37.5, 0.01);
}

TEST(Study, AVelocityIsMultipliedByTheFacesArea) {
  const Tube tube(vessel(0.3, 1));
  BoundaryConditions bc = conditions(0);
  bc.faces[0].condition = Inflow{constant(25), true};
  const Study result = study(tube.question(), bc);
  EXPECT_NEAR(result.after.mean_inflow, 25 * kPi * 0.25, 0.02 * 25 * kPi * 0.25);
}

TEST(Study, TheTreeBeginsWhereBloodEnters) {
  const Tube tube(vessel(0.3, 1));
  BoundaryConditions bc = conditions(20);
  const Polyline& axis = tube.centerline.branches[0].points;
  bc.faces[0].near_to = {axis.back().x(), axis.back().y(), axis.back().z()};
  bc.faces[1].near_to = {axis.front().x(), axis.front().y(), axis.front().z()};
  const Study result = study(tube.question(), bc);
  EXPECT_NEAR((result.ends.front().point - axis.back()).norm(), 0, 1e-9);
  EXPECT_NEAR(result.tree.branches[0].arc.back(), 60, 0.1);
  EXPECT_NEAR(result.after.drop, study(tube.question(), conditions(20)).after.drop,
              0.02 * result.after.drop);  // the vessel is symmetrical, its mesh is not
}

TEST(Study, WhatDoesNotFitIsRefusedInOneLine) {
  const Tube tube(vessel(0.3, 1.5));
  const auto refusal = [&](const BoundaryConditions& bc) -> std::string {
    try {
      study(tube.question(), bc);
    } catch (const Error& error) {
      EXPECT_EQ(std::string(error.what()).find('\n'), std::string::npos);
      return error.what();
    }
    return "";
  };
  BoundaryConditions bc = conditions(20);
  bc.faces[1].name = "left";
  EXPECT_NE(refusal(bc).find("no condition for outlet; conditions for left"), std::string::npos);
  bc = conditions(20);
  bc.faces[1].near_to = {500, 0, 0};
  EXPECT_NE(refusal(bc).find("has no end"), std::string::npos);
  bc.faces[1].near_to = {0, 0, 60};
  bc.faces[0].near_to = {0, 0, 59};
  EXPECT_NE(refusal(bc).find("the same end"), std::string::npos);
  bc = conditions(20);
  bc.faces[1].face_id = 7;
  EXPECT_NE(refusal(bc).find("ModelFaceID 7"), std::string::npos);
  bc = conditions(5000);  // mL/s: 5 L/s
  EXPECT_NE(refusal(bc).find("contradict each other"), std::string::npos);
}

TEST(Study, ZeroDSolversCaseHoldsTheNetwork) {
  const Tube tube(vessel(0.5, 1));
  const BoundaryConditions bc = conditions(20);
  const Study result = study(tube.question(), bc);
  const nlohmann::ordered_json json = zero_d_case(result.after, result, bc);
  ASSERT_EQ(json["vessels"].size(), 1u);
  const auto& vessel = json["vessels"][0];
  EXPECT_EQ(vessel["zero_d_element_type"], "BloodVessel");
  const Losses& losses = result.after.network.branches[0].losses;
  EXPECT_EQ(vessel["zero_d_element_values"]["R_poiseuille"], losses.viscous.back());
  EXPECT_EQ(vessel["zero_d_element_values"]["stenosis_coefficient"], losses.separation.back());
  EXPECT_EQ(vessel["boundary_conditions"]["inlet"], "inlet");
  EXPECT_EQ(vessel["boundary_conditions"]["outlet"], "outlet");
  ASSERT_EQ(json["boundary_conditions"].size(), 2u);
  EXPECT_EQ(json["boundary_conditions"][0]["bc_type"], "FLOW");
  EXPECT_EQ(json["boundary_conditions"][1]["bc_type"], "RESISTANCE");
  // Its two elements, with the head that its BloodVessel leaves out, are this model's drop.
  const auto& p = result.after.mean_pressure[0];
  const auto& area = result.after.network.branches[0].lumen.area;
  const double q = 20, element = losses.viscous.back() * q + losses.separation.back() * q * q;
  const double head = 0.53 * q * q * (1 / area.back() / area.back() - 1 / area[0] / area[0]);
  EXPECT_NEAR(p.front() - p.back(), element + head, 1e-6 * element);
}

TEST(Study, ALungArteryWithItsOwnConditions) {
  const auto lung = tests::shared_data("rpa_su201");
  SKIP_WITHOUT(lung);
  const tests::TemporaryFolder folder;
  tests::write_text(folder / "bc.json", R"({
    "faces": {"inflow": {"inflow": {"file": ")" +
                                            (lung / "inflow.flow").string() +
                                            R"(", "units": "mL/s"}}},
    "rcrt": {"file": ")" + (lung / "rcrt.dat").string() +
                                            R"(", "outlets": ")" + (lung / "outlets.dat").string() +
                                            R"(", "units": "cgs"},
    "caps": ")" + (lung / "mesh-surfaces").string() +
                                            R"("})");
  const vessels::Surface surface =
      vessels::read_surface(lung / "SU201_2005_RPA1_exterior.vtp", vessels::LengthUnit::mm);
  const vessels::Centerline centerline =
      vessels::read_centerline(lung / "SU201_2005_RPA1_cl.vtp", surface.unit);
  const BoundaryConditions bc = read_boundary_conditions(folder / "bc.json");
  const Study result = study({surface, surface, centerline}, bc);
  ASSERT_EQ(result.ends.size(), 6u);
  EXPECT_EQ(result.ends.front().name, "inflow");
  double out = 0;
  for (const TreeEnd& end : result.ends)
    if (!end.root) out += result.after.mean_flow[static_cast<std::size_t>(end.branch)];
  EXPECT_NEAR(out, result.after.mean_flow[0], 1e-6 * out);
  // svZeroDSolver's case: every branch but the root comes out of one junction, every face once.
  const nlohmann::ordered_json json = zero_d_case(result.after, result, bc);
  std::vector<int> joined;
  for (const auto& junction : json["junctions"])
    for (const auto& vessel : junction["outlet_vessels"]) joined.push_back(vessel.get<int>());
  std::sort(joined.begin(), joined.end());
  ASSERT_EQ(joined.size() + 1, json["vessels"].size());
  for (std::size_t i = 0; i < joined.size(); ++i) EXPECT_EQ(joined[i], static_cast<int>(i) + 1);
  EXPECT_EQ(json["boundary_conditions"].size(), 6u);
  // 200 steps against the file's 19 straight pieces: corners between samples cost less than 1 %.
  EXPECT_NEAR(out, mean(result.inflow_volume), 0.01 * out);
}

}  // namespace
}  // namespace vstent::flow
