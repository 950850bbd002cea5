// Metrics as files and text: metrics.json, profiles.csv, sections.vtp, a table for the terminal.
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>

#include "measure/measure.hpp"

namespace vstent::measure {

/// Every figure of definitions() that measuring alone can give; `unmeasured` says why one is null.
nlohmann::ordered_json to_json(const Metrics& metrics);

/// One row per station: arc_length_mm; area, equivalent, smallest and largest diameter before_ and
/// after_; target_diameter_mm; curvature_before_per_mm, curvature_after_per_mm; flags, of
/// in_stent, open_before, open_after, crosses_branch_before, crosses_branch_after, with spaces
/// between. What is not known stays empty.
std::string profiles_csv(const Metrics& metrics);

/// The outlines of all sections as closed lines, in `unit`; per line arc_length_mm, station (row of
/// profiles.csv, from 0), and which: 0 before, 1 after. \throws Error (output)
void write_sections(const Metrics& metrics, vessels::LengthUnit unit,
                    const std::filesystem::path& path);

/// The figures of a metrics.json by their labels, group by group.
std::string text_table(const nlohmann::ordered_json& metrics);

/// definitions() as a Markdown table.
std::string definitions_markdown();

}  // namespace vstent::measure
