// Polylines with arrays per line, as .vtp.
#pragma once

#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "sdf/geometry.hpp"

namespace vstent::vessels {

/// As write_polylines (surface.hpp), with values and marks per line instead of arrays per point.
/// \throws Error (output)
void write_polylines_with_values(const std::vector<Polyline>& lines,
                                 const std::map<std::string, std::vector<double>>& line_values,
                                 const std::map<std::string, std::vector<int>>& line_marks,
                                 const std::filesystem::path& path, double scale);

}  // namespace vstent::vessels
