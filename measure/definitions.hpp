// What every figure of metrics.json means: the one list behind the file, the text table, the
// documentation and the report.
#pragma once

#include <span>
#include <string_view>

namespace vstent::measure {

struct Definition {
  std::string_view key;      ///< JSON pointer in metrics.json; `*` stands for any index or name
  std::string_view label;    ///< for a table's row
  std::string_view unit;     ///< empty: a number without, or no number
  std::string_view meaning;  ///< one or two sentences
  std::string_view absent;   ///< when it is null or not there; empty: never
};

/// One per scalar, in the order of the file.
std::span<const Definition> definitions();

/// The definition that a pointer falls under; null: none.
const Definition* find_definition(std::string_view pointer);

}  // namespace vstent::measure
