// Axes with a grid, and what is drawn between them.
#pragma once

#include <limits>
#include <optional>

#include "apps/figure.hpp"

namespace vstent::apps {

/// Colours of plots.
inline constexpr Colour kBeforeColour{93, 105, 116}, kAfterColour{168, 42, 34},
    kTargetColour{63, 111, 159};

struct Range {
  double low = std::numeric_limits<double>::infinity();
  double high = -std::numeric_limits<double>::infinity();
  void include(double value);
};

/// A place of a line, or nothing where the line has a gap.
struct PlotPoint {
  double x = 0;
  std::optional<double> y;
};

class Plot {
 public:
  Plot(const Range& x, const Range& y);

  Spot spot(double x, double y) const;
  void axes(const std::string& x_label, const std::string& y_label);
  void shade(double from, double to, Colour colour);
  /// A vertical line over the height of the plot.
  void mark(double x, Colour colour);
  void dot(double x, double y, double size, Colour colour);  ///< `size` to either side, pixels
  void quadrangle(const std::array<Spot, 4>& corners, Colour colour);
  void line(const std::vector<PlotPoint>& points, const Stroke& style, bool dash);

  struct Entry {
    std::string text;
    Stroke style;
    bool dash = false;
  };
  void legend(const std::vector<Entry>& entries);  ///< and the disclaimer
  Figure take() { return std::move(figure_); }

 private:
  void add(const Stroke& stroke, bool dash);

  Range x_, y_;
  Figure figure_;
};

}  // namespace vstent::apps
