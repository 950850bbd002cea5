#include "vessels/units.hpp"

#include <charconv>
#include <cmath>

#include "vessels/error.hpp"

namespace vstent::vessels {

LengthUnit parse_unit(std::string_view name) {
  if (name == "mm") return LengthUnit::mm;
  if (name == "cm") return LengthUnit::cm;
  if (name == "m") return LengthUnit::m;
  throw Error(ExitCode::usage,
              "unit: \"" + std::string(name) + "\" is not a length unit, use mm, cm or m");
}

std::string_view name(LengthUnit unit) {
  switch (unit) {
    case LengthUnit::cm:
      return "cm";
    case LengthUnit::m:
      return "m";
    case LengthUnit::mm:
      break;
  }
  return "mm";
}

double millimetres_per(LengthUnit unit) {
  switch (unit) {
    case LengthUnit::cm:
      return 10.0;
    case LengthUnit::m:
      return 1000.0;
    case LengthUnit::mm:
      break;
  }
  return 1.0;
}

double parse_length(std::string_view text, LengthUnit default_unit, std::string_view key) {
  const auto refuse = [&](const std::string& why) -> Error {
    return Error(ExitCode::usage, std::string(key) + ": \"" + std::string(text) + "\" " + why +
                                      ", give a length such as 30mm, 1.6cm or 0.03m");
  };
  const auto blank = [](char c) { return c == ' ' || c == '\t'; };
  std::string_view rest = text;
  while (!rest.empty() && blank(rest.front())) rest.remove_prefix(1);
  while (!rest.empty() && blank(rest.back())) rest.remove_suffix(1);
  const bool plus_sign = rest.size() > 1 && rest.front() == '+' && rest[1] != '-';
  if (plus_sign) rest.remove_prefix(1);

  // from_chars ignores the locale: a decimal comma is never a decimal point here.
  double value = 0;
  const auto [end, fault] = std::from_chars(rest.data(), rest.data() + rest.size(), value);
  if (fault == std::errc::result_out_of_range) throw refuse("is out of range");
  if (fault != std::errc()) throw refuse("does not begin with a number");
  if (!std::isfinite(value)) throw refuse("is not finite");
  rest.remove_prefix(static_cast<std::size_t>(end - rest.data()));
  while (!rest.empty() && blank(rest.front())) rest.remove_prefix(1);

  LengthUnit unit = default_unit;
  if (!rest.empty()) {
    if (rest != "mm" && rest != "cm" && rest != "m") throw refuse("has an unknown unit");
    unit = parse_unit(rest);
  }
  const double millimetres = value * millimetres_per(unit);
  if (!std::isfinite(millimetres)) throw refuse("is out of range");
  return millimetres;
}

}  // namespace vstent::vessels
