#include "stents/diamond_design.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <stdexcept>

#include "stents/link_curve.hpp"

namespace vstent::stents {
namespace {

using std::numbers::pi;

std::string text(double value) {
  char buffer[32];
  std::snprintf(buffer, sizeof buffer, "%.4g", value);
  return buffer;
}

void require(bool holds, const std::string& what) {
  if (!holds) throw std::invalid_argument(what);
}

}  // namespace

DiamondDesign::DiamondDesign(const DiamondParameters& p, const Specification& s,
                             std::optional<double> length)
    : parameters_(p), section_(s.section), rows_(p.rows) {
  require(p.crowns >= 3, "diamonds need at least 3 crowns");
  require(p.rows >= 1, "diamonds need at least one row");
  require(p.strut_length > 0 && p.bridge >= 0,
          "struts need a positive length, bridges none below 0");
  require(section_.width > 0 && section_.thickness > 0, "struts need a width and a thickness");
  require(s.crimped_diameter > 2 * section_.thickness && s.nominal_diameter > s.crimped_diameter,
          "the nominal diameter must be larger than the crimped one, which must leave a lumen");
  limits_ = {s.crimped_diameter, s.nominal_diameter,
             2 * p.crowns * p.strut_length / pi + section_.thickness};
  require_within(limits_, 0.5 * s.nominal_diameter);
  require(pi * centre_radius(s.crimped_diameter) / p.crowns >= section_.width,
          std::to_string(p.crowns) + " crowns need a crimped diameter of at least " +
              text(2 * p.crowns * section_.width / pi + section_.thickness) + " mm, it is " +
              text(s.crimped_diameter) + " mm");
  if (length) {
    const double row = row_length(s.nominal_diameter);
    rows_ = std::max(
        1, static_cast<int>(std::lround((*length - section_.width + p.bridge) / (row + p.bridge))));
  }
  // the largest angle between points of a strut is reached at every diameter
  const double step =
      std::sqrt(8 * s.largest_sag * section_.thickness / centre_radius(limits_.largest_diameter));
  chords_ = std::max(2, static_cast<int>(std::ceil(pi / p.crowns / step)));
}

double DiamondDesign::centre_radius(double outer_diameter) const {
  return 0.5 * (outer_diameter - section_.thickness);
}

double DiamondDesign::row_length(double proximal_radius, double distal_radius) const {
  const double l = parameters_.strut_length, turn = pi / parameters_.crowns;
  if (proximal_radius == distal_radius) {
    const double half_width = proximal_radius * turn;
    return std::sqrt(std::max(0.0, (l - half_width) * (l + half_width)));
  }
  const auto reached = [&](double z) {
    return cone_length({proximal_radius, 0, 0}, {distal_radius, turn, z});
  };
  require(reached(0) <= l, "struts of " + text(l) + " mm cannot climb from radius " +
                               text(proximal_radius) + " to " + text(distal_radius) + " mm");
  double low = 0, high = l;
  while (true) {
    const double middle = 0.5 * (low + high);
    if (middle <= low || middle >= high) return middle;
    (reached(middle) < l ? low : high) = middle;
  }
}

double DiamondDesign::row_length(double outer_diameter) const {
  require_within(limits_, 0.5 * outer_diameter);
  const double radius = centre_radius(std::max(outer_diameter, limits_.crimped_diameter));
  return row_length(radius, radius);
}

Pattern DiamondDesign::expanded(const RadiusProfile& outer_radius) const {
  const double pitch = row_length(limits_.nominal_diameter) + parameters_.bridge;
  const double nominal_length = rows_ * pitch - parameters_.bridge + section_.width;
  struct Level {
    double radius, drawn_radius;
  };
  std::vector<Level> levels;  // between rows, in the middle of bridges
  for (int j = 0; j <= rows_; ++j) {
    const double at = 0.5 * (section_.width - parameters_.bridge) + j * pitch;
    const double outer = outer_radius(std::clamp(at / nominal_length, 0.0, 1.0));
    require_within(limits_, outer);
    const double drawn = centre_radius(2 * outer);
    require(drawn > 0, "a diameter of " + text(2 * outer) + " mm leaves no lumen");
    levels.push_back({std::max(drawn, centre_radius(limits_.crimped_diameter)), drawn});
  }
  Pattern pattern{.section = section_, .members = {}, .rings = {}, .length = 0};
  const double turn = pi / parameters_.crowns;
  double z = 0.5 * section_.width;
  std::vector<Member> bridges;
  for (int row = 0; row < rows_; ++row) {
    const Level& proximal = levels[static_cast<std::size_t>(row)];
    const Level& distal = levels[static_cast<std::size_t>(row) + 1];
    const double height = row_length(proximal.radius, distal.radius);
    Member member{.kind = Member::Kind::strut, .closed = true, .ring = row, .points = {}};
    for (int crown = 0; crown < 2 * parameters_.crowns; ++crown) {
      const double start = (row % 2 + crown) * turn;  // even crowns are distal
      for (int i = 0; i < chords_; ++i) {
        const double share = static_cast<double>(i) / chords_;
        const double up = crown % 2 == 0 ? 1 - share : share;
        member.points.push_back(
            {proximal.drawn_radius + up * (distal.drawn_radius - proximal.drawn_radius),
             start + share * turn, z + up * height});
      }
      if (crown % 2 == 0 && row + 1 < rows_ && parameters_.bridge > 0) {
        const PatternPoint from{distal.drawn_radius, start, z + height};
        PatternPoint to = from;
        to.z += parameters_.bridge;
        bridges.push_back({.kind = Member::Kind::connector,
                           .closed = false,
                           .ring = row,
                           .next_ring = row + 1,
                           .points = {from, to}});
      }
    }
    pattern.rings.push_back(
        {z + 0.5 * height, height, 0.5 * (proximal.drawn_radius + distal.drawn_radius)});
    pattern.members.push_back(std::move(member));
    z += height + (row + 1 < rows_ ? parameters_.bridge : 0);
  }
  pattern.members.insert(pattern.members.end(), bridges.begin(), bridges.end());
  pattern.length = z + 0.5 * section_.width;
  return pattern;
}

}  // namespace vstent::stents
