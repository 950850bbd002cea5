#include <gtest/gtest.h>

#include <cmath>
#include <complex>
#include <nlohmann/json.hpp>
#include <numbers>
#include <regex>
#include <sstream>

#include "meshing/condition_faces.hpp"
#include "meshing/solver_xml.hpp"
#include "tests/meshing/blocks.hpp"
#include "vessels/error.hpp"

namespace vstent::meshing {
namespace {

using flow::BoundaryConditions;
using flow::Condition;

/// One element and what is in it.
struct Element {
  std::string tag, name, type, text;
  std::vector<Element> children;

  std::vector<Element> all(const std::string& wanted) const {
    std::vector<Element> found;
    for (const Element& child : children)
      if (child.tag == wanted) found.push_back(child);
    return found;
  }
  /// The only child of that tag, or an empty element.
  Element one(const std::string& wanted) const {
    const std::vector<Element> found = all(wanted);
    EXPECT_EQ(found.size(), 1u) << wanted << " in " << tag << " " << name;
    return found.empty() ? Element{} : found.front();
  }
  double number(const std::string& wanted) const {
    const std::string found = one(wanted).text;
    return found.empty() ? std::nan("") : std::stod(found);
  }
};

/// Well-formed XML of elements with attributes and either text or elements.
Element parse(const std::string& xml) {
  static const std::regex token(
      R"re(<!--[^>]*-->|<\?[^>]*\?>|<(/?)(\w+)((?:\s+\w+="[^"]*")*)\s*>|[^<]+)re");
  static const std::regex attribute(R"re((\w+)="([^"]*)")re");
  std::vector<Element> open(1);
  std::size_t read = 0;
  for (std::sregex_iterator m(xml.begin(), xml.end(), token), end; m != end; ++m) {
    read += m->str().size();
    if ((*m)[2].matched && (*m)[1].length() == 0) {
      Element element;
      element.tag = (*m)[2];
      const std::string attributes = (*m)[3];
      for (std::sregex_iterator a(attributes.begin(), attributes.end(), attribute); a != end; ++a)
        ((*a)[1] == "name" ? element.name : element.type) = (*a)[2];
      open.push_back(element);
    } else if ((*m)[2].matched) {
      EXPECT_EQ(open.back().tag, (*m)[2].str());
      const Element done = open.back();
      open.pop_back();
      open.back().children.push_back(done);
    } else if (m->str()[0] != '<') {
      const std::string text = std::regex_replace(m->str(), std::regex(R"(^\s+|\s+$)"), "");
      if (!text.empty()) open.back().text += text;
    }
  }
  EXPECT_EQ(read, xml.size()) << "something is no XML";
  EXPECT_EQ(open.size(), 1u);
  return open.front().one("svMultiPhysicsFile");
}

flow::Waveform beat() { return {{0, 0.2, 0.5, 1.2}, {10, 40, 4, 10}}; }

BoundaryConditions conditions(Condition outlet) {
  BoundaryConditions bc;
  bc.source = "bc.json";
  bc.faces = {{"inlet", flow::Inflow{beat(), false}, {}, {}},
              {"outlet", std::move(outlet), {}, {}}};
  return bc;
}

const Model& model() {
  static const Model result = tests::block(1, 10).model;  // caps of 1 cm2
  return result;
}

TEST(SolverXml, ListsEveryFaceOnceAndGivesItACondition) {
  const SolverCase solver = solver_case(model(), conditions(flow::Rcr{90, 1e-3, 1200, 500}), {});
  const Element root = parse(solver.xml);
  const Element mesh = root.one("Add_mesh");
  EXPECT_EQ(mesh.one("Mesh_file_path").text, "mesh-complete/mesh-complete.mesh.vtu");
  std::vector<std::string> faces, conditioned;
  for (const Element& face : mesh.all("Add_face")) {
    faces.push_back(face.name);
    EXPECT_EQ(face.one("Face_file_path").text, "mesh-complete/mesh-surfaces/" + face.name + ".vtp");
  }
  const Element equation = root.one("Add_equation");
  EXPECT_EQ(equation.type, "fluid");
  for (const Element& bc : equation.all("Add_BC")) conditioned.push_back(bc.name);
  EXPECT_EQ(faces, (std::vector<std::string>{"wall", "inlet", "outlet"}));
  EXPECT_EQ(conditioned, faces);

  const Element wall = equation.all("Add_BC")[0], inlet = equation.all("Add_BC")[1],
                outlet = equation.all("Add_BC")[2];
  EXPECT_EQ(wall.one("Type").text, "Dir");
  EXPECT_EQ(wall.number("Value"), 0);
  EXPECT_EQ(inlet.one("Type").text, "Dir");
  EXPECT_EQ(inlet.one("Time_dependence").text, "Unsteady");
  EXPECT_EQ(inlet.one("Temporal_values_file_path").text, "inlet.flow");
  EXPECT_EQ(inlet.one("Impose_flux").text, "true");
  ASSERT_TRUE(solver.files.contains("inlet.flow"));
  EXPECT_EQ(outlet.one("Type").text, "Neu");
  EXPECT_EQ(outlet.one("Time_dependence").text, "RCR");
  const Element rcr = outlet.one("RCR_values");
  EXPECT_EQ(rcr.number("Proximal_resistance"), 90);
  EXPECT_EQ(rcr.number("Capacitance"), 1e-3);
  EXPECT_EQ(rcr.number("Distal_resistance"), 1200);
  EXPECT_EQ(rcr.number("Distal_pressure"), 500);
  // The whole mean inflow, trapezium by trapezium, through the distal resistance.
  const double mean = (0.2 * 25 + 0.3 * 22 + 0.7 * 7) / 1.2;
  EXPECT_NEAR(rcr.number("Initial_pressure"), 500 + 1200 * mean, 1e-8);

  EXPECT_EQ(equation.number("Density"), 1.06);
  EXPECT_EQ(equation.one("Viscosity").number("Value"), 0.04);
  EXPECT_EQ(equation.one("LS").type, "NS");
  const Element general = root.one("GeneralSimulationParameters");
  EXPECT_DOUBLE_EQ(general.number("Time_step_size"), 0.0012);  // a thousandth of the beat
  EXPECT_EQ(general.number("Number_of_time_steps"), 3000);
  EXPECT_EQ(general.number("Start_saving_after_time_step"), 2000);
}

TEST(SolverXml, InflowsAreNegativeAndReadableBySvMultiPhysics) {
  const WaveformText file = svmultiphysics_flow(beat());
  std::istringstream text(file.text);
  int samples = 0, modes = 0;
  text >> samples >> modes;
  EXPECT_EQ(samples, 4);
  EXPECT_EQ(modes, file.modes);
  for (std::size_t i = 0; i < 4; ++i) {
    double time = 0, value = 0;
    text >> time >> value;
    EXPECT_EQ(time, beat().time[i]);
    EXPECT_EQ(value, -beat().value[i]);
  }
  EXPECT_EQ(file.text.find('\t'), std::string::npos);
}

TEST(SolverXml, ModesFollowTheSamples) {
  // A finely sampled cosine needs the mean and one harmonic.
  flow::Waveform cosine;
  for (int i = 0; i <= 200; ++i) {
    cosine.time.push_back(0.8 * i / 200);
    cosine.value.push_back(3 + std::cos(2 * std::numbers::pi * i / 200));
  }
  cosine.value.back() = cosine.value.front();
  const WaveformText one = svmultiphysics_flow(cosine);
  EXPECT_EQ(one.modes, 2);
  EXPECT_LT(one.deviation, 1e-3);  // of chords: (pi / 200)^2 / 2 = 1.2e-4 of the amplitude

  // Slow twin: the coefficients summed over many midpoints.
  flow::Waveform spike;
  for (int i = 0; i <= 40; ++i) {
    spike.time.push_back(0.02 * i);
    spike.value.push_back(i >= 4 && i <= 8 ? 5.0 * (i - 3) : 5.0);
  }
  const WaveformText file = svmultiphysics_flow(spike);
  EXPECT_GT(file.modes, 5);
  EXPECT_LE(file.modes, 40);
  constexpr int kPoints = 20000;
  const double period = spike.period();
  std::vector<std::complex<double>> c(static_cast<std::size_t>(file.modes));
  for (int k = 0; k < kPoints; ++k) {
    const double t = period * (k + 0.5) / kPoints;
    for (std::size_t n = 0; n < c.size(); ++n)
      c[n] += flow::at(spike, t) / kPoints *
              std::polar(1.0, -2 * std::numbers::pi * static_cast<double>(n) * t / period);
  }
  double deviation = 0;
  for (int k = 0; k < 8 * 41; ++k) {
    const double t = period * k / (8 * 41);
    double value = c[0].real();
    for (std::size_t n = 1; n < c.size(); ++n)
      value +=
          2 * (c[n] * std::polar(1.0, 2 * std::numbers::pi * static_cast<double>(n) * t / period))
                  .real();
    deviation = std::max(deviation, std::abs(value - flow::at(spike, t)) / 20);
  }
  EXPECT_NEAR(file.deviation, deviation, 1e-4);  // of the sums' steps, (1 / 20000 of the period)^1
}

TEST(SolverXml, ConstantInflowsVelocitiesAndPlainOutlets) {
  BoundaryConditions bc = conditions(flow::Resistance{1000, 0});
  bc.faces[0].condition = flow::Inflow{flow::constant(20), true};  // cm/s over 1 cm2
  const SolverCase solver = solver_case(model(), bc, {500, 2, "lib.so"});
  const Element equation = parse(solver.xml).one("Add_equation");
  const Element inlet = equation.all("Add_BC")[1], outlet = equation.all("Add_BC")[2];
  EXPECT_EQ(inlet.one("Time_dependence").text, "Steady");
  EXPECT_NEAR(inlet.number("Value"), -20, 1e-12);
  EXPECT_EQ(outlet.one("Time_dependence").text, "Resistance");
  EXPECT_EQ(outlet.number("Value"), 1000);
  EXPECT_TRUE(solver.files.empty());
  EXPECT_EQ(solver.time_steps, 1000);
  EXPECT_DOUBLE_EQ(solver.time_step, 0.002);
  bc.faces[1].condition = flow::Pressure{12000};
  const SolverCase fixed = solver_case(model(), bc, {});
  const Element pressure = parse(fixed.xml).one("Add_equation").all("Add_BC")[2];
  EXPECT_EQ(pressure.one("Time_dependence").text, "Steady");
  EXPECT_EQ(pressure.number("Value"), 12000);
}

TEST(SolverXml, CoronaryOutletsAreCoupledAndTakeWindkesselsWithThem) {
  Model forked = model();
  forked.faces.push_back({4, "side", true});
  forked.face_of_triangle[static_cast<std::size_t>(
      std::find(forked.face_of_triangle.begin(), forked.face_of_triangle.end(), 1) -
      forked.face_of_triangle.begin())] = 4;
  flow::Coronary bed{1e4, 2e4, 5e3, 1e-6, 2e-6, {}, 700};
  bed.intramyocardial_pressure = {{0, 0.4, 1.2}, {0, 9e4, 0}};
  BoundaryConditions bc = conditions(bed);
  bc.faces.push_back({"side", flow::Rcr{90, 1e-3, 1200, 0}, {}, {}});
  const SolverCase solver = solver_case(forked, bc, {});
  const Element equation = parse(solver.xml).one("Add_equation");
  const Element interface = equation.one("svZeroDSolver_interface");
  EXPECT_EQ(interface.one("Configuration_file").text, "svzerod_3Dcoupling.json");
  EXPECT_EQ(interface.one("Coupling_type").text, "semi-implicit");
  EXPECT_EQ(interface.one("Shared_library").text, "libsvzero_interface.so");
  std::vector<std::string> blocks;
  for (const Element& face : equation.all("Add_BC")) {
    if (face.name == "wall" || face.name == "inlet") continue;
    EXPECT_EQ(face.one("Time_dependence").text, "Coupled") << face.name;
    blocks.push_back(face.one("svZeroDSolver_block").text);
  }
  EXPECT_EQ(blocks, (std::vector<std::string>{"outlet_coupling", "side_coupling"}));

  const auto json = nlohmann::json::parse(solver.files.at("svzerod_3Dcoupling.json"));
  EXPECT_TRUE(json["simulation_parameters"]["coupled_simulation"].get<bool>());
  ASSERT_EQ(json["external_solver_coupling_blocks"].size(), 2u);
  for (std::size_t i = 0; i < 2; ++i) {
    const auto& block = json["external_solver_coupling_blocks"][i];
    EXPECT_EQ(block["name"], blocks[i]);
    EXPECT_EQ(block["connected_block"], json["boundary_conditions"][i]["bc_name"]);
    EXPECT_EQ(block["values"]["t"][1], 1.2);
  }
  const auto& values = json["boundary_conditions"][0]["bc_values"];
  EXPECT_EQ(json["boundary_conditions"][0]["bc_type"], "CORONARY");
  EXPECT_EQ(values["Ra1"], 1e4);
  EXPECT_EQ(values["Ra2"], 2e4);
  EXPECT_EQ(values["Rv1"], 5e3);
  EXPECT_EQ(values["Ca"], 1e-6);
  EXPECT_EQ(values["Cc"], 2e-6);
  EXPECT_EQ(values["P_v"], 700);
  EXPECT_EQ(values["Pim"], (std::vector<double>{0, 9e4, 0}));
  EXPECT_EQ(json["boundary_conditions"][1]["bc_type"], "RCR");
  EXPECT_EQ(json["boundary_conditions"][1]["bc_values"]["Rd"], 1200);
}

TEST(SolverXml, ConditionsNameCapsByPlace) {
  Model named = model();
  BoundaryConditions bc = conditions(flow::Resistance{1000, 0});
  bc.faces[0].name = "aorta";
  bc.faces[0].near_to = {{0.4, 0.6, 0.1}};  // cm: the cap at z = 0 has its centre at 0.5, 0.5
  bc.faces[1].name = "left";
  bc.faces[1].near_to = {{0.5, 0.5, 0.6}};
  name_by_place(named, bc, vessels::LengthUnit::cm);
  EXPECT_EQ(face(named, 2).name, "aorta");
  EXPECT_EQ(face(named, 3).name, "left");
  EXPECT_EQ(face(named, 1).name, "wall");
  bc.faces[1].near_to = {{0.5, 0.5, 0.4}};
  EXPECT_THROW(name_by_place(named, bc, vessels::LengthUnit::cm), Error);
}

TEST(SolverXml, FacesWithoutConditionsAreRefused) {
  BoundaryConditions bc = conditions(flow::Resistance{1000, 0});
  bc.faces.pop_back();
  EXPECT_THROW(solver_case(model(), bc, {}), Error);
  bc.faces.push_back({"outlet", flow::Pressure{0}, {}, {}});
  bc.faces[0].condition = flow::Pressure{100};
  try {
    solver_case(model(), bc, {});
    FAIL() << "nothing flows in";
  } catch (const Error& error) {
    EXPECT_STREQ(error.what(), "bc.json: no face has an inflow");
  }
}

}  // namespace
}  // namespace vstent::meshing
