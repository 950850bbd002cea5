// What the metrics mean, for the tables of a report.
#pragma once

#include <span>
#include <string_view>

namespace vstent::report {

struct Definition {
  std::string_view key;      ///< JSON pointer in metrics.json; `*` stands for any index or name
  std::string_view label;    ///< for a table's row
  std::string_view unit;     ///< empty: a number without, or no number
  std::string_view meaning;  ///< one or two sentences
  std::string_view absent;   ///< when it is null or not there; empty: never
};

std::span<const Definition> definitions();

}  // namespace vstent::report
