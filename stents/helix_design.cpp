#include "stents/helix_design.hpp"

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

[[noreturn]] void refuse(const std::string& message) { throw std::invalid_argument(message); }

std::size_t index(int i) { return static_cast<std::size_t>(i); }

}  // namespace

std::vector<PatternPoint> HelixDesign::half_wave(const Crown& a, const Crown& b,
                                                 const Radius& radius) const {
  std::vector<PatternPoint> points;
  for (int i = 0; i <= pieces_; ++i) {
    const double t = static_cast<double>(i) / pieces_;
    const double z = a.z + (b.z - a.z) * 0.5 * (1 - std::cos(pi * t));
    points.push_back({radius(z), a.angle + t * (b.angle - a.angle), z});
  }
  return points;
}

double HelixDesign::wave_length(const Crown& a, const Crown& b, const Radius& radius) const {
  double sum = 0;
  const std::vector<PatternPoint> points = half_wave(a, b, radius);
  for (std::size_t i = 1; i < points.size(); ++i) sum += cone_length(points[i - 1], points[i]);
  return sum;
}

/// The crown between two others from which half waves of these lengths reach them; `guess` is its
/// height above their mean.
HelixDesign::Crown HelixDesign::between(const Crown& a, const Crown& b, double length_a,
                                        double length_b, double guess, const Radius& radius) const {
  Eigen::Vector2d x(0.5 * (a.angle + b.angle), 0.5 * (a.z + b.z) + guess);
  const auto excess = [&](const Eigen::Vector2d& at) {
    const Crown crown{at[0], at[1]};
    return Eigen::Vector2d(wave_length(a, crown, radius) - length_a,
                           wave_length(crown, b, radius) - length_b);
  };
  const double scale = length_a + length_b;
  const double difference = 1e-6 * scale;
  const double left = solve_two(excess, x, {difference / radius(a.z), difference}, 1e-13 * scale);
  // Waves that lie flat are no waves any more.
  const double up = guess > 0 ? 1 : -1;
  const double height = std::min(up * (x[1] - a.z), up * (x[1] - b.z));
  if (!(left < 1e-10 * scale) || height < 0.5 * section_.width) {
    std::ostringstream message;
    message << "waves of the helix are too short for a radius of " << radius(a.z)
            << " mm; its largest outer diameter is " << limits_.largest_diameter << " mm";
    refuse(message.str());
  }
  return {x[0], x[1]};
}

/// Facing crowns decide the units of a turn; else they are as given.
double HelixDesign::unit_angle(double skew) const {
  return 2 * pi /
         (facing_ ? parameters_.strands * (reach_ - 0.5 * skew) : parameters_.units_per_turn);
}

double HelixDesign::gap(double radius, double skew) const {
  if (parameters_.joint != Link::straight) return joint_gap_;
  if (facing_) return joint_length_;
  const double aside =
      radius * (unit_angle(skew) * (reach_ - 0.5 * skew) - 2 * pi / parameters_.strands);
  return std::sqrt(std::max(0.0, joint_length_ * joint_length_ - aside * aside));
}

HelixDesign::Winding HelixDesign::winding_at(double r) const {
  const Radius radius = [r](double) { return r; };
  const double strut = parameters_.strut_length;
  const double half_width = 0.5 * r * unit_angle(0);
  Winding result;
  const auto at = [&](const Eigen::Vector2d& x) {
    Winding w;
    w.advance = x[0];
    w.skew = x[1];
    w.unit_angle = unit_angle(w.skew);
    w.height = w.advance * reach_ - gap(r, w.skew);
    return w;
  };
  const auto excess = [&](const Eigen::Vector2d& x) {
    const Winding w = at(x);
    const Crown valley{0, 0};
    const Crown rising{0.5 * (1 + w.skew) * w.unit_angle, w.height + 0.5 * w.advance};
    const Crown falling{0.5 * (1 - w.skew) * w.unit_angle, w.height - 0.5 * w.advance};
    return Eigen::Vector2d(wave_length(valley, rising, radius) - rising_,
                           wave_length(valley, falling, radius) - falling_);
  };
  if (half_width >= strut) refuse("waves of the helix are too short");
  const double height = std::sqrt(strut * strut - half_width * half_width);
  Eigen::Vector2d x((0.95 * height + gap(r, 0)) / reach_, 0);
  const double left = solve_two(excess, x, {1e-6 * strut, 1e-6}, 1e-14 * strut);
  result = at(x);
  if (!(left < 1e-10 * strut) || !(result.height > 0.5 * result.advance + section_.width) ||
      std::abs(result.skew) >= 1)
    refuse("waves of the helix are too short");
  return result;
}

