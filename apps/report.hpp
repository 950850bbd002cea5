// The report page of a result folder.
#pragma once

#include <filesystem>

namespace vstent::apps {

/// Writes report.html of the results in `stage`, named after the folder `out` that they are meant
/// for. A page that cannot be had is a warning: the results do not depend on it.
void add_report_page(const std::filesystem::path& stage, const std::filesystem::path& out);

}  // namespace vstent::apps
