// What a report takes from a result folder.
#pragma once

#include <nlohmann/json.hpp>
#include <optional>

#include "vessels/file_arrays.hpp"

namespace vstent::report {

struct SavedStep {
  int step = 0;
  std::filesystem::path wall, stent;
};

/// Meshes and lines in mm.
struct ResultFiles {
  vessels::LengthUnit unit = vessels::LengthUnit::mm;
  std::string metrics_text, case_text;  ///< as written
  nlohmann::json metrics, specification;
  TriangleMesh after;
  std::vector<Vec3> before;                        ///< the vertices of `after` before stenting
  vessels::Fields vertex_fields, triangle_fields;  ///< scalars; a vector becomes its length
  TriangleMesh stent;                              ///< empty when there is no stent.vtp
  std::vector<Polyline> struts, centerline;        ///< empty when there is no such file
  vessels::PolylineFile outlines;
  std::string profiles_csv, history_csv;  ///< empty when there is no such file
  std::vector<SavedStep> steps;
  std::vector<std::string> warnings;
};

/// \throws Error (input_file)
ResultFiles read_result(const std::filesystem::path& folder);

/// metrics.json alone. \throws Error (input_file)
nlohmann::json read_metrics(const std::filesystem::path& folder);

}  // namespace vstent::report
