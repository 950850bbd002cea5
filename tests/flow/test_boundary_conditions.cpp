#include <gtest/gtest.h>

#include <set>

#include "flow/boundary_conditions.hpp"
#include "tests/data.hpp"
#include "tests/temporary_folder.hpp"
#include "vessels/error.hpp"

namespace vstent::flow {
namespace {

using tests::TemporaryFolder;
using tests::write_text;

BoundaryConditions read(const TemporaryFolder& folder, const std::string& json) {
  write_text(folder / "bc.json", json);
  return read_boundary_conditions(folder / "bc.json");
}

std::string refusal(const TemporaryFolder& folder, const std::string& json) {
  try {
    read(folder, json);
  } catch (const Error& error) {
    return error.what();
  }
  return "";
}

std::string faces(const std::string& inlet, const std::string& outlet) {
  return R"({"faces": {"inlet": )" + inlet + R"(, "outlet": )" + outlet + "}}";
}

const std::string kInlet = R"({"inflow": "5 L/min"})";
const std::string kOutlet = R"({"resistance": "1000 dyn s/cm5"})";

TEST(BoundaryConditions, EveryKindIsReadInItsUnits) {
  const TemporaryFolder folder;
  const BoundaryConditions bc = read(folder, R"({
    "viscosity": "4 mPa s", "density": "1060 kg/m3", "description": "rest",
    "faces": {
      "inlet": {"inflow": "85 mL/s", "face_id": 2},
      "a": {"resistance": "1 mmHg s/mL", "distal_pressure": "10 mmHg", "near": [1, 2.5, -3]},
      "b": {"rcr": {"Rp": "90 dyn s/cm5", "C": "0.0008 cm5/dyn", "Rd": "1200 dyn s/cm5"}},
      "c": {"pressure": "80 mmHg"},
      "d": {"coronary": {"Ra": "1e5 dyn s/cm5", "Ca": "1e-7 cm5/dyn", "Ra_micro": "2e5 dyn s/cm5",
                         "Cim": "1e-6 cm5/dyn", "Rv": "1e4 dyn s/cm5", "venous_pressure": "5 mmHg",
                         "intramyocardial_pressure": {"time": [0, 300, 800], "time_units": "ms",
                           "pressure": [5, 100, 5], "pressure_units": "mmHg"}}}}})");
  EXPECT_DOUBLE_EQ(bc.blood.viscosity, 0.04);
  EXPECT_DOUBLE_EQ(bc.blood.density, 1.06);
  EXPECT_DOUBLE_EQ(mean(std::get<Inflow>(bc.find("inlet")->condition).waveform), 85);
  EXPECT_EQ(bc.find("inlet")->face_id, 2);
  const auto a = std::get<Resistance>(bc.find("a")->condition);
  EXPECT_DOUBLE_EQ(a.resistance, kDynPerCm2PerMmHg);
  EXPECT_DOUBLE_EQ(a.distal_pressure, 10 * kDynPerCm2PerMmHg);
  EXPECT_EQ((*bc.find("a")->near_to)[1], 2.5);
  EXPECT_DOUBLE_EQ(steady(bc.find("b")->condition).resistance, 1290);
  EXPECT_DOUBLE_EQ(std::get<Pressure>(bc.find("c")->condition).pressure, 80 * kDynPerCm2PerMmHg);
  const auto d = std::get<Coronary>(bc.find("d")->condition);
  EXPECT_DOUBLE_EQ(steady(d).resistance, 3.1e5);
  EXPECT_DOUBLE_EQ(at(d.intramyocardial_pressure, 0.3), 100 * kDynPerCm2PerMmHg);
  EXPECT_TRUE(bc.notes.empty());
}

TEST(BoundaryConditions, MistakesAreNamedWithTheirKey) {
  const TemporaryFolder folder;
  write_text(folder / "in.flow", "0 5\n1 5\n");
  const auto refused = [&](const std::string& json, const std::string& why) {
    const std::string line = refusal(folder, json);
    EXPECT_NE(line.find(why), std::string::npos) << json << "\n" << line;
    EXPECT_NE(line.find("bc.json: /"), std::string::npos) << line;
    EXPECT_EQ(line.find('\n'), std::string::npos) << line;
  };
  refused(faces(kInlet, R"({"resistence": "1 dyn s/cm5"})"),
          "/faces/outlet/resistence: unknown key; did you mean \"resistance\"?");
  refused(faces(kInlet, "{}"), "/faces/outlet: has no condition");
  refused(faces(kInlet, R"({"resistance": "1 mmHg s/mL", "pressure": "1 mmHg"})"), "has both");
  refused(faces(kInlet, R"({"resistance": "100 mmHg"})"), "is the unit of a pressure");
  refused(faces(kInlet, R"({"resistance": 100})"), "number and its unit");
  refused(faces(kInlet, R"({"resistance": "-1 WU"})"), "must be positive");
  refused(faces(kInlet, R"({"rcr": {"Rp": "1 WU", "Rd": "2 WU"}})"), "/faces/outlet/rcr/C");
  refused(faces(R"({"inflow": "-5 L/min"})", kOutlet), "positive here");
  refused(faces(kOutlet, kOutlet), "no face has an inflow");
  refused(faces(kInlet, kInlet), "no face is an outlet");
  refused(faces(R"({"inflow": {"file": "absent.flow", "units": "mL/s"}})", kOutlet),
          "absent.flow does not exist");
  refused(faces(R"({"inflow": {"file": "in.flow"}})", kOutlet), "/faces/inlet/inflow/units");
  refused(R"({"viscosity": "0.04 Pa s", "faces": {}})", "is the unit right?");
  refused(R"({"density": "1.06 kg/m3", "faces": {}})", "is the unit right?");
  refused(R"({"faces": {}, "outlet": {}})", "/outlet: unknown key");
}

TEST(BoundaryConditions, TheNetFlowTellsAFilesSign) {
  const TemporaryFolder folder;
  write_text(folder / "out.flow", "0 -10\n0.5 -90\n1 -10\n");
  write_text(folder / "in.flow", "0 10\n0.5 90\n1 10\n");
  write_text(folder / "swing.flow", "0 1\n0.25 50\n0.75 -50\n1 1\n");
  const auto inflow = [&](const std::string& file, const std::string& more = "") {
    return faces(R"({"inflow": {"file": ")" + file + R"(", "units": "mL/s")" + more + "}}",
                 kOutlet);
  };
  const BoundaryConditions negative = read(folder, inflow("out.flow"));
  const BoundaryConditions positive = read(folder, inflow("in.flow"));
  EXPECT_DOUBLE_EQ(mean(std::get<Inflow>(negative.find("inlet")->condition).waveform), 50);
  EXPECT_DOUBLE_EQ(mean(std::get<Inflow>(positive.find("inlet")->condition).waveform), 50);
  ASSERT_EQ(negative.notes.size(), 1u);
  EXPECT_NE(negative.notes[0].find("turned to be positive inwards"), std::string::npos);
  ASSERT_EQ(positive.notes.size(), 1u);
  EXPECT_TRUE(read(folder, inflow("in.flow", R"(, "positive": "in")")).notes.empty());

  EXPECT_NE(refusal(folder, inflow("in.flow", R"(, "positive": "out")")).find("contradicts"),
            std::string::npos);
  EXPECT_NE(refusal(folder, inflow("out.flow", R"(, "positive": "in")")).find("contradicts"),
            std::string::npos);
  EXPECT_NE(refusal(folder, inflow("swing.flow")).find("which way is positive"), std::string::npos);
}

TEST(BoundaryConditions, FacesOfModelAndFileMustBeTheSame) {
  const TemporaryFolder folder;
  const BoundaryConditions bc = read(folder, faces(kInlet, kOutlet));
  const std::vector<std::string> same{"outlet", "inlet"}, more{"inlet", "outlet", "left"},
      other{"inlet", "right"};
  EXPECT_NO_THROW(require_faces(bc, same, "m.vtp"));
  const auto line = [&](const std::vector<std::string>& names) -> std::string {
    try {
      require_faces(bc, names, "m.vtp");
    } catch (const Error& error) {
      return error.what();
    }
    return "";
  };
  EXPECT_NE(line(more).find("no condition for left"), std::string::npos);
  EXPECT_NE(line(other).find("no condition for right; conditions for outlet, which m.vtp"),
            std::string::npos);
}

TEST(BoundaryConditions, ReadsSimVascularsOutlets) {
  const TemporaryFolder folder;
  write_text(folder / "rcrt.dat",
             "2\n2\n90\n0.0008\n1200\n0 5\n1 5\n2\n80\n8e-4\n1100\n0 0\n1 0\n");
  write_text(folder / "outlets.dat", "left\nright\n");
  write_text(folder / "named.dat", "2\n2\nleft\n90.0\n0.0008\n1200\n0.0 5.0\n1.0 5.0\n");
  write_text(folder / "resistance.dat", "left 10.0\n");
  write_text(folder / "varying.dat", "2\n2\nleft\n90.0\n0.0008\n1200\n0.0 5.0\n1.0 6.0\n");
  write_text(folder / "cut.dat", "2\n2\nleft\n90.0\n");
  const auto with = [](const std::string& keys) {
    return R"({"faces": {"inlet": {"inflow": "5 L/min"}}, )" + keys + "}";
  };
  const BoundaryConditions both = read(
      folder, with(R"("rcrt": {"file": "rcrt.dat", "outlets": "outlets.dat", "units": "cgs"})"));
  EXPECT_DOUBLE_EQ(std::get<Rcr>(both.find("left")->condition).distal_pressure, 5);
  EXPECT_DOUBLE_EQ(std::get<Rcr>(both.find("right")->condition).distal, 1100);
  const BoundaryConditions named =
      read(folder, with(R"("rcrt": {"file": "named.dat", "units": "mm-g-s"})"));
  EXPECT_DOUBLE_EQ(std::get<Rcr>(named.find("left")->condition).distal, 1.2e7);
  EXPECT_DOUBLE_EQ(std::get<Rcr>(named.find("left")->condition).capacitance, 8e-8);
  const BoundaryConditions resistances =
      read(folder, with(R"("resistances": {"file": "resistance.dat", "units": "cgs"})"));
  EXPECT_DOUBLE_EQ(std::get<Resistance>(resistances.find("left")->condition).resistance, 10);

  const auto refused = [&](const std::string& keys, const std::string& why) {
    EXPECT_NE(refusal(folder, with(keys)).find(why), std::string::npos)
        << refusal(folder, with(keys));
  };
  refused(R"("rcrt": {"file": "rcrt.dat", "units": "cgs"})", "give outlets.dat");
  refused(R"("rcrt": {"file": "rcrt.dat", "outlets": "outlets.dat"})", "/rcrt/units");
  refused(R"("rcrt": {"file": "varying.dat", "units": "cgs"})", "line 8: the distal pressure");
  refused(R"("rcrt": {"file": "cut.dat", "units": "cgs"})", "ends where");
  refused(R"("rcrt": {"file": "named.dat", "units": "cgs"},
             "resistances": {"file": "resistance.dat", "units": "cgs"})",
          "has one already");
}

