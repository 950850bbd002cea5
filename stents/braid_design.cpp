#include "stents/braid_design.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <sstream>
#include <stdexcept>

#include "stents/link_curve.hpp"
#include "stents/newton.hpp"

namespace vstent::stents {
namespace {

constexpr double pi = std::numbers::pi;

/// From one side to the other between crossings: flat for a quarter of the way at each, so that
/// crossing wires part sideways before they change sides.
double weave(double share) {
  if (share <= 0.25) return 1;
  if (share >= 0.75) return -1;
  return std::cos(2 * pi * (share - 0.25));
}

/// Half the spacing of crossings, around and along, that this needs, in wire diameters: beside a
/// crossing of half width X, wires at share u are 2 X u and d weave(u) apart, at least d where
/// X / d >= sin(2 pi (u - 1/4)) / (2 u), which is at most 1.0567 (at u = 0.4427).
constexpr double closest_crossings = 1.0567;

[[noreturn]] void refuse(const std::string& message) { throw std::invalid_argument(message); }

double length_of(const std::vector<PatternPoint>& points) {
  double sum = 0;
  for (std::size_t i = 1; i < points.size(); ++i) sum += cone_length(points[i - 1], points[i]);
  return sum;
}

}  // namespace

bool BraidDesign::runs_over(int way, int row, int wire) const {
  if (over_ == 1) return (row % 2 == 0) == (way > 0);
  const int m = way > 0 ? row + 2 * wire : 2 * wire - row;
  return ((m % 4 + 4) % 4 < 2) == (way > 0);
}

std::vector<PatternPoint> BraidDesign::segment(int way, bool from_over, bool to_over,
                                               const Radius& radius, const RowShape& shape) const {
  std::vector<PatternPoint> points;
  const bool changes = from_over != to_over;
  const double turn = way * pi / wires_ + shape.twist;
  for (const double u : changes ? change_shares_ : stay_shares_) {
    const double side = (from_over ? 1 : -1) * (changes ? weave(u) : 1.0);
    points.push_back({radius(u) + side * amplitude_, u * turn, u * shape.height});
  }
  return points;
}

/// Of the wires that start over and those that start under: outer ones go a longer way around, and
/// every wire is outer as often as inner.
double BraidDesign::mean_length(int way, bool changes, const Radius& radius,
                                const RowShape& shape) const {
  return 0.5 * (length_of(segment(way, true, !changes, radius, shape)) +
                length_of(segment(way, false, changes, radius, shape)));
}

/// The height and twist at which the wires of both ways have their lengths.
BraidDesign::RowShape BraidDesign::row_shape(int row, const Radius& radius, RowShape guess) const {
  const auto excess = [&](const RowShape& shape) {
    Eigen::Vector2d result;
    for (const int way : {1, -1}) {
      const bool changes = runs_over(way, row, 0) != runs_over(way, row + 1, 0);
      result[way > 0 ? 0 : 1] = mean_length(way, changes, radius, shape) - kept_length(changes);
    }
    return result;
  };
  const double scale = change_length_;
  Eigen::Vector2d x(guess.height, guess.twist);
  const double left = solve_two(
      [&](const Eigen::Vector2d& at) {
        return excess({at[0], at[1]});
      },
      x, {1e-6 * scale, 1e-6 * scale / radius(0.5)}, 1e-14 * scale);
  const RowShape shape{std::abs(x[0]), x[1]};
  if (!(left < 1e-9 * scale)) {
    std::ostringstream message;
    message << "the braid's wires are too short for a radius of " << radius(0.5)
            << " mm; its largest outer diameter is " << limits_.largest_diameter << " mm";
    refuse(message.str());
  }
  return shape;
}

BraidDesign::BraidDesign(const BraidParameters& parameters, const Specification& specification,
                         std::optional<double> length_mm)
    : wires_(parameters.wires_per_direction),
      over_(parameters.over),
      wire_(specification.section.thickness),
      section_(specification.section) {
  if (wires_ < 2) refuse("a braid needs at least 2 wires per direction");
  if (over_ != 1 && over_ != 2) refuse("a braid's wires run over 1 or 2 crossings");
  if (over_ == 2 && wires_ % 2 != 0)
    refuse("a braid over 2 crossings needs an even number of wires per direction");
  if (!(parameters.angle > 0 && parameters.angle < 90))
    refuse("the angle of a braid's wires lies between 0 and 90 degrees");
  if (!(parameters.gap >= 0)) refuse("the gap between crossing wires cannot be negative");
  if (!section_.round) refuse("a braid is made of round wires");
  if (!(wire_ > 0)) refuse("a braid needs a wire diameter");
  amplitude_ = 0.5 * (wire_ + parameters.gap);
  const double radius = to_mean(0.5 * specification.nominal_diameter);
  const double crimped = to_mean(0.5 * specification.crimped_diameter);
  const double half_width = pi * radius / wires_;
  nominal_row_ = {half_width / std::tan(parameters.angle * pi / 180), 0};
  const double closest = closest_crossings * wire_;
  const double smallest = closest * wires_ / pi;
  if (crimped < smallest) {
    std::ostringstream message;
    message << wires_ << " wires of " << wire_ << " mm per direction do not fit beside each other"
            << " at the crimped diameter of " << specification.crimped_diameter
            << " mm; the smallest is " << 2 * (smallest + amplitude_) + wire_ << " mm";
    refuse(message.str());
  }
  if (!(radius > crimped) || nominal_row_.height < closest)
    refuse("a braid's nominal diameter lies above its crimped one and below where wires touch");

  // Chords off their arcs by at most `largest_sag` of the wire: of the weave, a cosine of amplitude
  // a over half the segment, a (pi / chords)^2 / 8; of the cylinder, r (turn / chords)^2 / 8.
  const double sag = specification.largest_sag * wire_;
  const int bend = std::max(4, static_cast<int>(std::ceil(pi * std::sqrt(amplitude_ / (8 * sag)))));
  const double largest = std::max(specification.largest_use, specification.nominal_diameter);
  const int around =
      std::max(2, static_cast<int>(std::ceil(pi / wires_ * std::sqrt(0.5 * largest / (8 * sag)))));
  for (int i = 0; i <= around; ++i) stay_shares_.push_back(static_cast<double>(i) / around);
  const int flat = (around + 3) / 4;
  for (int i = 0; i < flat; ++i) change_shares_.push_back(0.25 * i / flat);
  for (int i = 0; i < bend; ++i) change_shares_.push_back(0.25 + 0.5 * i / bend);
  for (int i = 0; i <= flat; ++i) change_shares_.push_back(0.75 + 0.25 * i / flat);
  const Radius nominal = [&](double) { return radius; };
  stay_length_ = mean_length(1, false, nominal, nominal_row_);
  change_length_ = mean_length(1, true, nominal, nominal_row_);

  const double wanted = length_mm.value_or(specification.nominal_length) - wire_;
  const int repeat = over_ == 1 ? 1 : 4;  // rows after which a wire was outer as often as inner
  rows_ = repeat * static_cast<int>(std::lround(wanted / (repeat * nominal_row_.height)));
  if (rows_ < 2) refuse("a braid needs at least 2 rows of crossings: it is too short");

  limits_.crimped_diameter = specification.crimped_diameter;
  limits_.nominal_diameter = specification.nominal_diameter;
  // Where crossings come so close along the axis that wires would run into each other.
  double low = radius, high = std::min(stay_length_, change_length_) * wires_ / pi;
  const auto fits = [&](double r) {
    for (const int row : {0, 1}) {
      const double plain =
          kept_length(row == 0) * kept_length(row == 0) - std::pow(pi * r / wires_, 2);
      if (plain <= 0) return false;
      try {
        if (row_shape(row, [r](double) { return r; }, {std::sqrt(plain), 0}).height < closest)
          return false;
      } catch (const std::invalid_argument&) {
        return false;
      }
    }
    return true;
  };
  for (int i = 0; i < 50; ++i) {
    const double middle = 0.5 * (low + high);
    (fits(middle) ? low : high) = middle;
  }
  limits_.largest_diameter = 2 * (low + amplitude_) + wire_;
}

BraidDesign::Lattice BraidDesign::lattice(double outer_diameter) const {
  const double r = to_mean(0.5 * outer_diameter);
  return {row_shape(
              0, [r](double) { return r; }, nominal_row_)
              .height,
          pi * r / wires_};
}

Pattern BraidDesign::expanded(const RadiusProfile& outer_radius) const {
  const auto m = static_cast<std::size_t>(rows_);
  std::vector<RowShape> shapes(m, nominal_row_);
  std::vector<double> z(m + 1);
  for (std::size_t i = 0; i <= m; ++i)
    z[i] = 0.5 * wire_ + static_cast<double>(i) * nominal_row_.height;
  double length = z.back() + 0.5 * wire_;
  const double crimped = 0.5 * limits_.crimped_diameter;
  const auto radius_in_row = [&](std::size_t i) -> Radius {
    return [&, i](double u) {
      const double share = ((1 - u) * z[i] + u * z[i + 1]) / length;
      const double outer = outer_radius(share);
      require_within(limits_, outer);
      return to_mean(std::max(outer, crimped));
    };
  };
  // Where a row lies decides its radius, and radii where rows lie.
  double change = 1;
  for (int round = 0; round < 100 && change > 1e-13; ++round) {
    std::vector<double> next(1, 0.5 * wire_);
    for (std::size_t i = 0; i < m; ++i) {
      const Radius radius = radius_in_row(i);
      const bool as_two_before = i >= 2 && radius(0) == radius_in_row(i - 2)(0) &&
                                 radius(0) == radius_in_row(i - 2)(1) && radius(1) == radius(0) &&
                                 radius(0.5) == radius(0);
      shapes[i] = as_two_before ? shapes[i - 2] : row_shape(static_cast<int>(i), radius, shapes[i]);
      next.push_back(next.back() + shapes[i].height);
    }
    const double next_length = next.back() + 0.5 * wire_;
    change = 0;
    for (std::size_t i = 0; i <= m; ++i)
      change = std::max(change, std::abs(next[i] / next_length - z[i] / length));
    z = next;
    length = next_length;
  }

  Pattern pattern;
  pattern.section = section_;
  pattern.length = length;
  std::vector<double> twist(1, 0.0);
  for (const RowShape& shape : shapes) twist.push_back(twist.back() + shape.twist);
  for (const int way : {1, -1})
    for (int j = 0; j < wires_; ++j) {
      Member wire;
      wire.kind = Member::Kind::wire;
      for (std::size_t i = 0; i < m; ++i) {
        const int row = static_cast<int>(i);
        // Wire j one way and wire (j + row) mod n the other cross in a row; both have the number
        // of the wire that starts where they do.
        const bool from = runs_over(way, row, j), to = runs_over(way, row + 1, j);
        const Radius radius = radius_in_row(i);
        const double start = way * pi / wires_ * row + 2 * pi * j / wires_ + twist[i];
        std::vector<PatternPoint> points = segment(way, from, to, radius, shapes[i]);
        for (PatternPoint& p : points) {
          const double outer = outer_radius(std::clamp((z[i] + p.z) / length, 0.0, 1.0));
          if (outer < crimped) p.radius *= outer / crimped;
          p.angle += start;
          p.z += z[i];
        }
        wire.points.insert(wire.points.end(), points.begin() + (i == 0 ? 0 : 1), points.end());
      }
      pattern.members.push_back(std::move(wire));
    }
  return pattern;
}

}  // namespace vstent::stents
