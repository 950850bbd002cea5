#include "stents/ring_design.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <stdexcept>

#include "stents/link_curve.hpp"

namespace vstent::stents {
namespace {

using std::numbers::pi;

constexpr int kExpansionsLookedAt = 24;  // to find how many chords the whole range needs
constexpr int kLinkChords = 24;

std::string text(double value) {
  char buffer[32];
  std::snprintf(buffer, sizeof buffer, "%.4g", value);
  return buffer;
}

void require(bool holds, const std::string& what) {
  if (!holds) throw std::invalid_argument(what);
}

bool runs_straight(const Connectors& c) {
  return c.shape == Link::straight && c.phase != Phase::offset;
}

}  // namespace

struct RingDesign::Placed {
  double radius = 0;        // mm, of its centre line
  double drawn_radius = 0;  // less when asked for less than crimped
  double height = 0, z = 0;
  double phase = 0;  // rad, of its first distal crown
};

RingDesign::RingDesign(const RingParameters& parameters, const Specification& specification,
                       std::optional<double> length)
    : parameters_(parameters),
      section_(specification.section),
      wave_(parameters),
      sag_(specification.largest_sag) {
  const Connectors& c = parameters.connectors;
  require(parameters.crowns >= 2, "a ring needs at least 2 crowns");
  require(parameters.rings >= 1, "a stent needs at least one ring");
  require(c.count >= 1 && c.count <= parameters.crowns,
          "connectors per gap must be between 1 and the number of crowns, " +
              std::to_string(parameters.crowns));
  require(c.length > 0, "connectors need a positive length");
  require(c.absorption >= 0 && c.absorption <= 1, "absorption must be from 0 to 1");
  require(!runs_straight(c) || c.absorption == 0,
          "straight connectors along the axis cannot absorb; give them a bend or an offset");
  require(c.phase != Phase::offset || c.shape == Link::straight,
          "offset connectors are straight; they absorb by turning");
  a_ = c.phase == Phase::far_peak ? -0.5 : 0.5;
  b_ = c.phase == Phase::facing || c.phase == Phase::offset ? -0.5 : 0.5;
  derive_limits(specification);
  count_rings(length);
  for (int i = 0; i <= kExpansionsLookedAt; ++i) {
    const double share = static_cast<double>(i) / kExpansionsLookedAt;
    const double radius = centre_radius(
        limits_.crimped_diameter + share * (limits_.largest_diameter - limits_.crimped_diameter));
    chords_ = finer(chords_, wave_.chords(half_width(radius), drawing(radius)));
  }
}

double RingDesign::half_width(double radius) const {
  return std::min(pi * radius / parameters_.crowns, wave_.largest_half_width());
}

double RingDesign::centre_radius(double outer_diameter) const {
  return 0.5 * (outer_diameter - section_.thickness);
}

Drawing RingDesign::drawing(double radius) const {
  return {sag_ * section_.width, std::sqrt(8 * radius * sag_ * section_.thickness)};
}

double RingDesign::span(double left_height, double right_height, double radius_step) const {
  const Connectors& c = parameters_.connectors;
  require(std::abs(radius_step) < c.length,
          "neighbouring rings differ by " + text(std::abs(radius_step)) +
              " mm in radius, more than their connectors of " + text(c.length) + " mm can span");
  const double taut = std::sqrt(c.length * c.length - radius_step * radius_step);
  if (runs_straight(c)) return taut;
  const double given_back =
      c.absorption * ((a_ - b_) * nominal_height_ - (a_ * left_height - b_ * right_height));
  return std::min(c.span + given_back, taut);
}

void RingDesign::derive_limits(const Specification& s) {
  const Connectors& c = parameters_.connectors;
  require(section_.width > 0 && section_.thickness > 0, "struts need a width and a thickness");
  require(s.crimped_diameter > 2 * section_.thickness && s.nominal_diameter > s.crimped_diameter,
          "the nominal diameter must be larger than the crimped one, which must leave a lumen");
  const double widest = parameters_.crowns * wave_.largest_half_width() / pi;
  limits_ = {s.crimped_diameter, s.nominal_diameter, 2 * widest + section_.thickness};
  require_within(limits_, 0.5 * s.nominal_diameter);
  nominal_height_ = wave_.height(half_width(centre_radius(s.nominal_diameter)));

  const double crimped = centre_radius(s.crimped_diameter);
  const double least = std::max(section_.width, wave_.smallest_half_width());
  require(half_width(crimped) >= least,
          std::to_string(parameters_.crowns) + " crowns need a crimped diameter of at least " +
              text(2 * parameters_.crowns * least / pi + section_.thickness) + " mm, it is " +
              text(s.crimped_diameter) + " mm");

  if (runs_straight(c)) return;
  require(std::abs(c.span) <= c.length,
          "connectors of " + text(c.length) + " mm cannot span " + text(c.span) + " mm");
  const double height = wave_.height(half_width(crimped));
  const double tightest = span(height, height, 0);
  require(c.phase == Phase::offset ? -c.length <= tightest : section_.width <= tightest,
          "connectors that span " + text(c.span) + " mm at nominal would span " + text(tightest) +
              " mm crimped; rings would touch");
}

void RingDesign::count_rings(std::optional<double> length) {
  rings_ = parameters_.rings;
  const double step = pitch(limits_.nominal_diameter);
  require(step > 0, "rings would come to lie " + text(step) + " mm after each other");
  if (!length) return;
  rings_ = std::max(
      1, static_cast<int>(std::lround((*length - nominal_height_ - section_.width) / step)) + 1);
}

double RingDesign::ring_length(double outer_diameter) const {
  require_within(limits_, 0.5 * outer_diameter);
  const double d = std::max(outer_diameter, limits_.crimped_diameter);
  return wave_.height(half_width(centre_radius(d)));
}

double RingDesign::pitch(double outer_diameter) const {
  const double h = ring_length(outer_diameter);
  return (a_ - b_) * h + span(h, h, 0);
}

Cell RingDesign::cell() const {
  return parameters_.connectors.count == parameters_.crowns ? Cell::closed : Cell::open;
}

double RingDesign::turn(const Placed& left, const Placed& right, double span) const {
  const Connectors& c = parameters_.connectors;
  if (c.phase != Phase::offset) return 0;
  const auto reached = [&](double angle) {
    return cone_length({left.radius, 0, 0}, {right.radius, angle, span});
  };
  require(reached(0) <= c.length * (1 + 1e-9),
          "connectors of " + text(c.length) + " mm cannot span " + text(reached(0)) + " mm");
  double low = 0, high = 2 * c.length / std::min(left.radius, right.radius);
  for (int i = 0; i < 80; ++i) {
    const double middle = 0.5 * (low + high);
    (reached(middle) <= c.length ? low : high) = middle;
  }
  return low;
}

Member RingDesign::ring_member(const Placed& ring, int index) const {
  const double x = half_width(ring.radius), to_angle = pi / parameters_.crowns / x;
  const auto half = wave_.points(x, chords_, drawing(ring.radius));
  Member member{.kind = Member::Kind::strut, .closed = true, .ring = index, .points = {}};
  for (int crown = 0; crown < 2 * parameters_.crowns; ++crown) {
    const double start = ring.phase + crown * pi / parameters_.crowns;
    const double side = crown % 2 == 0 ? -1 : 1;  // even crowns are distal
    for (std::size_t i = 0; i + 1 < half.size(); ++i) {
      member.points.push_back(
          {ring.drawn_radius, start + to_angle * half[i].x(), ring.z + side * half[i].y()});
    }
  }
  return member;
}

void RingDesign::add_connectors(const std::vector<Placed>& rings, int gap, Pattern& pattern) const {
  const Connectors& c = parameters_.connectors;
  const int crowns = parameters_.crowns;
  const auto left_index = static_cast<std::size_t>(gap);
  const Placed& left = rings[left_index];
  const Placed& right = rings[left_index + 1];
  const double side = gap % 2 == 0 ? 1 : -1;
  const double gap_span = right.z + b_ * right.height - left.z - a_ * left.height;
  const double turned = side * turn(left, right, gap_span);
  const auto crown_of = [&](const Placed& ring, std::size_t index, int crown) {
    const std::vector<PatternPoint>& points = pattern.members[index].points;
    PatternPoint p = points[points.size() / (2 * static_cast<std::size_t>(crowns)) *
                            static_cast<std::size_t>(crown)];
    p.radius = ring.radius;
    return p;
  };
  const int moved = c.shift * (c.alternate ? gap % 2 : gap);
  for (int k = 0; k < c.count; ++k) {
    const int from_crown =
        2 * (((k * crowns / c.count + moved) % crowns + crowns) % crowns) + (a_ < 0 ? 1 : 0);
    const PatternPoint from = crown_of(left, left_index, from_crown);
    const double wanted = from.angle + turned;
    const int steps = static_cast<int>(std::lround((wanted - right.phase) * crowns / pi));
    const int to_crown = (steps % (2 * crowns) + 2 * crowns) % (2 * crowns);
    PatternPoint to = crown_of(right, left_index + 1, to_crown);
    if (to_crown != steps) to.angle += (steps - to_crown) * pi / crowns;
    Member member{.kind = Member::Kind::connector,
                  .closed = false,
                  .ring = gap,
                  .next_ring = gap + 1,
                  .points = link_curve(c.shape, from, to, c.length, kLinkChords)};
    for (std::size_t i = 0; i < member.points.size(); ++i) {
      const double share = static_cast<double>(i) / static_cast<double>(member.points.size() - 1);
      const double left_scale = left.drawn_radius / left.radius;
      const double right_scale = right.drawn_radius / right.radius;
      member.points[i].radius *= left_scale + share * (right_scale - left_scale);
    }
    member.points.front().radius = left.drawn_radius;
    member.points.back().radius = right.drawn_radius;
    pattern.members.push_back(std::move(member));
  }
}

Pattern RingDesign::expanded(const RadiusProfile& outer_radius) const {
  const double step = pitch(limits_.nominal_diameter);
  const double first = 0.5 * (nominal_height_ + section_.width);
  const double nominal_length = 2 * first + (rings_ - 1) * step;
  std::vector<Placed> placed(static_cast<std::size_t>(rings_));
  for (std::size_t i = 0; i < placed.size(); ++i) {
    Placed& ring = placed[i];
    const double outer = outer_radius((first + static_cast<double>(i) * step) / nominal_length);
    require_within(limits_, outer);
    ring.drawn_radius = centre_radius(2 * outer);
    require(ring.drawn_radius > 0, "a diameter of " + text(2 * outer) + " mm leaves no lumen");
    ring.radius = std::max(ring.drawn_radius, centre_radius(limits_.crimped_diameter));
    ring.height = wave_.height(half_width(ring.radius));
    if (i == 0) {
      ring.z = 0.5 * (ring.height + section_.width);
      continue;
    }
    const Placed& left = placed[i - 1];
    const double gap_span = span(left.height, ring.height, ring.radius - left.radius);
    ring.z = left.z + a_ * left.height + gap_span - b_ * ring.height;
    const double turned = (i % 2 == 1 ? 1 : -1) * turn(left, ring, gap_span);
    const double crown_angle = pi / parameters_.crowns;
    const bool mirrored = parameters_.connectors.phase != Phase::in_phase;
    ring.phase = std::fmod(left.phase + turned + (mirrored ? crown_angle : 0), 2 * crown_angle);
  }
  Pattern pattern{.section = section_, .members = {}, .rings = {}, .length = 0};
  for (std::size_t i = 0; i < placed.size(); ++i) {
    pattern.members.push_back(ring_member(placed[i], static_cast<int>(i)));
    pattern.rings.push_back({placed[i].z, placed[i].height, placed[i].drawn_radius});
  }
  for (int gap = 0; gap + 1 < rings_; ++gap) add_connectors(placed, gap, pattern);
  pattern.length = placed.back().z + 0.5 * (placed.back().height + section_.width);
  return pattern;
}

RingParameters rings_of(const ZParameters& z) {
  RingParameters rings;
  rings.crowns = z.crowns;
  rings.rings = z.bodies;
  rings.straight_length = z.straight_length;
  rings.crown_arc = z.crown_arc;
  rings.connectors = {.phase = Phase::in_phase, .count = z.bars, .shift = 0, .length = z.pitch};
  return rings;
}

}  // namespace vstent::stents
