#include "stents/presets.hpp"

namespace vstent::stents::presets {
namespace {

constexpr const char* kBends =
    "by cell and size within what was measured expanded: 2.73-41.67 N mm2 on eight of 6 mm for the "
    "leg, Schmidt 2023, doi:10.1515/bmt-2022-0412; carotid ones 31.6-39.4, with closed cells 291, "
    "\"Experimental investigation of modern and established carotid stents\"";
constexpr const char* kIntraStent =
    "Open-cell design stents in congenital heart disease: IntraStent vs Palmaz, PMID 12112897";
constexpr const char* kBreakingTheLimit =
    "Breaking the limit, Congenit Heart Dis, doi:10.1111/chd.12175";
constexpr const char* kNumed = "NuMED, instructions for use of the Covered Mounted CP Stent";
constexpr const char* kEndoBeams =
    "EndoBeams.jl, presets of stent/utils_stent.jl (commits c829b29, 6d4b68c)";
constexpr const char* kFreeCell = "free cell 1.08 mm2, PMID 22078854";
constexpr const char* kBabiker =
    "Babiker et al.: pore density 12.5-20 per mm2, porosity 65-70 % of the Pipeline device";
constexpr const char* kFourVenous = "arXiv:2102.10219 (least foreshortening of four)";

Specification cp(int crowns, double nominal_diameter, double largest_use, double crimped_diameter) {
  const DiamondParameters p{.crowns = crowns, .rows = 6, .strut_length = 6.0};
  Specification s{.name = "cp" + std::to_string(crowns),
                  .description = "welded wire zig-zags, closed cells, " + std::to_string(crowns) +
                                 " zigs (patterned after the CP stent)",
                  .pattern = p,
                  .section = wire(0.33),
                  .nominal_diameter = nominal_diameter,
                  .nominal_length = 34,
                  .crimped_diameter = crimped_diameter,
                  .smallest_use = 12,
                  .largest_use = largest_use,
                  .recoil = 0.03,
                  .bending_stiffness = 290};
  std::vector<Figure> behaviour;
  if (crowns == 8) {
    behaviour.push_back({"foreshortening from 12 mm to 14, 16, 18, 20, 22, 24 mm",
                         "3.3, 7.4, 12.1, 17.8, 24.5, 32.7 %", Provenance::remembered,
                         "computed from the remembered strut length; no table of the maker was "
                         "at hand"});
  }
  return documented(s,
                    {{tunable(kBends), {"bending_stiffness_N_mm2"}},
                     {measured(kNumed), {"section/round"}},
                     {remembered(),
                      {"crowns", "rows", "strut_length", "section/width", "section/thickness",
                       "section/edge_radius", "smallest_use", "largest_use", "nominal_length",
                       "crimped_diameter", "recoil"}}},
                    behaviour);
}

Specification palmaz_l() {
  const DiamondParameters p{.crowns = 10, .rows = 8, .strut_length = 3.905};
  Specification s{.name = "palmaz_l",
                  .description = "slotted tube, closed diamonds (patterned after large Palmaz)",
                  .pattern = p,
                  .section = strut(0.14, 0.14, 0.02),
                  .nominal_diameter = 10,
                  .nominal_length = 30,
                  .crimped_diameter = 3.4,
                  .smallest_use = 8,
                  .largest_use = 18,
                  .recoil = 0.07,
                  .bending_stiffness = 290};
  return documented(
      s,
      {{tunable(kBends), {"bending_stiffness_N_mm2"}},
       {tunable(std::string("largest diameter 25 mm, so that it loses about 18 % of its length, ") +
                kIntraStent),
        {"strut_length"}},
       {measured("Ono et al., Cardiol Young: recoil 7 +/- 4 % in great vessels"), {"recoil"}},
       {remembered(),
        {"crowns", "section/width", "section/thickness", "smallest_use", "largest_use",
         "nominal_length"}}},
      {{"foreshortening in congenital heart disease", "18 % (mean of 34)", Provenance::measured,
        kIntraStent}});
}

Specification genesis_xd() {
  RingParameters p{.crowns = 10, .rings = 8, .straight_length = 4.20, .crown_arc = 0.09};
  p.connectors = {
      .shape = Link::s, .phase = Phase::facing, .count = 10, .length = 1.15, .span = 0.85};
  Specification s{.name = "genesis_xd",
                  .description =
                      "closed cells, mirrored rings with S links on every crown "
                      "(patterned after Palmaz Genesis XD)",
                  .pattern = p,
                  .section = strut(0.20, 0.20, 0.03),
                  .nominal_diameter = 10,
                  .nominal_length = 39,
                  .crimped_diameter = 4.6,
                  .smallest_use = 10,
                  .largest_use = 18,
                  .recoil = 0.036,
                  .bending_stiffness = 150};
  return documented(
      s,
      {{tunable(kBends), {"bending_stiffness_N_mm2"}},
       {tunable("largest diameter of about 28 mm"), {"straight_length", "crown_arc"}},
       {inferred(std::string("below 3.6 % at maximal expansion, ") + kBreakingTheLimit),
        {"recoil"}},
       {remembered(), {"section/thickness", "connectors/shape", "smallest_use", "largest_use"}}},
      {});
}

Specification maxld() {
  RingParameters p{.crowns = 14, .rings = 11, .straight_length = 2.65, .crown_arc = 0.19};
  p.connectors = {.phase = Phase::in_phase, .count = 7, .shift = 1, .length = 3.3};
  Specification s{.name = "maxld",
                  .description =
                      "open cells, in-phase rings of a large stent (patterned after "
                      "IntraStent Max LD)",
                  .pattern = p,
                  .section = strut(0.20, 0.24, 0.03),
                  .nominal_diameter = 12,
                  .nominal_length = 36,
                  .crimped_diameter = 4.0,
                  .smallest_use = 12,
                  .largest_use = 26,
                  .recoil = 0.05,
                  .bending_stiffness = 40};
  return documented(
      s,
      {{tunable(kBends), {"bending_stiffness_N_mm2"}},
       {tunable("largest diameter of 26-28 mm"), {"crowns", "straight_length", "crown_arc"}},
       {tunable(std::string("no foreshortening, ") + kIntraStent), {"connectors/phase"}},
       {remembered(), {"section/thickness", "smallest_use", "largest_use", "nominal_length"}}},
      {{"foreshortening in congenital heart disease", "0 % (mean)", Provenance::measured,
        kIntraStent}});
}

Specification zstent() {
  const ZParameters p{.crowns = 8,
                      .bodies = 2,
                      .straight_length = 21.0,
                      .crown_arc = 1.1,
                      .pitch = 25.0,
                      .bars = 4};
  Specification s{.name = "zstent",
                  .description = "single-row zig-zag bodies on bars (patterned after Gianturco Z)",
                  .pattern = p,
                  .section = wire(0.40),
                  .nominal_diameter = 20,
                  .nominal_length = 48,
                  .crimped_diameter = 4.6,
                  .smallest_use = 15,
                  .largest_use = 40,
                  .bending_stiffness = 30};
  return documented(
      s,
      {{tunable(kBends), {"bending_stiffness_N_mm2"}},
       {remembered(),
        {"crowns", "straight_length", "section/width", "section/thickness", "section/edge_radius",
         "smallest_use", "largest_use"}},
       {tunable(kFourVenous), {"pitch", "bars"}}},
      {{"foreshortening", "least of four venous designs", Provenance::measured, kFourVenous}});
}

Specification wallstent8() {
  const BraidParameters p{.wires_per_direction = 12, .over = 1, .angle = 59};
  Specification s{.name = "wallstent8",
                  .description = "braid of 24 wires (patterned after the 8 mm carotid Wallstent)",
                  .pattern = p,
                  .section = wire(0.13),
                  .nominal_diameter = 8.26,
                  .nominal_length = 30,
                  .crimped_diameter = 2.0,
                  .smallest_use = 5,
                  .largest_use = 8,
                  .bending_stiffness = 30};
  return documented(
      s,
      {{tunable(kBends), {"bending_stiffness_N_mm2"}},
       {inferred(kEndoBeams),
        {"wires_per_direction", "section/width", "section/thickness", "section/edge_radius",
         "nominal_diameter"}},
       {inferred(std::string("59-64 deg in the presets of ") + kEndoBeams), {"angle"}},
       {remembered(), {"over", "smallest_use", "largest_use"}}},
      {{"free cell area at 8 mm", "1.08 mm2", Provenance::measured, kFreeCell}});
}

Specification ped() {
  const BraidParameters p{.wires_per_direction = 24, .over = 2, .angle = 69.5};
  Specification s{.name = "ped",
                  .description = "flow diverter of 48 wires (patterned after Pipeline)",
                  .pattern = p,
                  .section = wire(0.030),
                  .nominal_diameter = 4.06,
                  .nominal_length = 16,
                  .crimped_diameter = 0.9,
                  .smallest_use = 3,
                  .largest_use = 4,
                  .bending_stiffness = 3};
  return documented(
      s,
      {{tunable(kBends), {"bending_stiffness_N_mm2"}},
       {inferred("30 % cover at 4 mm, between the wires' two layers"),
        {"angle", "nominal_diameter"}},
       {remembered(),
        {"wires_per_direction", "over", "section/width", "section/thickness", "section/edge_radius",
         "smallest_use", "largest_use"}}},
      {{"pore density at 30-35 % cover", "12.5-20 per mm2", Provenance::measured, kBabiker}});
}

Specification surpass() {
  const BraidParameters p{.wires_per_direction = 24, .over = 2, .angle = 70.4};
  Specification s{.name = "surpass",
                  .description = "flow diverter of 48 wires (patterned after Surpass)",
                  .pattern = p,
                  .section = wire(0.028),
                  .nominal_diameter = 4.656,
                  .nominal_length = 7.5,
                  .crimped_diameter = 0.9,
                  .smallest_use = 3.5,
                  .largest_use = 4.6,
                  .bending_stiffness = 3};
  return documented(s,
                    {{tunable(kBends), {"bending_stiffness_N_mm2"}},
                     {inferred(kEndoBeams),
                      {"wires_per_direction", "section/width", "section/thickness",
                       "section/edge_radius", "nominal_diameter", "nominal_length"}},
                     {inferred(std::string("35 cells on 7.5 mm, ") + kEndoBeams), {"angle"}},
                     {remembered(), {"smallest_use", "largest_use", "over"}}},
                    {});
}

}  // namespace

std::vector<Specification> peripheral() {
  return {cp(8, 12, 24, 3.4), cp(10, 14, 30, 4.0), palmaz_l(), genesis_xd(), maxld(),
          zstent(),           wallstent8(),        ped(),      surpass()};
}

}  // namespace vstent::stents::presets
