#include <gtest/gtest.h>

#include <cmath>

#include "flow/waveform.hpp"
#include "tests/data.hpp"
#include "tests/temporary_folder.hpp"
#include "vessels/error.hpp"

namespace vstent::flow {
namespace {

using tests::TemporaryFolder;
using tests::write_text;

std::string message(const std::filesystem::path& file, const std::string& units) {
  try {
    read_waveform(file, units, "bc.json: /faces/inlet/inflow/units");
  } catch (const Error& error) {
    return error.what();
  }
  return "";
}

TEST(Quantity, UnitsOfTheSameQuantityAgree) {
  EXPECT_DOUBLE_EQ(parse_quantity("5 L/min", Dimension::flow, ""), 5000.0 / 60);
  EXPECT_DOUBLE_EQ(parse_quantity("0.004 Pa s", Dimension::viscosity, ""), 0.04);
  EXPECT_DOUBLE_EQ(parse_quantity("1060kg/m^3", Dimension::density, ""), 1.06);
  // 1 mmHg is 133.322 Pa, and 1 Pa is 10 dyn/cm2.
  EXPECT_NEAR(parse_quantity("1 mmHg", Dimension::pressure, ""),
              parse_quantity("133.322387415 Pa", Dimension::pressure, ""), 1e-9);
  // R = p / Q and C = V / p, in each system of units.
  EXPECT_NEAR(parse_quantity("1 mmHg*s/mL", Dimension::resistance, ""),
              parse_quantity("133.322387415e6 Pa s/m3", Dimension::resistance, ""), 1e-9);
  EXPECT_NEAR(parse_quantity("1 mL/mmHg", Dimension::compliance, ""),
              parse_quantity("7.500615758456563e-9 m3/Pa", Dimension::compliance, ""), 1e-15);
  EXPECT_DOUBLE_EQ(cgs_per(UnitSystem::mm_g_s, Dimension::pressure),
                   cgs_per(UnitSystem::mm_g_s, Dimension::resistance) *
                       cgs_per(UnitSystem::mm_g_s, Dimension::flow));
  EXPECT_DOUBLE_EQ(cgs_per(UnitSystem::mm_g_s, Dimension::flow),
                   cgs_per(UnitSystem::mm_g_s, Dimension::compliance) *
                       cgs_per(UnitSystem::mm_g_s, Dimension::pressure));
}

TEST(Quantity, AnotherQuantitysUnitIsNamed) {
  const auto what = [](const std::string& text, Dimension dimension) -> std::string {
    try {
      parse_quantity(text, dimension, "bc.json: /x");
    } catch (const Error& error) {
      return error.what();
    }
    return "";
  };
  EXPECT_EQ(what("80 mmHg", Dimension::flow),
            "bc.json: /x: \"mmHg\" is the unit of a pressure; needed is a flow, in mL/s, L/min, "
            "mm3/s or m3/s");
  EXPECT_NE(what("80", Dimension::pressure).find("needs a unit"), std::string::npos);
  EXPECT_NE(what("80 psi", Dimension::pressure).find("not a unit known"), std::string::npos);
  EXPECT_NE(what("high", Dimension::pressure).find("number"), std::string::npos);
}

TEST(Waveform, MeanAndValuesAreThoseOfStraightLines) {
  const Waveform triangle{{0, 0.25, 1}, {0, 4, 0}};
  EXPECT_DOUBLE_EQ(mean(triangle), 2.0);
  EXPECT_DOUBLE_EQ(at(triangle, 0.125), 2.0);
  EXPECT_DOUBLE_EQ(at(triangle, 0.625), 2.0);
  EXPECT_NEAR(at(triangle, 7.125), 2.0, 1e-12);
  EXPECT_NEAR(at(triangle, -0.375), 2.0, 1e-12);
  EXPECT_DOUBLE_EQ(at(triangle, 1), 0.0);
  EXPECT_DOUBLE_EQ(at(constant(3), 0.7), 3.0);
  EXPECT_DOUBLE_EQ(mean(times(triangle, -3)), -6.0);
}

TEST(Waveform, FilesInAnyUnitGiveTheSameFlow) {
  const TemporaryFolder folder;
  write_text(folder / "a.flow", "0 60\n# peak\n0.5 120\n1 60\n");
  write_text(folder / "b.csv", "time (ms), flow (L/min)\r\n0,3.6\r\n500,7.2\r\n1000,3.6\r\n");
  const WaveformFile a = read_waveform(folder / "a.flow", "mL/s", "k");
  const WaveformFile b = read_waveform(folder / "b.csv", "", "k");
  ASSERT_EQ(a.waveform.value.size(), 3u);
  for (std::size_t i = 0; i < 3; ++i) {
    EXPECT_DOUBLE_EQ(a.waveform.time[i], b.waveform.time[i]);
    EXPECT_NEAR(a.waveform.value[i], b.waveform.value[i], 1e-12);
  }
  EXPECT_TRUE(a.notes.empty() && b.notes.empty());
}

TEST(Waveform, WhatContradictsIsRefusedInOneLine) {
  const TemporaryFolder folder;
  write_text(folder / "v.csv", "time,velocity\n0,1\n1,1\n");
  write_text(folder / "u.csv", "time,velocity (cm/s)\n0,1\n1,1\n");
  write_text(folder / "x.csv", "seconds,velocity\n0,1\n1,1\n");
  write_text(folder / "back.flow", "0 1\n0.5 2\n0.5 3\n1 1\n");
  write_text(folder / "word.flow", "0 1\n0.5 fast\n");
  write_text(folder / "three.flow", "0 1 2\n");
  write_text(folder / "short.flow", "0 1\n");
  const auto refused = [&](const char* file, const char* units, const char* why) {
    const std::string line = message(folder / file, units);
    EXPECT_NE(line.find(why), std::string::npos) << file << ": " << line;
    EXPECT_EQ(line.find('\n'), std::string::npos);
  };
  refused("v.csv", "mL/s", "contradicts");
  refused("u.csv", "m/s", "contradicts");
  refused("v.csv", "", "is missing");
  refused("v.csv", "mmHg", "no flow and no velocity");
  refused("x.csv", "m/s", "line 1");
  refused("back.flow", "mL/s", "line 3: time does not rise");
  refused("word.flow", "mL/s", "line 2: \"fast\" is no number");
  refused("three.flow", "mL/s", "line 1: has 3 columns");
  refused("short.flow", "mL/s", "fewer than two");
  refused("short.flow", "m/s", "holds flows");
  refused("absent.flow", "mL/s", "absent.flow");
}

TEST(Waveform, SolversReadInflowAsNegative) {
  EXPECT_EQ(simvascular_flow({{0, 0.5, 1}, {1.5, 0, 1.5}}), "0 -1.5\n0.5 0\n1 -1.5\n");
  EXPECT_EQ(simvascular_flow(constant(5)), "0 -5\n1 -5\n");
}

TEST(Waveform, ReadsTheMeasuredInflows) {
  const auto coarctation = tests::shared_data("coa_patient1/BPM75.csv");
  SKIP_WITHOUT(coarctation);
  const WaveformFile file = read_waveform(coarctation, "m/s", "k");
  EXPECT_EQ(file.dimension, Dimension::velocity);
  EXPECT_DOUBLE_EQ(file.waveform.period(), 0.8);  // 75 beats a minute
  ASSERT_EQ(file.notes.size(), 1u);               // its ends do not meet
  EXPECT_DOUBLE_EQ(file.waveform.value.front(), 0.5 * (15.9660 + 3.86));
  const WaveformFile lung = read_waveform(tests::shared_data("rpa_su201/inflow.flow"), "mL/s", "k");
  EXPECT_DOUBLE_EQ(lung.waveform.period(), 0.588);
  EXPECT_EQ(lung.waveform.value.size(), 20u);
}

}  // namespace
}  // namespace vstent::flow