HelixDesign::Winding HelixDesign::winding(double outer_diameter) const {
  return winding_at(centre(0.5 * outer_diameter));
}

/// Peaks and valleys in turn, from peak first_peak_ on. Flattened valleys hang between the peaks
/// around them, flattened peaks stand between valleys.
std::vector<HelixDesign::Crown> HelixDesign::crowns(const Radius& radius) const {
  std::vector<Crown> peaks, valleys;
  std::vector<Winding> windings;
  for (int j = first_peak_; j <= last_valley_ + 1; ++j) {
    Crown peak;
    double r = 0;
    if (peaks.empty()) {
      r = radius(0);
    } else {
      r = radius(peaks.back().z + windings.back().advance);
    }
    const bool as_before = !windings.empty() && r == radius(peaks.back().z);
    windings.push_back(as_before ? windings.back() : winding_at(r));
    if (!peaks.empty()) {
      const Winding &a = windings[windings.size() - 2], &b = windings.back();
      peak.angle = peaks.back().angle + 0.5 * (a.unit_angle + b.unit_angle);
      peak.z = peaks.back().z + 0.5 * (a.advance + b.advance);
    } else {
      peak.angle = windings.back().unit_angle * first_peak_;
    }
    peaks.push_back(peak);
  }
  for (int v = first_peak_; v <= last_valley_; ++v) {
    const std::size_t i = index(v - first_peak_);
    const bool flattened = i < valley_struts_.size();
    const auto [falling, rising] = flattened ? valley_struts_[i] : std::pair(falling_, rising_);
    const double half = 0.5 * (peaks[i + 1].angle - peaks[i].angle) * radius(peaks[i].z);
    const double height =
        std::sqrt(std::max(0.01 * falling * falling, falling * falling - half * half));
    valleys.push_back(between(peaks[i], peaks[i + 1], falling, rising, -height, radius));
  }
  for (std::size_t k = 0; k < peak_struts_.size(); ++k) {
    const std::size_t i = index(last_peak_ - first_peak_) + 1 + k;
    const auto [rising, falling] = peak_struts_[k];
    const double half = 0.5 * (valleys[i].angle - valleys[i - 1].angle) * radius(peaks[i].z);
    const double height =
        std::sqrt(std::max(0.01 * rising * rising, rising * rising - half * half));
    peaks[i] = between(valleys[i - 1], valleys[i], rising, falling, height, radius);
  }
  std::vector<Crown> result;
  for (std::size_t i = 0; i < valleys.size(); ++i) {
    result.push_back(peaks[i]);
    result.push_back(valleys[i]);
  }
  return result;
}