TEST(BoundaryConditions, ReadsTheRealFiles) {
  const auto lung = tests::shared_data("rpa_su201");
  SKIP_WITHOUT(lung);
  const TemporaryFolder folder;
  const BoundaryConditions bc =
      read(folder, R"({
    "faces": {"inflow": {"inflow": {"file": ")" +
                       (lung / "inflow.flow").string() + R"(", "units": "mL/s"}}},
    "rcrt": {"file": ")" +
                       (lung / "rcrt.dat").string() + R"(", "outlets": ")" +
                       (lung / "outlets.dat").string() + R"(", "units": "cgs"},
    "caps": ")" + (lung / "mesh-surfaces").string() +
                       R"("})");
  EXPECT_EQ(bc.faces.size(), 6u);
  EXPECT_DOUBLE_EQ(std::get<Rcr>(bc.find("cap_RPA1_2")->condition).proximal, 1850.9034683);
  const auto iliac = tests::shared_data("aortoiliac_demo");
  SKIP_WITHOUT(iliac);
  const BoundaryConditions demo = read(folder, R"({"faces": {"inlet": {"inflow": "80 mL/s"}},
    "rcrt": {"file": ")" + (iliac / "rom_rcrt.dat").string() +
                                                   R"(", "units": "cgs"},
    "resistances": {"file": ")" + (iliac / "rom_resistance.dat").string() +
                                                   R"(", "units": "cgs"}})");
  EXPECT_DOUBLE_EQ(std::get<Rcr>(demo.find("cap_right_iliac")->condition).distal, 1200);
  EXPECT_DOUBLE_EQ(std::get<Resistance>(demo.find("cap_aorta_2")->condition).resistance, 10);
}

}  // namespace
}  // namespace vstent::flow
