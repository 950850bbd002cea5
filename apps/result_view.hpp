// From where a result is looked at.
#pragma once

#include "apps/drawing.hpp"
#include "report/result_files.hpp"

namespace vstent::apps {

/// Across the plane in which the centerline bends at the stent; what moved fills the view.
View view_of(const report::ResultFiles& files);

}  // namespace vstent::apps
