#include "stents/presets.hpp"

namespace vstent::stents::presets {
namespace {

constexpr const char* kBends =
    "by cell and size within 2.73-41.67 N mm2, measured on eight expanded stents of 6 mm for the "
    "leg, Schmidt 2023, doi:10.1515/bmt-2022-0412";
constexpr const char* kTrials2010 = "Trials 2010;11:1, table 1, doi:10.1186/1745-6215-11-1";
constexpr const char* kFoin2012 =
    "Foin et al., EuroIntervention 2012;8:1315, doi:10.4244/EIJV8I11A200";
constexpr const char* kLargestLumen =
    "Int J Cardiol 2016;221:171, doi:10.1016/j.ijcard.2016.06.097";
constexpr const char* kUnrolled =
    "pyFormex documentation, example \"unroll stent\": cell circumference 9.19 mm of a crimped "
    "micro-CT";
constexpr const char* kBuilder =
    "public parameter sets of stent_geometry_builder (commit 5315b7f), doi:10.1115/1.4066961";
constexpr const char* kComparative2013 =
    "A Comparative Reliability and Performance Study ..., Artif Organs 2013 (measured 3.0 x 18 mm "
    "coronary stents: foreshortening 0.41-2.25 %, recoil 3.50-6.00 %)";
constexpr const char* kEtave2001 = "Etave et al., J Biomech 2001;34:1065";
constexpr const char* kRingPhases = "Open Heart 2017;4:e000537 (phase of neighbouring rings)";

Specification xience_s() {
  RingParameters p{.crowns = 6, .rings = 13, .straight_length = 0.80, .crown_arc = 0.188};
  p.connectors = {.shape = Link::u,
                  .phase = Phase::in_phase,
                  .count = 3,
                  .shift = 1,
                  .alternate = true,
                  .length = 1.52,
                  .span = 1.41};
  Specification s{.name = "xience_s",
                  .description =
                      "open cells, in-phase rings, three links with a U (patterned "
                      "after small Xience)",
                  .pattern = p,
                  .section = strut(0.081, 0.081, 0.015),
                  .nominal_diameter = 3.0,
                  .nominal_length = 18,
                  .crimped_diameter = 0.92,
                  .smallest_use = 2.25,
                  .largest_use = 3.25,
                  .recoil = 0.04,
                  .bending_stiffness = 12};
  return documented(
      s,
      {{tunable(kBends), {"bending_stiffness_N_mm2"}},
       {inferred(kBuilder),
        {"crowns", "rings", "straight_length", "crown_arc", "crimped_diameter", "nominal_length",
         "connectors/count"}},
       {measured(kRingPhases), {"connectors/phase"}},
       {inferred("13 rings on 18 mm"), {"connectors/span"}},
       {inferred(kComparative2013), {"recoil"}},
       {remembered(),
        {"section/width", "section/thickness", "connectors/shape", "connectors/alternate",
         "connectors/shift", "smallest_use", "largest_use", "nominal_diameter"}}},
      {{"foreshortening at 3.0 mm", "0.41-2.25 % (measured coronary stents)", Provenance::measured,
        kComparative2013}});
}

Specification ir2() {
  RingParameters p{.crowns = 6, .rings = 9, .straight_length = 0.90, .crown_arc = 0.189};
  p.connectors = {.phase = Phase::facing, .count = 6, .length = 0.97};
  Specification s{.name = "ir2",
                  .description =
                      "closed cells, mirrored rings joined at every facing crown (a "
                      "public parameter set)",
                  .pattern = p,
                  .section = strut(0.080, 0.080, 0.015),
                  .nominal_diameter = 3.0,
                  .nominal_length = 18,
                  .crimped_diameter = 0.92,
                  .smallest_use = 2.5,
                  .largest_use = 3.5,
                  .recoil = 0.04,
                  .bending_stiffness = 40};
  return documented(s,
                    {{tunable(kBends), {"bending_stiffness_N_mm2"}},
                     {inferred(kBuilder),
                      {"crowns", "rings", "straight_length", "crown_arc", "crimped_diameter",
                       "section/width", "section/thickness", "connectors/length"}},
                     {inferred(std::string("rings offset by half a wave; ") + kBuilder),
                      {"connectors/phase", "connectors/count"}},
                     {inferred(kComparative2013), {"recoil"}}},
                    {});
}

Specification element() {
  RingParameters p{.crowns = 8, .rings = 19, .straight_length = 0.82, .crown_arc = 0.14};
  p.connectors = {.phase = Phase::offset,
                  .count = 2,
                  .shift = 1,
                  .alternate = false,
                  .length = 0.30,
                  .span = 0.04,
                  .absorption = 1};
  Specification s{.name = "element",
                  .description =
                      "open cells, two offset links per gap in a spiral (patterned after "
                      "Promus Element)",
                  .pattern = p,
                  .section = strut(0.080, 0.081, 0.015),
                  .nominal_diameter = 3.0,
                  .nominal_length = 18,
                  .crimped_diameter = 1.0,
                  .smallest_use = 2.25,
                  .largest_use = 3.5,
                  .recoil = 0.04,
                  .bending_stiffness = 8};
  return documented(
      s,
      {{tunable(kBends), {"bending_stiffness_N_mm2"}},
       {measured(kTrials2010), {"section/thickness"}},
       {inferred(std::string("between 0.061 and 0.089 mm, ") + kTrials2010), {"section/width"}},
       {inferred(std::string("crowns and largest lumen of 5.7 mm, ") + kFoin2012),
        {"straight_length", "crown_arc"}},
       {tunable(std::string("metal-to-artery ratio 16.4 % at 3.0 mm, ") + kTrials2010),
        {"connectors/span", "rings"}},
       {tunable("links turn, so that in-phase rings keep their pitch"), {"connectors/absorption"}},
       {inferred(kComparative2013), {"recoil"}},
       {remembered(),
        {"crowns", "connectors/count", "connectors/phase", "connectors/shift",
         "connectors/alternate", "smallest_use", "largest_use"}}},
      {{"metal-to-artery ratio at 3.0 mm", "16.4 %", Provenance::measured, kTrials2010},
       {"foreshortening at 3.0 mm", "0.41-2.25 % (measured coronary stents)", Provenance::measured,
        kComparative2013}});
}

Specification cypher() {
  RingParameters p{.crowns = 6, .rings = 10, .straight_length = 1.03, .crown_arc = 0.21};
  p.connectors = {.shape = Link::n,
                  .phase = Phase::facing,
                  .count = 6,
                  .length = 1.70,
                  .span = 0.64,
                  .absorption = 1};
  Specification s{.name = "cypher",
                  .description =
                      "closed cells, mirrored rings, an N link on every crown (patterned "
                      "after Cypher / BX Velocity)",
                  .pattern = p,
                  .section = strut(0.130, 0.140, 0.025),
                  .nominal_diameter = 3.0,
                  .nominal_length = 18,
                  .crimped_diameter = 1.1,
                  .smallest_use = 2.25,
                  .largest_use = 3.5,
                  .recoil = 0.03,
                  .bending_stiffness = 40};
  return documented(
      s,
      {{tunable(kBends), {"bending_stiffness_N_mm2"}},
       {tunable(kUnrolled), {"straight_length", "crown_arc", "connectors/length"}},
       {tunable("bending links keep the pitch"), {"connectors/absorption"}},
       {remembered(),
        {"crowns", "section/width", "section/thickness", "connectors/shape", "connectors/phase",
         "connectors/count", "smallest_use", "largest_use", "recoil"}}},
      {{"cell circumference", "9.19 mm", Provenance::measured, kUnrolled}});
}

Specification integrity() {
  const HelixParameters p{.strands = 1,
                          .units_per_turn = 7.5,
                          .units = 99,
                          .strut_length = 1.27,
                          .pitch = 1.0658,
                          .join_every = 5};
  Specification s{.name = "integrity",
                  .description =
                      "one sinusoidal wire wound as a helix, facing crowns fused "
                      "(patterned after Integrity)",
                  .pattern = p,
                  .section = wire(0.080),
                  .nominal_diameter = 3.0,
                  .nominal_length = 15.2,
                  .crimped_diameter = 0.994,
                  .smallest_use = 2.25,
                  .largest_use = 3.5,
                  .recoil = 0.04,
                  .bending_stiffness = 15};
  return documented(
      s,
      {{tunable(kBends), {"bending_stiffness_N_mm2"}},
       {inferred(kBuilder),
        {"section/width", "section/thickness", "section/edge_radius", "join_every",
         "crimped_diameter", "nominal_length"}},
       {inferred(std::string("helix angle of 23.5 deg crimped, ") + kBuilder),
        {"pitch", "strut_length", "units"}},
       {inferred(kComparative2013), {"recoil"}},
       {remembered(), {"units_per_turn", "smallest_use", "largest_use"}}},
      {{"foreshortening", "14 %, by the law of facing crowns; no figure of the device was at hand",
        Provenance::inferred, "lengths of the helix's own half waves"}});
}

Specification orsiro() {
  const HelixParameters p{.strands = 2,
                          .units_per_turn = 7,
                          .units = 37,
                          .strut_length = 1.17,
                          .pitch = 3.0,
                          .join_every = 2,
                          .joint = Link::s,
                          .joint_length = 1.2,
                          .end_ring = 0.5};
  Specification s{.name = "orsiro",
                  .description = "a double helix with S links (patterned after Orsiro)",
                  .pattern = p,
                  .section = strut(0.060, 0.060, 0.010),
                  .nominal_diameter = 3.0,
                  .nominal_length = 18,
                  .crimped_diameter = 0.98,
                  .smallest_use = 2.25,
                  .largest_use = 3.0,
                  .recoil = 0.04,
                  .bending_stiffness = 10};
  return documented(
      s,
      {{tunable(kBends), {"bending_stiffness_N_mm2"}},
       {inferred(kBuilder),
        {"strands", "section/width", "section/thickness", "nominal_length", "crimped_diameter",
         "joint"}},
       {inferred(std::string("units per turn and largest lumen of 5.2 mm, ") + kLargestLumen),
        {"strut_length"}},
       {inferred(kComparative2013), {"recoil"}},
       {remembered(), {"smallest_use", "largest_use"}}},
      {});
}

Specification coil() {
  const CoilParameters p{.turns = 15, .pitch = 1.2};
  Specification s{.name = "coil",
                  .description = "a wire wound as a helix; it lengthens as it opens",
                  .pattern = p,
                  .section = wire(0.15),
                  .nominal_diameter = 3.0,
                  .nominal_length = 18,
                  .crimped_diameter = 1.2,
                  .smallest_use = 2.5,
                  .largest_use = 4,
                  .recoil = 0.026,
                  .bending_stiffness = 3};
  return documented(
      s,
      {{tunable(kBends), {"bending_stiffness_N_mm2"}},
       {measured(std::string("intrinsic recoil 2.6 %, finite elements, ") + kEtave2001),
        {"recoil"}},
       {remembered(), {"section/width", "section/thickness"}}},
      {{"length", "grows on expansion", Provenance::measured, kEtave2001}});
}

}  // namespace

std::vector<Specification> coronary() {
  return {xience_s(), ir2(), element(), cypher(), integrity(), orsiro(), coil()};
}

}  // namespace vstent::stents::presets