HelixDesign::HelixDesign(const HelixParameters& parameters, const Specification& specification,
                         std::optional<double> length_mm)
    : parameters_(parameters), section_(specification.section) {
  const double strut = parameters.strut_length, width = section_.width;
  if (parameters.strands < 1) refuse("a helix needs at least one strand");
  if (!(parameters.units_per_turn >= 2 * parameters.strands))
    refuse("a helix needs at least 2 units from turn to turn");
  if (!(strut > 0 && parameters.pitch > 0 && width > 0 && section_.thickness > 0))
    refuse("a helix needs a strut length, a pitch, and a wire with a width and a thickness");
  if (parameters.join_every < 0 || parameters.joint_length < 0 || parameters.end_ring < 0)
    refuse("a helix's joints and end ring cannot be negative");
  const double between_turns = parameters.units_per_turn / parameters.strands;
  reach_ = std::ceil(between_turns - 1 - 1e-9) + 0.5;
  facing_ = std::abs(reach_ - between_turns) < 1e-9;
  const double nominal = centre(0.5 * specification.nominal_diameter);
  const double crimped = centre(0.5 * specification.crimped_diameter);
  if (!(crimped > 0 && nominal > crimped))
    refuse("a helix's nominal diameter lies above its crimped");
  if (pi * crimped / parameters.units_per_turn < width) {
    std::ostringstream message;
    message << "crimped, struts of the helix would be " << pi * crimped / parameters.units_per_turn
            << " mm apart, less than their width of " << width << " mm; the smallest diameter is "
            << 2 * width * parameters.units_per_turn / pi + section_.thickness << " mm";
    refuse(message.str());
  }
  // A cosine of height h is off its chords by pi^2 h / (16 n^2) at its crowns.
  pieces_ = std::max(8, static_cast<int>(std::ceil(
                            pi * std::sqrt(strut / (16 * specification.largest_sag * width)))));
  limits_.crimped_diameter = specification.crimped_diameter;
  limits_.nominal_diameter = specification.nominal_diameter;

  // At nominal the pitch is given, and leaves the gap.
  const Radius uniform = [nominal](double) { return nominal; };
  const double half_width = pi * nominal / parameters.units_per_turn;
  if (half_width >= strut) {
    std::ostringstream message;
    message << "waves of the helix are straight at an outer diameter of "
            << 2 * strut * parameters.units_per_turn / pi + section_.thickness
            << " mm, below the nominal one";
    refuse(message.str());
  }
  Winding winding;
  winding.advance = parameters.pitch / parameters.units_per_turn;
  balance_struts(nominal, crimped, winding);
  winding.unit_angle = unit_angle(winding.skew);
  joint_gap_ = winding.advance * reach_ - winding.height;
  const double least_pitch = winding.height / reach_ * parameters.units_per_turn;
  // Fused crowns lie a hundredth of the width apart, which makes each weld a piece of its own.
  const double weld = 0.01 * width;
  if (joint_gap_ > -weld && joint_gap_ < weld) joint_gap_ = weld;
  if (joint_gap_ < 0) {
    std::ostringstream message;
    message << "a pitch of " << parameters.pitch << " mm makes crowns of neighbouring turns pass "
            << "each other at nominal; they meet at " << least_pitch << " mm";
    refuse(message.str());
  }
  const double aside = facing_ ? 0
                               : nominal * (winding.unit_angle * (reach_ - 0.5 * winding.skew) -
                                            2 * pi / parameters.strands);
  const double distance = std::hypot(aside, joint_gap_);
  joint_length_ = parameters.joint_length > 0 ? parameters.joint_length : distance;
  if (parameters.joint == Link::straight ? std::abs(joint_length_ - distance) > 0.01 * distance
                                         : joint_length_ < distance) {
    std::ostringstream message;
    message << "joints of " << joint_length_ << " mm do not fit the " << distance
            << " mm that the pitch leaves between crowns";
    refuse(message.str());
  }
  if (parameters.joint == Link::straight) joint_length_ = distance;

  const double own = specification.nominal_length > 0
                         ? specification.nominal_length
                         : parameters.units * winding.advance + winding.height + width;
  const double length = length_mm.value_or(own) - width - winding.height;
  if (parameters.end_ring > 0) {
    if (parameters.end_ring > winding.height)
      refuse("the end ring of a helix cannot be higher than its waves");
    first_peak_ =
        static_cast<int>(std::ceil((parameters.end_ring + joint_gap_) / winding.advance - 1e-9));
    last_peak_ = static_cast<int>(std::lround(length / winding.advance + reach_));
    last_valley_ = static_cast<int>(std::floor(
        last_peak_ + (winding.height - parameters.end_ring) / winding.advance - 0.5 + 1e-9));
  } else {
    last_peak_ = last_valley_ = static_cast<int>(std::lround(length / winding.advance + 0.5));
  }
  if (last_peak_ - first_peak_ < between_turns)
    refuse("a helix needs at least one turn from joint to joint: it is too short");
  if (parameters.end_ring > 0) {
    const auto peak = [&](int j) { return Crown{j * winding.unit_angle, j * winding.advance}; };
    const double floor = reach_ * winding.advance - winding.height;
    for (int v = first_peak_; v + 0.5 < reach_; ++v) {
      const Crown valley{(v + 0.5) * winding.unit_angle, floor};
      valley_struts_.emplace_back(wave_length(peak(v), valley, uniform),
                                  wave_length(valley, peak(v + 1), uniform));
    }
    const auto valley = [&](int v) {
      return Crown{(v + 0.5 - 0.5 * winding.skew) * winding.unit_angle,
                   (v + 0.5) * winding.advance - winding.height};
    };
    for (int j = last_peak_ + 1; j <= last_valley_; ++j) {
      const Crown flat{(j - 0.5 * winding.skew) * winding.unit_angle, last_peak_ * winding.advance};
      peak_struts_.emplace_back(wave_length(valley(j - 1), flat, uniform),
                                wave_length(flat, valley(j), uniform));
    }
  }
  double low = nominal, high = strut * parameters.units_per_turn / pi;
  const auto fits = [&](double r) {
    try {
      const Winding w = winding_at(r);
      if (parameters_.joint != Link::straight) {
        const double turned = w.unit_angle * (reach_ - 0.5 * w.skew) - 2 * pi / parameters_.strands;
        if (joint_length_ < std::hypot(r * turned, joint_gap_)) return false;
      } else if (!facing_ && gap(r, w.skew) <= 0 && joint_length_ > 0) {
        return false;
      }
      crowns([r](double) { return r; });
      return true;
    } catch (const std::invalid_argument&) {
      return false;
    }
  };
  for (const double r : {nominal, crimped})
    if (!fits(r)) {
      std::ostringstream message;
      message << "the helix cannot keep its lengths at an outer diameter of "
              << 2 * r + section_.thickness << " mm";
      refuse(message.str());
    }
  for (int i = 0; i < 40; ++i) {
    const double middle = 0.5 * (low + high);
    (fits(middle) ? low : high) = middle;
  }
  limits_.largest_diameter = 2 * low + section_.thickness;
}

