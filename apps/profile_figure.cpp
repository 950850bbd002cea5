#include "apps/profile_figure.hpp"

#include <algorithm>
#include <nlohmann/json.hpp>
#include <optional>

#include "apps/plot.hpp"
#include "vessels/error.hpp"

namespace vstent::apps {
namespace {

using nlohmann::json;

std::optional<double> number_at(const json& object, const char* key) {
  const auto found = object.find(key);
  if (found == object.end() || !found->is_number()) return std::nullopt;
  return found->get<double>();
}

struct Chord {
  std::optional<double> equivalent, shortest, longest;
};

struct Row {
  double arc = 0;
  Chord before, after;
  std::optional<double> target;
};

Chord chord(const json& station, const char* when) {
  const auto section = station.find(when);
  const auto crossing = station.find(std::string("crosses_branch_") + when);
  if (section == station.end() || !section->is_object()) return {};
  if (crossing != station.end() && *crossing == true) return {};
  return {number_at(*section, "equivalent_diameter_mm"), number_at(*section, "min_diameter_mm"),
          number_at(*section, "max_diameter_mm")};
}

std::optional<Range> stented(const json& metrics) {
  const auto lumen = metrics.find("lumen");
  if (lumen == metrics.end() || !lumen->is_object()) return std::nullopt;
  const auto from = number_at(*lumen, "treated_from_mm"), to = number_at(*lumen, "treated_to_mm");
  if (!from || !to) return std::nullopt;
  return Range{*from, *to};
}

std::vector<Row> rows_of(const json& metrics) {
  std::vector<Row> rows;
  const json stations = metrics.value("stations", json::array());
  const std::optional<Range> stent = stented(metrics);
  const double margin = stent ? 0.5 * (stent->high - stent->low) : 0;
  for (const json& station : stations) {
    const std::optional<double> arc = number_at(station, "arc_length_mm");
    if (!arc) continue;
    if (stent && (*arc < stent->low - margin || *arc > stent->high + margin)) continue;
    rows.push_back({*arc, chord(station, "before"), chord(station, "after"),
                    number_at(station, "target_diameter_mm")});
  }
  if (rows.size() < 2)
    throw Error(ExitCode::input_file, "metrics.json: /stations has no profile to draw");
  return rows;
}

void band(Plot& plot, const std::vector<Row>& rows, Chord Row::*when, Colour colour) {
  colour.opacity = 0.16;
  for (std::size_t i = 1; i < rows.size(); ++i) {
    const Chord &a = rows[i - 1].*when, &b = rows[i].*when;
    if (!a.shortest || !a.longest || !b.shortest || !b.longest) continue;
    plot.quadrangle({plot.spot(rows[i - 1].arc, *a.shortest), plot.spot(rows[i].arc, *b.shortest),
                     plot.spot(rows[i].arc, *b.longest), plot.spot(rows[i - 1].arc, *a.longest)},
                    colour);
  }
}

template <class Value>
std::vector<PlotPoint> points_of(const std::vector<Row>& rows, Value&& value) {
  std::vector<PlotPoint> points;
  for (const Row& row : rows) points.push_back({row.arc, value(row)});
  return points;
}

}  // namespace

Figure profile_figure(const json& metrics) {
  const std::vector<Row> rows = rows_of(metrics);
  Range x, y;
  for (const Row& row : rows) {
    x.include(row.arc);
    for (const Chord& c : {row.before, row.after}) {
      for (const auto& d : {c.equivalent, c.shortest, c.longest}) {
        if (d) y.include(*d);
      }
    }
    if (row.target) y.include(*row.target);
  }
  if (!(y.high >= y.low) || !(x.high > x.low))
    throw Error(ExitCode::input_file, "metrics.json: /stations has no closed section to draw");
  const double margin = std::max(0.06 * (y.high - y.low), 1e-3 * y.high);
  y = {std::max(0.0, y.low - margin), y.high + margin};

  Plot plot(x, y);
  if (const std::optional<Range> stent = stented(metrics))
    plot.shade(stent->low, stent->high, {63, 111, 159, 0.09});
  plot.axes("arc length along the centerline (mm)", "equivalent diameter (mm)");
  band(plot, rows, &Row::before, kBeforeColour);
  band(plot, rows, &Row::after, kAfterColour);
  const Stroke target{{}, kTargetColour, 1.6}, before{{}, kBeforeColour, 2.4},
      after{{}, kAfterColour, 2.6};
  const auto equivalent = [&](Chord Row::*when) {
    return points_of(rows, [&](const Row& r) { return (r.*when).equivalent; });
  };
  plot.line(equivalent(&Row::before), before, false);
  plot.line(equivalent(&Row::after), after, false);
  plot.line(points_of(rows, [](const Row& r) { return r.target; }), target, true);
  plot.legend({{"before", before}, {"after", after}, {"nominal", target, true}});
  return plot.take();
}

}  // namespace vstent::apps
