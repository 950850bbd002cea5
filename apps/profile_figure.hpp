// The lumen along the centerline, before and after, as a figure.
#pragma once

#include <nlohmann/json_fwd.hpp>

#include "apps/figure.hpp"

namespace vstent::apps {

/// Equivalent diameters of the stations of a metrics.json over their arc length, shaded from the
/// shortest to the longest diameter; stations that run into a branch are left out. Where the stent
/// is only a part of the way, that part and half its length on either side.
/// \throws Error (input_file) when there are no stations
Figure profile_figure(const nlohmann::json& metrics);

}  // namespace vstent::apps