/// Crimped, rising and falling half waves are equally wide: the rising ones are the longer ones. Of
/// the winding at nominal, whose advance is given, finds the height and skew.
void HelixDesign::balance_struts(double nominal, double crimped, Winding& winding) {
  const double strut = parameters_.strut_length;
  const auto rise_and_fall = [&](double r, double height, double advance, double skew) {
    const Radius radius = [r](double) { return r; };
    const double half = 0.5 * unit_angle(skew);
    return Eigen::Vector2d(
        wave_length({0, 0}, {(1 + skew) * half, height + 0.5 * advance}, radius),
        wave_length({0, 0}, {(1 - skew) * half, height - 0.5 * advance}, radius));
  };
  const double half_width = 0.5 * nominal * unit_angle(0);
  Eigen::Vector2d x(0.95 * std::sqrt(strut * strut - half_width * half_width), 0);
  rising_ = falling_ = strut;
  double change = 1;
  for (int round = 0; round < 200 && change > 1e-13 * strut; ++round) {
    const double left = solve_two(
        [&](const Eigen::Vector2d& at) -> Eigen::Vector2d {
          return rise_and_fall(nominal, at[0], winding.advance, at[1]) -
                 Eigen::Vector2d(rising_, falling_);
        },
        x, {1e-6 * strut, 1e-6}, 1e-14 * strut);
    if (!(left < 1e-10 * strut)) refuse("the pitch of the helix is too long for its waves");
    const double gap = winding.advance * reach_ - x[0];
    // Rises with the height, which lies between none and the strut's length.
    double low = 0, high = strut;
    for (int i = 0; i < 100 && high - low > 1e-15 * strut; ++i) {
      const double height = 0.5 * (low + high);
      const double mean = 0.5 * rise_and_fall(crimped, height, (height + gap) / reach_, 0).sum();
      (mean < strut ? low : high) = height;
    }
    const Eigen::Vector2d lengths = rise_and_fall(crimped, low, (low + gap) / reach_, 0);
    const double difference = 0.5 * (lengths[0] - lengths[1]);
    change = std::abs(strut + difference - rising_);
    rising_ = strut + difference;
    falling_ = strut - difference;
  }
  winding.height = x[0];
  winding.skew = x[1];
}

