// What the metrics mean, for the tables of a report.
#pragma once

#include <span>
#include <string_view>

namespace vstent::report {

struct Definition {
  std::string_view key;  ///< JSON pointer into metrics.json; * stands for any index of an array
  std::string_view label;
  std::string_view unit;
  std::string_view meaning;
};

std::span<const Definition> definitions();

}  // namespace vstent::report
