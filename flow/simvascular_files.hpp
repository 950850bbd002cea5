// SimVascular's own files of outlet conditions. Inside this folder only.
#pragma once

#include "flow/boundary_conditions.hpp"

namespace vstent::flow {

struct NamedCondition {
  std::string name;
  Condition condition;
};

/// rcrt.dat, either that of the 3-D solver, whose blocks go with the names in `outlets` (one a
/// line, outlets.dat), or that of reduced-order models, where each block begins with its name (no
/// `outlets` then). \throws Error (input_file)
std::vector<NamedCondition> read_rcrt(const std::filesystem::path& path,
                                      const std::filesystem::path& outlets, UnitSystem units);

/// resistance.dat: a name and a resistance a line. \throws Error (input_file)
std::vector<NamedCondition> read_resistances(const std::filesystem::path& path, UnitSystem units);

}  // namespace vstent::flow
