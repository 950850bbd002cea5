// A flat figure of lines, areas and texts: as SVG, or drawn off screen as PNG.
#pragma once

#include <array>
#include <filesystem>
#include <string>
#include <vector>

namespace vstent::apps {

/// Pixels, y downwards.
struct Spot {
  double x = 0, y = 0;
};

struct Colour {
  int red = 0, green = 0, blue = 0;
  double opacity = 1;
};

struct Stroke {
  std::vector<Spot> points;
  Colour colour;
  double width = 1;
};

struct Area {
  std::array<Spot, 4> corners;
  Colour colour;
};

struct Caption {
  enum class Anchor { left, middle, right };
  Spot at;  ///< on the text's baseline
  std::string text;
  Anchor anchor = Anchor::left;
  double size = 14;
  bool upwards = false;  ///< turned to read from below
};

/// Areas lie below strokes, strokes below captions.
struct Figure {
  double width = 0, height = 0;
  std::vector<Area> areas;
  std::vector<Stroke> strokes;
  std::vector<Caption> captions;
};

/// The pieces of a dashed line.
std::vector<Stroke> dashed(const Stroke& stroke, double dash, double gap);

std::string svg(const Figure& figure);
/// At two pixels per unit; needs a display. \throws Error (output)
void write_png(const Figure& figure, const std::filesystem::path& path);

}  // namespace vstent::apps
