// The report's page without its data, as the build embedded it.
#pragma once

#include <string_view>

namespace vstent::report {

/// HTML with kDataMark where the data go; empty when the build left the page out.
std::string_view page();

inline constexpr std::string_view kDataMark = "<!--vstent:data-->";

}  // namespace vstent::report
