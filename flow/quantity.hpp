// Quantities of blood flow as people write them, with their unit; inside, everything is cgs.
#pragma once

#include <string>
#include <string_view>

namespace vstent::flow {

enum class Dimension { flow, velocity, pressure, resistance, compliance, viscosity, density, time };

inline constexpr double kDynPerCm2PerMmHg = 1333.22387415;

/// "85 mL/s", "93 mmHg", "1200 dyn s/cm5" in cgs (mL/s, cm/s, dyn/cm2, dyn s/cm5, cm5/dyn, P, g/mL,
/// s). \throws Error (usage) naming `key` for no number, no unit, or a unit of something else
double parse_quantity(std::string_view text, Dimension dimension, std::string_view key);

/// cgs per one of `unit`. \throws Error (usage) as parse_quantity
double cgs_per(std::string_view unit, Dimension dimension, std::string_view key);

/// What `unit` measures, flow or velocity. \throws Error (usage) for a unit of anything else
Dimension flow_or_velocity(std::string_view unit, std::string_view key);

/// SimVascular's files hold bare numbers in the unit system of their model.
enum class UnitSystem { cgs, mm_g_s };

/// cgs per one in that system.
double cgs_per(UnitSystem system, Dimension dimension);

}  // namespace vstent::flow
