#include "apps/plot.hpp"

#include <algorithm>
#include <cmath>

#include "apps/commands.hpp"
#include "vessels/text.hpp"

namespace vstent::apps {
namespace {

constexpr double kWidth = 900, kHeight = 560;
constexpr double kLeft = 80, kRight = 24, kTop = 24, kBottom = 96;
constexpr Colour kGrid{222, 227, 232};

/// Distance between ticks: 1, 2 or 5 times a power of ten, about six in the range.
double tick_step(const Range& range) {
  const double rough = (range.high - range.low) / 6;
  const double decade = std::pow(10, std::floor(std::log10(rough)));
  for (const double factor : {1.0, 2.0, 5.0}) {
    if (factor * decade >= rough) return factor * decade;
  }
  return 10 * decade;
}

}  // namespace

void Range::include(double value) {
  low = std::min(low, value);
  high = std::max(high, value);
}

Plot::Plot(const Range& x, const Range& y) : x_(x), y_(y) {
  figure_.width = kWidth, figure_.height = kHeight;
}

Spot Plot::spot(double x, double y) const {
  return {kLeft + (x - x_.low) / (x_.high - x_.low) * (kWidth - kLeft - kRight),
          kHeight - kBottom - (y - y_.low) / (y_.high - y_.low) * (kHeight - kTop - kBottom)};
}

void Plot::axes(const std::string& x_label, const std::string& y_label) {
  const double x_step = tick_step(x_), y_step = tick_step(y_);
  for (double i = std::ceil(x_.low / x_step); i * x_step <= x_.high; ++i) {
    const Spot at = spot(i * x_step, y_.low);
    figure_.strokes.push_back({{at, spot(i * x_step, y_.high)}, kGrid, 1});
    figure_.captions.push_back(
        {{at.x, at.y + 20}, vessels::number(i * x_step + 0.0), Caption::Anchor::middle});
  }
  for (double i = std::ceil(y_.low / y_step); i * y_step <= y_.high; ++i) {
    const Spot at = spot(x_.low, i * y_step);
    figure_.strokes.push_back({{at, spot(x_.high, i * y_step)}, kGrid, 1});
    figure_.captions.push_back(
        {{at.x - 8, at.y + 5}, vessels::number(i * y_step + 0.0), Caption::Anchor::right});
  }
  const double middle = 0.5 * (kLeft + kWidth - kRight);
  figure_.captions.push_back(
      {{middle, kHeight - kBottom + 46}, x_label, Caption::Anchor::middle, 15});
  figure_.captions.push_back(
      {{24, 0.5 * (kTop + kHeight - kBottom)}, y_label, Caption::Anchor::middle, 15, true});
}

void Plot::shade(double from, double to, Colour colour) {
  const double a = std::max(from, x_.low), b = std::min(to, x_.high);
  quadrangle({spot(a, y_.low), spot(b, y_.low), spot(b, y_.high), spot(a, y_.high)}, colour);
}

void Plot::mark(double x, Colour colour) {
  add({{spot(x, y_.low), spot(x, y_.high)}, colour, 1.2}, true);
}

void Plot::dot(double x, double y, double size, Colour colour) {
  const Spot s = spot(x, y);
  add({{{s.x - size, s.y}, {s.x + size, s.y}}, colour, 2 * size}, false);
}

void Plot::quadrangle(const std::array<Spot, 4>& corners, Colour colour) {
  figure_.areas.push_back({corners, colour});
}

void Plot::line(const std::vector<PlotPoint>& points, const Stroke& style, bool dash) {
  Stroke stroke = style;
  const auto finish = [&] {
    if (stroke.points.size() > 1) add(stroke, dash);
    stroke.points.clear();
  };
  for (const PlotPoint& point : points) {
    if (point.y) {
      stroke.points.push_back(spot(point.x, *point.y));
    } else {
      finish();
    }
  }
  finish();
}

void Plot::legend(const std::vector<Entry>& entries) {
  double x = kLeft;
  const double y = kHeight - 18;
  for (const Entry& entry : entries) {
    add({{{x, y - 5}, {x + 30, y - 5}}, entry.style.colour, entry.style.width}, entry.dash);
    figure_.captions.push_back({{x + 38, y}, entry.text});
    x += 38 + 9.0 * static_cast<double>(entry.text.size()) + 26;
  }
  figure_.captions.push_back({{kWidth - kRight, y}, kDisclaimer, Caption::Anchor::right, 11});
}

void Plot::add(const Stroke& stroke, bool dash) {
  const std::vector<Stroke> pieces = dash ? dashed(stroke, 9, 6) : std::vector<Stroke>{stroke};
  figure_.strokes.insert(figure_.strokes.end(), pieces.begin(), pieces.end());
}

}  // namespace vstent::apps
