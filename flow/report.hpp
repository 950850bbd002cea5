// A study as files and text: flow.json, a table, a centerline with pressures, an svZeroDSolver
// case.
#pragma once

#include <nlohmann/json_fwd.hpp>

#include "flow/study.hpp"

namespace vstent::flow {

/// What is known of how far such models are from three-dimensional ones.
inline constexpr const char* kUncertainty =
    "against 3-D simulations with rigid walls, reduced models like this one were 1 to 10 % off in "
    "pressures and flows at outlets (72 vessels; Pfaller 2022, doi 10.1002/cnm.3639). Drops over a "
    "stenosis are less certain: algebraic formulas differ widely (PMC6379830); the range is that "
    "of K_t 1 to 1.52 and of an entrance loss of none to 1.64 throat diameters. Turbulence, "
    "eccentric jets and struts are not modelled.";

nlohmann::ordered_json to_json(const Study& study, const BoundaryConditions& conditions);

/// For the terminal: what a person asks first.
std::string text_table(const Study& study);

/// The tree's axis as .vtp in `unit`; per point Pressure (mmHg), Flow (mL/s), Diameter (mm) and,
/// where there is a before, the same with Before behind; per line Branch. \throws Error (output)
void write_lines(const Study& study, vessels::LengthUnit unit, const std::filesystem::path& path);

/// The network as svZeroDSolver reads it: one BloodVessel to a branch, cgs. Its elements know no
/// change of dynamic pressure along a vessel or at a junction.
nlohmann::ordered_json zero_d_case(const Answer& answer, const Study& study,
                                   const BoundaryConditions& conditions);

}  // namespace vstent::flow
