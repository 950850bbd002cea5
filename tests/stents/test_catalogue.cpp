// What the presets claim of the devices they are patterned after.
#include <gtest/gtest.h>

#include <cmath>
#include <map>
#include <set>

#include "stents/catalogue.hpp"
#include "stents/expansion.hpp"
#include "stents/fields.hpp"
#include "stents/pattern_metrics.hpp"
#include "stents/ring_design.hpp"

namespace vstent::stents {
namespace {

const Specification& preset(const std::string& name) {
  const Specification* found = find_preset(name);
  if (!found) throw std::logic_error(name);
  return *found;
}

double shortening(const std::string& name, double diameter) {
  const auto design = make_design(preset(name));
  return foreshortening(*design, design->limits().crimped_diameter, diameter);
}

TEST(Catalogue, EveryPresetIsBuildableAtItsLabelledSize) {
  for (const Specification& s : catalogue()) {
    const auto design = make_design(s);
    const Limits limits = design->limits();
    EXPECT_LT(limits.crimped_diameter, limits.nominal_diameter) << s.name;
    EXPECT_LT(limits.nominal_diameter, limits.largest_diameter) << s.name;
    EXPECT_LE(s.largest_use, limits.largest_diameter) << s.name;
    const Pattern pattern = design->expanded(limits.nominal_diameter);
    // labels name a length between crimped and nominal, give or take one repeat of the pattern
    const double crimped = design->expanded(limits.crimped_diameter).length;
    EXPECT_GE(std::max(pattern.length, crimped), 0.94 * s.nominal_length) << s.name;
    EXPECT_LE(std::min(pattern.length, crimped), 1.06 * s.nominal_length) << s.name;
  }
}

TEST(Catalogue, EveryParameterSaysWhereItIsFrom) {
  for (const Specification& s : catalogue()) {
    std::map<std::string, std::string> figures;
    for (const Figure& f : s.figures) {
      EXPECT_TRUE(figures.emplace(f.name, f.value).second) << s.name << ": twice " << f.name;
      EXPECT_GT(f.source.size(), 10u) << s.name << ": " << f.name;
    }
    for (const auto& [name, value] : described(s)) EXPECT_EQ(figures[name], value) << s.name;
    EXPECT_NE(s.description.find("patterned after") != std::string::npos,
              s.name == "ir2" || s.name == "coil")
        << s.name;
  }
}

TEST(Catalogue, NamesAreFoundAndUnique) {
  std::set<std::string> names;
  for (const Specification& s : catalogue()) {
    EXPECT_TRUE(names.insert(s.name).second);
    EXPECT_EQ(find_preset(s.name), &s);
  }
  EXPECT_EQ(find_preset("xience"), nullptr);
}

TEST(Catalogue, InPhaseCoronaryPresetsForeshortenAsMeasuredStentsDo) {
  // four commercial 3.0 x 18 mm coronary stents: 2.25, 0.67, 0.46, 0.41 % (Artif Organs 2013)
  for (const std::string name : {"xience_s", "element"}) {
    EXPECT_GT(shortening(name, 3.0), 0.0041) << name;
    EXPECT_LT(shortening(name, 3.0), 0.0225) << name;
  }
}

TEST(Catalogue, TheSameRingsFacingWouldForeshortenByAboutSixteenPercent) {
  // joined by links between facing crowns, at the same crimped pitch, all 13 rings shorten instead
  // of the two outer halves: 13 (h(crimped) - h(3.0)) / L
  Specification facing = preset("xience_s");
  auto& rings = std::get<RingParameters>(facing.pattern);
  const RingDesign in_phase(rings, facing);
  const double crimped = in_phase.ring_length(0.92), nominal = in_phase.ring_length(3.0);
  rings.connectors = {.phase = Phase::facing, .count = 3, .length = in_phase.pitch(0.92) - crimped};
  const RingDesign design(rings, facing);
  const double shortened = foreshortening(design, 0.92, 3.0);
  EXPECT_NEAR(shortened, 13 * (crimped - nominal) / design.expanded(0.92).length, 1e-12);
  EXPECT_NEAR(shortened, 0.16, 0.015);
  EXPECT_NEAR(foreshortening(in_phase, 0.92, 3.0), shortened / 13, 1e-3);
}

TEST(Catalogue, FacingPresetShortensByItsRings) {
  const RingDesign design(std::get<RingParameters>(preset("ir2").pattern), preset("ir2"));
  EXPECT_NEAR(design.expanded(0.92).length - design.expanded(3.0).length,
              9 * (design.ring_length(0.92) - design.ring_length(3.0)), 1e-12);
  EXPECT_GT(foreshortening(design, 0.92, 3.0), 0.05);
}

TEST(Catalogue, ElementCoversAsMuchArteryAsMeasured) {
  // 16.4 % at 3.0 mm, and 17.6 and 15.2 % at 2.5 and 4.0 mm (Trials 2010;11:1, table 1), where the
  // device of 4.0 mm has more crowns and the small one is the same
  const auto design = make_design(preset("element"));
  EXPECT_NEAR(measure(design->expanded(3.0)).metal_to_artery, 0.164, 0.005);
}

TEST(Catalogue, CpForeshorteningIsWhatItsRememberedLengthGives) {
  // "remembered" in the catalogue: a consistency of the preset, no check against a device
  const auto design = make_design(preset("cp8"));
  const std::map<double, double> expected = {{14, 0.033}, {16, 0.074}, {18, 0.121},
                                             {20, 0.178}, {22, 0.245}, {24, 0.327}};
  for (const auto& [diameter, share] : expected) {
    // the table counts diameters of the wire's centre line, and rounds to 0.1 %
    EXPECT_NEAR(1 - (design->expanded(diameter + 0.33).length - 0.33) /
                        (design->expanded(12.33).length - 0.33),
                share, 0.0006)
        << diameter;
  }
  for (const Figure& f : preset("cp8").figures) {
    if (f.name.starts_with("foreshortening")) {
      EXPECT_EQ(f.provenance, Provenance::remembered);
    }
  }
}

TEST(Catalogue, LargeStentsShortenAsPublished) {
  // mean foreshortening in congenital heart disease: Palmaz 18 %, IntraStent 0 % (PMID 12112897);
  // the former at the 14-16 mm that its preset is tuned for, 16.4 and 22 % by the law
  EXPECT_NEAR(shortening("palmaz_l", 14.5), 0.18, 0.02);
  EXPECT_LT(shortening("maxld", 16), 0.02);
}

TEST(Catalogue, WallstentCellsAreAsLargeAsMeasured) {
  // carotid Wallstent of 8 mm: free cell 1.08 mm2 (PMID 22078854)
  const PatternMetrics metrics = measure(make_design(preset("wallstent8"))->expanded(8.26));
  EXPECT_GT(metrics.median_cell, 1.0);
  EXPECT_LT(metrics.median_cell, 1.1);
}

TEST(Catalogue, FlowDiverterHasThePoresOfItsCover) {
  // 12.5-20 pores per mm2 at a porosity of 65-70 % (Babiker et al.)
  const PatternMetrics metrics = measure(make_design(preset("ped"), 8)->expanded(4.06));
  EXPECT_GT(metrics.metal_to_artery, 0.295);
  EXPECT_LT(metrics.metal_to_artery, 0.35);
  EXPECT_GT(metrics.pores_per_mm2, 12.5);
  EXPECT_LT(metrics.pores_per_mm2, 20);
}

}  // namespace
}  // namespace vstent::stents
