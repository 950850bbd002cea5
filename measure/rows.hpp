// The scalars of metrics.json: what each means, and where it is in Metrics. Inside this folder
// only.
#pragma once

#include <nlohmann/json.hpp>
#include <vector>

#include "measure/definitions.hpp"
#include "measure/measure.hpp"

namespace vstent::measure {

struct Row {
  Definition definition;
  nlohmann::ordered_json (*value)(const Metrics&);
};

std::vector<Row> lumen_rows();
std::vector<Row> shape_rows();
std::vector<Row> stent_rows();
std::vector<Row> wall_rows();
std::vector<Row> mesh_rows();

/// All of them, in the order of the file.
const std::vector<Row>& rows();

inline nlohmann::ordered_json or_null(const std::optional<double>& value) {
  return value ? nlohmann::ordered_json(*value) : nlohmann::ordered_json(nullptr);
}
inline nlohmann::ordered_json known(bool is_known, const nlohmann::ordered_json& value) {
  return is_known ? value : nlohmann::ordered_json(nullptr);
}

/// Conditions under which figures are null.
inline constexpr std::string_view kNoStent = "no stent is given";
inline constexpr std::string_view kNoTriangles =
    "the surfaces do not have the same vertices and triangles, so that places do not correspond";
inline constexpr std::string_view kNoTarget = "the stent's nominal diameter is not known";
inline constexpr std::string_view kNoReference =
    "no landing zone beside the treated length has a closed section free of branches";
inline constexpr std::string_view kNoSection = "no section there is closed and free of branches";
inline constexpr std::string_view kNoAxis = "the stent's own axis is not known";
inline constexpr std::string_view kNoDesign = "the stent is no design, or its design is not known";
inline constexpr std::string_view kNoPatch = "the patch that may move is not known";
inline constexpr std::string_view kNoNeighbour = "there is no such wall within reach";

}  // namespace vstent::measure
