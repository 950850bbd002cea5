// Length units that surface files are declared in.
#pragma once

#include <string>
#include <string_view>

namespace vstent::vessels {

enum class LengthUnit { mm, cm, m };

/// \throws Error (usage) for anything but mm, cm, m
LengthUnit parse_unit(std::string_view name);
std::string_view name(LengthUnit unit);
double millimetres_per(LengthUnit unit);

/// "30mm", "1.6 cm", "0.03m" in millimetres; a bare number takes `default_unit`.
/// \throws Error (usage) naming `key` for anything else, and for values that are not finite
double parse_length(std::string_view text, LengthUnit default_unit, std::string_view key);

}  // namespace vstent::vessels