void HelixDesign::add_joints(const std::vector<Crown>& all, const std::vector<int>& places,
                             const Radius& radius, Pattern& pattern) const {
  const int strands = parameters_.strands;
  for (const int strand : places)
    for (int j = first_peak_; j + reach_ < last_valley_ + 1; j += parameters_.join_every) {
      const auto valley_number = static_cast<int>(j + reach_ - 0.5);
      const Crown& peak = all[index(2 * (j - first_peak_))];
      const Crown& valley = all[index(2 * (valley_number - first_peak_) + 1)];
      // The turn beyond belongs to the strand before, which starts that much earlier around.
      const double start = 2 * pi * strand / strands;
      const PatternPoint from{radius(peak.z), peak.angle + start, peak.z};
      const PatternPoint to{radius(valley.z), valley.angle + start - 2 * pi / strands, valley.z};
      const double distance = cone_length(from, to);
      Member joint;
      joint.kind = Member::Kind::connector;
      joint.points = link_curve(parameters_.joint, from, to, std::max(joint_length_, distance),
                                parameters_.joint == Link::straight ? 4 : 24);
      pattern.members.push_back(joint);
    }
}

Pattern HelixDesign::expanded(const RadiusProfile& outer_radius) const {
  const double smallest = 0.5 * limits_.crimped_diameter;
  double origin = 0, length = 0;  // of the metal, in the crowns' z
  const auto share = [&](double z) {
    return length > 0 ? std::clamp((z - origin) / length, 0.0, 1.0) : 0.5;
  };
  const Radius radius = [&](double z) {
    const double outer = outer_radius(share(z));
    require_within(limits_, outer);
    return centre(std::max(outer, smallest));
  };
  std::vector<Crown> all;
  // Where crowns lie decides their radius, and radii where they lie.
  double change = 1;
  for (int round = 0; round < 60 && change > 1e-12; ++round) {
    all = crowns(radius);
    double low = all[0].z, high = low;
    for (const Crown& crown : all) low = std::min(low, crown.z), high = std::max(high, crown.z);
    const double new_origin = low - 0.5 * section_.width;
    const double new_length = high - low + section_.width;
    change = std::abs(new_origin - origin) + std::abs(new_length - length);
    origin = new_origin;
    length = new_length;
  }
  Pattern pattern;
  pattern.section = section_;
  pattern.length = length;
  std::vector<int> strands;
  for (int s = 0; s < parameters_.strands; ++s) {
    strands.push_back(s);
    Member wire;
    wire.kind = Member::Kind::wire;
    for (std::size_t i = 1; i < all.size(); ++i) {
      std::vector<PatternPoint> points = half_wave(all[i - 1], all[i], radius);
      wire.points.insert(wire.points.end(), points.begin() + (i == 1 ? 0 : 1), points.end());
    }
    for (PatternPoint& p : wire.points) p.angle += 2 * pi * s / parameters_.strands;
    pattern.members.push_back(std::move(wire));
  }
  if (parameters_.join_every > 0) add_joints(all, strands, radius, pattern);
  for (Member& member : pattern.members)
    for (PatternPoint& p : member.points) {
      const double outer = outer_radius(share(p.z));
      if (outer < smallest) p.radius *= outer / smallest;
      p.z -= origin;
    }
  return pattern;
}

}  // namespace vstent::stents
