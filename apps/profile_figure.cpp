#include "apps/profile_figure.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>
#include <optional>

#include "apps/commands.hpp"
#include "vessels/error.hpp"
#include "vessels/text.hpp"

namespace vstent::apps {
namespace {

using nlohmann::json;

constexpr double kWidth = 900, kHeight = 560;
constexpr double kLeft = 80, kRight = 24, kTop = 24, kBottom = 96;
constexpr Colour kText{29, 39, 51}, kGrid{222, 227, 232};
constexpr Colour kBefore{93, 105, 116}, kAfter{168, 42, 34}, kTarget{63, 111, 159};

struct Range {
  double low = std::numeric_limits<double>::infinity();
  double high = -std::numeric_limits<double>::infinity();
  void include(double value) {
    low = std::min(low, value);
    high = std::max(high, value);
  }
};

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

/// Distance between ticks: 1, 2 or 5 times a power of ten, about six in the range.
double tick_step(const Range& range) {
  const double rough = (range.high - range.low) / 6;
  const double decade = std::pow(10, std::floor(std::log10(rough)));
  for (const double factor : {1.0, 2.0, 5.0}) {
    if (factor * decade >= rough) return factor * decade;
  }
  return 10 * decade;
}

class Plot {
 public:
  Plot(const Range& x, const Range& y) : x_(x), y_(y) {
    figure_.width = kWidth, figure_.height = kHeight;
  }

  Spot spot(double x, double y) const {
    return {kLeft + (x - x_.low) / (x_.high - x_.low) * (kWidth - kLeft - kRight),
            kHeight - kBottom - (y - y_.low) / (y_.high - y_.low) * (kHeight - kTop - kBottom)};
  }

  void axes(const std::string& x_label, const std::string& y_label) {
    const double x_step = tick_step(x_), y_step = tick_step(y_);
    for (double i = std::ceil(x_.low / x_step); i * x_step <= x_.high; ++i) {
      const Spot at = spot(i * x_step, y_.low);
      figure_.strokes.push_back({{at, spot(i * x_step, y_.high)}, kGrid, 1});
      figure_.captions.push_back(
          {{at.x, at.y + 20}, vessels::number(i * x_step), Caption::Anchor::middle});
    }
    for (double i = std::ceil(y_.low / y_step); i * y_step <= y_.high; ++i) {
      const Spot at = spot(x_.low, i * y_step);
      figure_.strokes.push_back({{at, spot(x_.high, i * y_step)}, kGrid, 1});
      figure_.captions.push_back(
          {{at.x - 8, at.y + 5}, vessels::number(i * y_step), Caption::Anchor::right});
    }
    const double middle = 0.5 * (kLeft + kWidth - kRight);
    figure_.captions.push_back(
        {{middle, kHeight - kBottom + 46}, x_label, Caption::Anchor::middle, 15});
    figure_.captions.push_back(
        {{24, 0.5 * (kTop + kHeight - kBottom)}, y_label, Caption::Anchor::middle, 15, true});
  }

  void shade(double from, double to, Colour colour) {
    const double a = std::max(from, x_.low), b = std::min(to, x_.high);
    figure_.areas.push_back(
        {{spot(a, y_.low), spot(b, y_.low), spot(b, y_.high), spot(a, y_.high)}, colour});
  }

  void band(const std::vector<Row>& rows, Chord Row::*when, Colour colour) {
    colour.opacity = 0.16;
    for (std::size_t i = 1; i < rows.size(); ++i) {
      const Chord &a = rows[i - 1].*when, &b = rows[i].*when;
      if (!a.shortest || !a.longest || !b.shortest || !b.longest) continue;
      figure_.areas.push_back({{spot(rows[i - 1].arc, *a.shortest), spot(rows[i].arc, *b.shortest),
                                spot(rows[i].arc, *b.longest), spot(rows[i - 1].arc, *a.longest)},
                               colour});
    }
  }

  /// `value` gives nothing where the line has a gap.
  template <class Value>
  void line(const std::vector<Row>& rows, Value&& value, const Stroke& style, bool dash) {
    Stroke stroke = style;
    const auto finish = [&] {
      if (stroke.points.size() > 1) add(stroke, dash);
      stroke.points.clear();
    };
    for (const Row& row : rows) {
      if (const std::optional<double> y = value(row)) {
        stroke.points.push_back(spot(row.arc, *y));
      } else {
        finish();
      }
    }
    finish();
  }

  struct Entry {
    std::string text;
    Stroke style;
    bool dash = false;
  };

  void legend(const std::vector<Entry>& entries) {
    double x = kLeft;
    const double y = kHeight - 18;
    for (const Entry& entry : entries) {
      add({{{x, y - 5}, {x + 30, y - 5}}, entry.style.colour, entry.style.width}, entry.dash);
      figure_.captions.push_back({{x + 38, y}, entry.text});
      x += 38 + 9.0 * static_cast<double>(entry.text.size()) + 26;
    }
    figure_.captions.push_back({{kWidth - kRight, y}, kDisclaimer, Caption::Anchor::right, 11});
  }

  Figure take() { return std::move(figure_); }

 private:
  void add(const Stroke& stroke, bool dash) {
    const std::vector<Stroke> pieces = dash ? dashed(stroke, 9, 6) : std::vector<Stroke>{stroke};
    figure_.strokes.insert(figure_.strokes.end(), pieces.begin(), pieces.end());
  }

  Range x_, y_;
  Figure figure_;
};

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
  plot.band(rows, &Row::before, kBefore);
  plot.band(rows, &Row::after, kAfter);
  const Stroke target{{}, kTarget, 1.6}, before{{}, kBefore, 2.4}, after{{}, kAfter, 2.6};
  plot.line(
      rows, [](const Row& r) { return r.before.equivalent; }, before, false);
  plot.line(
      rows, [](const Row& r) { return r.after.equivalent; }, after, false);
  plot.line(
      rows, [](const Row& r) { return r.target; }, target, true);
  plot.legend({{"before", before}, {"after", after}, {"nominal", target, true}});
  return plot.take();
}

}  // namespace vstent::apps
