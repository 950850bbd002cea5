#include "report/outlines.hpp"

#include <algorithm>
#include <optional>

#include "sdf/polyline.hpp"
#include "vessels/centerline.hpp"
#include "vessels/sections.hpp"

namespace vstent::report {
namespace {

using nlohmann::json;

struct StentPlace {
  int branch = 0, towards = 0;
  double arc_length = 0;
};

std::optional<StentPlace> stent_place(const json& specification) {
  try {
    const json& stent = specification.at("stent");
    const json& at = stent.at("at");
    const int branch = at.at("branch").get<int>();
    return StentPlace{branch, stent.value("towards", branch),
                      vessels::parse_length(at.at("arc_length").get<std::string>(),
                                            vessels::LengthUnit::mm, "case.json: /stent/at")};
  } catch (const json::exception&) {
    return std::nullopt;
  }
}

std::vector<double> station_arcs(const json& metrics) {
  std::vector<double> arcs;
  const json stations = metrics.value("stations", json::array());
  for (const json& station : stations) {
    if (!station.is_object() || !station.contains("arc_length_mm")) return {};
    arcs.push_back(station["arc_length_mm"].get<double>());
  }
  return arcs;
}

}  // namespace

vessels::PolylineFile cut_outlines(const TriangleMesh& before, const TriangleMesh& after,
                                   const std::filesystem::path& centerline_file,
                                   vessels::LengthUnit unit, const json& specification,
                                   const json& metrics) {
  const std::optional<StentPlace> place = stent_place(specification);
  const std::vector<double> arcs = station_arcs(metrics);
  if (!place || arcs.empty()) return {};
  const vessels::Centerline centerline = vessels::read_centerline(centerline_file, unit);
  const int branches = static_cast<int>(centerline.branches.size());
  if (std::min(place->branch, place->towards) < 0 ||
      std::max(place->branch, place->towards) >= branches)
    return {};
  const Polyline& branch = centerline.branches[static_cast<std::size_t>(place->branch)].points;
  const Vec3 centre = point_at(branch, arc_lengths(branch), place->arc_length);
  const vessels::CenterlinePath way = vessels::paths(centerline, place->towards).front();
  const double middle = nearest_place(way.points, way.arc_length, centre).arc_length;
  const double start = middle - 0.5 * arcs.back();

  vessels::PolylineFile outlines;
  const vessels::Sectioner sectioners[] = {vessels::Sectioner(before), vessels::Sectioner(after)};
  for (std::size_t s = 0; s < arcs.size(); ++s) {
    const double arc = start + arcs[s];
    const Vec3 point = point_at(way.points, way.arc_length, arc);
    const Vec3 normal = tangent_at(way.points, way.arc_length, arc);
    const double reach = 5 * value_at(way.radii, way.arc_length, arc) + 0.5 * arcs.back();
    for (const int state : {0, 1}) {
      const std::optional<vessels::Section> section = sectioners[state].cut(point, normal, reach);
      if (!section) continue;
      outlines.lines.push_back(section->outline);
      outlines.line_arrays["Station"].push_back(static_cast<double>(s));
      outlines.line_arrays["After"].push_back(state);
    }
  }
  return outlines;
}

}  // namespace vstent::report
