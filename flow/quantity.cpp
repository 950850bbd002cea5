#include "flow/quantity.hpp"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <vector>

#include "vessels/error.hpp"

namespace vstent::flow {
namespace {

struct Unit {
  std::string_view name;  ///< without blanks, ^ and *
  Dimension dimension;
  double cgs;
};

constexpr double kMmHg = kDynPerCm2PerMmHg;
constexpr Unit kUnits[] = {
    {"mL/s", Dimension::flow, 1},
    {"ml/s", Dimension::flow, 1},
    {"cm3/s", Dimension::flow, 1},
    {"mL/min", Dimension::flow, 1.0 / 60},
    {"ml/min", Dimension::flow, 1.0 / 60},
    {"L/min", Dimension::flow, 1000.0 / 60},
    {"l/min", Dimension::flow, 1000.0 / 60},
    {"mm3/s", Dimension::flow, 1e-3},
    {"m3/s", Dimension::flow, 1e6},
    {"m/s", Dimension::velocity, 100},
    {"cm/s", Dimension::velocity, 1},
    {"mm/s", Dimension::velocity, 0.1},
    {"mmHg", Dimension::pressure, kMmHg},
    {"dyn/cm2", Dimension::pressure, 1},
    {"dyne/cm2", Dimension::pressure, 1},
    {"Pa", Dimension::pressure, 10},
    {"kPa", Dimension::pressure, 1e4},
    {"dyns/cm5", Dimension::resistance, 1},
    {"dynes/cm5", Dimension::resistance, 1},
    {"mmHgs/mL", Dimension::resistance, kMmHg},
    {"mmHgs/ml", Dimension::resistance, kMmHg},
    {"mmHgmin/L", Dimension::resistance, kMmHg * 60 / 1000},
    {"WU", Dimension::resistance, kMmHg * 60 / 1000},
    {"Pas/m3", Dimension::resistance, 1e-5},
    {"Pas/mm3", Dimension::resistance, 1e4},
    {"Pas/mL", Dimension::resistance, 10},
    {"cm5/dyn", Dimension::compliance, 1},
    {"cm5/dyne", Dimension::compliance, 1},
    {"mL/mmHg", Dimension::compliance, 1 / kMmHg},
    {"ml/mmHg", Dimension::compliance, 1 / kMmHg},
    {"cm3/mmHg", Dimension::compliance, 1 / kMmHg},
    {"m3/Pa", Dimension::compliance, 1e5},
    {"mm3/Pa", Dimension::compliance, 1e-4},
    {"mL/Pa", Dimension::compliance, 0.1},
    {"P", Dimension::viscosity, 1},
    {"cP", Dimension::viscosity, 0.01},
    {"Pas", Dimension::viscosity, 10},
    {"mPas", Dimension::viscosity, 0.01},
    {"g/cm/s", Dimension::viscosity, 1},
    {"g/mL", Dimension::density, 1},
    {"g/ml", Dimension::density, 1},
    {"g/cm3", Dimension::density, 1},
    {"kg/m3", Dimension::density, 1e-3},
    {"s", Dimension::time, 1},
    {"ms", Dimension::time, 1e-3},
};

struct Wording {
  std::string_view name, examples;
};

Wording wording(Dimension dimension) {
  switch (dimension) {
    case Dimension::flow:
      return {"a flow", "mL/s, L/min, mm3/s or m3/s"};
    case Dimension::velocity:
      return {"a velocity", "m/s, cm/s or mm/s"};
    case Dimension::pressure:
      return {"a pressure", "mmHg, dyn/cm2, Pa or kPa"};
    case Dimension::resistance:
      return {"a resistance", "dyn s/cm5, mmHg s/mL, mmHg min/L or Pa s/m3"};
    case Dimension::compliance:
      return {"a compliance", "cm5/dyn, mL/mmHg or m3/Pa"};
    case Dimension::viscosity:
      return {"a viscosity", "P, cP, Pa s or mPa s"};
    case Dimension::density:
      return {"a density", "g/mL, g/cm3 or kg/m3"};
    case Dimension::time:
      break;
  }
  return {"a time", "s or ms"};
}

std::string without_marks(std::string_view unit) {
  std::string plain;
  for (const char c : unit)
    if (c != ' ' && c != '\t' && c != '^' && c != '*') plain += c;
  return plain;
}

const Unit* find_unit(std::string_view unit) {
  const std::string plain = without_marks(unit);
  const auto found = std::find_if(std::begin(kUnits), std::end(kUnits),
                                  [&](const Unit& u) { return u.name == plain; });
  return found == std::end(kUnits) ? nullptr : &*found;
}

[[noreturn]] void refuse(std::string_view key, const std::string& what) {
  throw Error(ExitCode::usage, std::string(key) + ": " + what);
}

std::string quoted(std::string_view text) {
  std::string result(1, '"');
  result += text;
  return result += '"';
}

}  // namespace

double cgs_per(std::string_view unit, Dimension dimension, std::string_view key) {
  const Wording wanted = wording(dimension);
  if (without_marks(unit).empty()) {
    refuse(key, "needs a unit (" + std::string(wanted.examples) + ")");
  }
  const Unit* found = find_unit(unit);
  if (!found) {
    refuse(key, quoted(unit) + " is not a unit known here; " + std::string(wanted.name) +
                    " is in " + std::string(wanted.examples));
  }
  if (found->dimension != dimension) {
    refuse(key, quoted(unit) + " is the unit of " + std::string(wording(found->dimension).name) +
                    "; needed is " + std::string(wanted.name) + ", in " +
                    std::string(wanted.examples));
  }
  return found->cgs;
}

Dimension flow_or_velocity(std::string_view unit, std::string_view key) {
  const Unit* found = find_unit(unit);
  if (found && (found->dimension == Dimension::flow || found->dimension == Dimension::velocity))
    return found->dimension;
  refuse(key, quoted(unit) + " is the unit of no flow and no velocity; use " +
                  std::string(wording(Dimension::flow).examples) + ", or " +
                  std::string(wording(Dimension::velocity).examples));
}

double parse_quantity(std::string_view text, Dimension dimension, std::string_view key) {
  std::string_view rest = text;
  while (!rest.empty() && rest.front() == ' ') rest.remove_prefix(1);
  double value = 0;
  const auto [end, fault] = std::from_chars(rest.data(), rest.data() + rest.size(), value);
  if (fault != std::errc() || !std::isfinite(value)) {
    refuse(key, quoted(text) + " does not begin with a number; give " +
                    std::string(wording(dimension).name) + " with its unit (" +
                    std::string(wording(dimension).examples) + ")");
  }
  rest.remove_prefix(static_cast<std::size_t>(end - rest.data()));
  while (!rest.empty() && rest.front() == ' ') rest.remove_prefix(1);
  return value * cgs_per(rest, dimension, key);
}

double cgs_per(UnitSystem system, Dimension dimension) {
  if (system == UnitSystem::cgs) return 1;
  switch (dimension) {  // of millimetre, gram, second
    case Dimension::flow:
      return 1e-3;
    case Dimension::velocity:
      return 0.1;
    case Dimension::pressure:
      return 10;
    case Dimension::resistance:
      return 1e4;
    case Dimension::compliance:
      return 1e-4;
    case Dimension::viscosity:
      return 10;
    case Dimension::density:
      return 1e3;
    case Dimension::time:
      break;
  }
  return 1;
}

}  // namespace vstent::flow
