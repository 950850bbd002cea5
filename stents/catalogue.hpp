// Presets patterned after stents that are described in public; none is the maker's own data.
#pragma once

#include <string>
#include <vector>

#include "stents/specification.hpp"

namespace vstent::stents {

/// Every preset; each of its parameters has a figure that says where it is from.
const std::vector<Specification>& catalogue();

/// Null where there is none of that name.
const Specification* find_preset(const std::string& name);

std::string_view word(Provenance provenance);

}  // namespace vstent::stents
