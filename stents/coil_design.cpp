#include "stents/coil_design.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <sstream>
#include <stdexcept>

#include "stents/link_curve.hpp"

namespace vstent::stents {
namespace {

constexpr double two_pi = 2 * std::numbers::pi;

[[noreturn]] void refuse(const std::string& message) { throw std::invalid_argument(message); }

/// The turn from one point to the next that makes the piece between them `length` long.
double turn_between(const PatternPoint& from, double radius, double z, double length) {
  const double along2 = (z - from.z) * (z - from.z);
  const double mean = 0.5 * (from.radius + radius);
  double turn = std::sqrt(std::max(0.0, length * length - along2)) / mean;
  for (int i = 0; i < 20; ++i) {
    const double excess = cone_length(from, {radius, from.angle + turn, z}) - length;
    const double step = excess * length / (mean * mean * turn);
    turn -= step;
    if (std::abs(step) < 1e-16 * turn) break;
  }
  return turn;
}

}  // namespace

CoilDesign::CoilDesign(const CoilParameters& parameters, const Specification& specification,
                       std::optional<double> length_mm)
    : spine_(parameters.spine), section_(specification.section) {
  const double width = section_.width, thickness = section_.thickness;
  if (!(width > 0 && thickness > 0)) refuse("a coil needs a wire with a width and a thickness");
  if (!(parameters.pitch > width))
    refuse("the turns of a coil need a pitch above the wire's width");
  if (!(parameters.lengthening >= 0)) refuse("a coil cannot lengthen by less than nothing");
  nominal_radius_ = 0.5 * (specification.nominal_diameter - thickness);
  const double crimped = 0.5 * (specification.crimped_diameter - thickness);
  if (!(crimped > 0.5 * thickness && crimped < nominal_radius_))
    refuse("a coil's crimped diameter lies between twice its wire and its nominal diameter");
  const double steepness = parameters.pitch / (two_pi * nominal_radius_);
  nominal_sine_ = steepness / std::hypot(1, steepness);
  const double own = specification.nominal_length > 0 ? specification.nominal_length
                                                      : parameters.turns * parameters.pitch + width;
  const double length = length_mm.value_or(own);
  if (!(length > width + parameters.pitch)) refuse("a coil needs at least one turn");
  wire_length_ = (length - width) / nominal_sine_;
  exponent_ = spine_ ? 0 : std::log1p(parameters.lengthening) / std::log(nominal_radius_ / crimped);
  const double crimped_pitch = two_pi * crimped * std::tan(std::asin(sine(crimped)));
  if (crimped_pitch < width) {
    std::ostringstream message;
    message << "crimped, the turns of the coil would be " << crimped_pitch
            << " mm apart, less than the wire's width of " << width << " mm";
    refuse(message.str());
  }
  limits_.crimped_diameter = specification.crimped_diameter;
  limits_.nominal_diameter = specification.nominal_diameter;
  // One turn is left at R = l cos b / (2 pi).
  double low = nominal_radius_, high = wire_length_ / two_pi;
  for (int i = 0; i < 100; ++i) {
    const double middle = 0.5 * (low + high);
    const double s = sine(middle);
    (s < 1 && wire_length_ * std::sqrt(1 - s * s) > two_pi * middle ? low : high) = middle;
  }
  limits_.largest_diameter = 2 * low + thickness;
  const double turn = std::sqrt(8 * specification.largest_sag * thickness / nominal_radius_);
  const double largest_turn = crimped > 0 ? wire_length_ / crimped : 0;
  // As many pieces as the crimped coil, of the most turns, needs.
  pieces_ = std::max(
      16,
      static_cast<int>(std::ceil(largest_turn / (turn * std::sqrt(nominal_radius_ / crimped)))));
  pieces_ = std::max(pieces_, static_cast<int>(std::ceil(wire_length_ / nominal_radius_ / turn)));
}

double CoilDesign::sine(double radius) const {
  return nominal_sine_ * std::pow(radius / nominal_radius_, exponent_);
}

double CoilDesign::turns(double outer_diameter) const {
  const double radius = 0.5 * (outer_diameter - section_.thickness);
  const double s = sine(radius);
  return wire_length_ * std::sqrt(1 - s * s) / (two_pi * radius);
}

Pattern CoilDesign::expanded(const RadiusProfile& outer_radius) const {
  const double crimped = 0.5 * limits_.crimped_diameter;
  const auto centre_radius = [&](double share) {
    const double outer = outer_radius(share);
    require_within(limits_, outer);
    return std::max(outer, crimped) - 0.5 * section_.thickness;
  };
  const auto n = static_cast<std::size_t>(pieces_);
  const double piece = wire_length_ / pieces_;
  const double margin = 0.5 * section_.width;
  std::vector<double> z(n + 1);
  for (std::size_t i = 0; i <= n; ++i)
    z[i] = margin + wire_length_ * nominal_sine_ * static_cast<double>(i) / pieces_;
  double length = z.back() + margin;
  // Where a piece lies decides its radius, and radii where pieces lie.
  double change = 1;
  for (int round = 0; round < 100 && change > 1e-14; ++round) {
    std::vector<double> next(1, margin);
    for (std::size_t i = 0; i < n; ++i)
      next.push_back(next.back() + piece * sine(centre_radius(0.5 * (z[i] + z[i + 1]) / length)));
    const double next_length = next.back() + margin;
    change = 0;
    for (std::size_t i = 0; i <= n; ++i)
      change = std::max(change, std::abs(next[i] / next_length - z[i] / length));
    z = next;
    length = next_length;
  }
  Pattern pattern;
  pattern.section = section_;
  pattern.length = length;
  Member wire;
  wire.kind = Member::Kind::wire;
  wire.points.push_back({centre_radius(z[0] / length), 0, z[0]});
  for (std::size_t i = 1; i <= n; ++i) {
    const double radius = centre_radius(z[i] / length);
    const double turn = turn_between(wire.points.back(), radius, z[i], piece);
    wire.points.push_back({radius, wire.points.back().angle + turn, z[i]});
  }
  // Unwinding turns both ends alike.
  const double middle = 0.5 * wire.points.back().angle;
  for (PatternPoint& p : wire.points) p.angle -= middle;
  pattern.members.push_back(wire);
  if (spine_) {
    Member spine;
    spine.kind = Member::Kind::connector;
    const int steps = std::max(1, static_cast<int>(turns(limits_.nominal_diameter)));
    for (int i = 0; i <= steps; ++i) {
      const double at = margin + (length - 2 * margin) * i / steps;
      spine.points.push_back({centre_radius(at / length), 0, at});
    }
    pattern.members.push_back(spine);
  }
  for (Member& member : pattern.members)
    for (PatternPoint& p : member.points) {
      const double outer = outer_radius(std::clamp(p.z / length, 0.0, 1.0));
      if (outer < crimped) p.radius *= outer / crimped;
    }
  return pattern;
}

}  // namespace vstent::stents
