#include "stents/ring_wave.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <stdexcept>

namespace vstent::stents {
namespace {

using Eigen::Vector2d;
using std::numbers::pi;

constexpr double kWidestOpening = pi / 2 + 0.6;  // arms that lean 34 deg over each other

double sine_over(double t) { return t == 0 ? 1 : std::sin(t) / t; }
double one_minus_cosine_over(double t) { return std::sin(t / 2) * sine_over(t / 2); }

/// The root of a falling function between `low` and `high`, to the last bit.
template <class Function>
double root_of_falling(const Function& f, double low, double high) {
  while (true) {
    const double middle = low + 0.5 * (high - low);
    if (middle <= low || middle >= high) return middle;
    (f(middle) > 0 ? low : high) = middle;
  }
}

int pieces(double length, double longest) {
  return length > 0 ? std::max(1, static_cast<int>(std::ceil(length / longest - 1e-9))) : 0;
}

/// A sinusoid between its tip (u = 0) and its middle (u = pi/2).
struct QuarterWave {
  double half_width, steepness;

  double length_rate(double u) const {
    return half_width / pi * std::hypot(1, steepness * std::sin(u));
  }
  double curvature(double u) const {
    return pi * steepness * std::cos(u) / half_width /
           std::pow(1 + std::pow(steepness * std::sin(u), 2), 1.5);
  }

  /// Number of chords from the tip up to evenly spaced u.
  static constexpr int kSteps = 512;
  std::array<double, kSteps + 1> chords_up_to(const Drawing& drawing) const {
    std::array<double, kSteps + 1> sum{};
    const double du = pi / 2 / kSteps;
    for (int i = 0; i < kSteps; ++i) {
      const double u = (i + 0.5) * du;
      const double bend = std::sqrt(curvature(u) / (8 * drawing.sag)) * length_rate(u);
      sum[static_cast<std::size_t>(i) + 1] =
          sum[static_cast<std::size_t>(i)] + du * (bend + half_width / pi / drawing.step);
    }
    return sum;
  }
};

}  // namespace

Chords finer(const Chords& a, const Chords& b) {
  return {std::max(a.bend, b.bend), std::max(a.straight, b.straight)};
}

RingWave::RingWave(const RingParameters& p) {
  const auto require = [](bool holds, const char* what) {
    if (!holds) throw std::invalid_argument(what);
  };
  if (p.wave == Wave::sinusoid) {
    require(p.strut_length > 0, "a sinusoidal ring needs a positive strut length");
    sinusoid_ = p.strut_length;
  } else {
    require(p.straight_length >= 0 && p.crown_arc >= 0 && p.straight_length + p.crown_arc > 0,
            "a zig-zag ring needs a positive straight length or crown arc, and no negative one");
    straight_ = p.straight_length;
    crown_ = p.crown_arc;
  }
}

double RingWave::smallest_half_width() const {
  if (sinusoid_ > 0 || crown_ == 0) return 0;
  return std::max(0.0,
                  straight_ * std::cos(kWidestOpening) + 2 * crown_ * sine_over(kWidestOpening));
}

double RingWave::opening(double half_width) const {
  return root_of_falling(
      [&](double t) { return straight_ * std::cos(t) + 2 * crown_ * sine_over(t) - half_width; },
      0.0, crown_ == 0 ? pi / 2 : kWidestOpening);
}

double RingWave::steepness(double half_width) const {
  const auto missing = [&](double m) {
    const double root = std::hypot(1, m);
    return sinusoid_ - 2 * half_width / pi * root * std::comp_ellint_2(m / root);
  };
  return root_of_falling(missing, 0.0, pi * sinusoid_ / (2 * half_width));
}

double RingWave::height(double half_width) const {
  if (sinusoid_ > 0) return 2 * half_width / pi * steepness(half_width);
  const double t = opening(half_width);
  return straight_ * std::sin(t) + 2 * crown_ * one_minus_cosine_over(t);
}

double RingWave::crown_radius(double half_width) const {
  if (sinusoid_ > 0) return half_width / (pi * steepness(half_width));
  return crown_ / opening(half_width);
}

Chords RingWave::chords(double half_width, const Drawing& drawing) const {
  if (sinusoid_ > 0) {
    const QuarterWave wave{half_width, steepness(half_width)};
    return {std::max(2, static_cast<int>(std::ceil(wave.chords_up_to(drawing).back()))), 0};
  }
  const double t = opening(half_width);
  const double radius = crown_ / t;
  const double longest =
      std::min({std::sqrt(8 * radius * drawing.sag), 0.5 * radius, drawing.step});
  return {pieces(crown_, longest), pieces(straight_ * std::abs(std::cos(t)), drawing.step)};
}

std::vector<Vector2d> RingWave::points(double half_width, const Chords& chords,
                                       const Drawing& drawing) const {
  std::vector<Vector2d> line;  // up to the middle; the other half is its point reflection
  const double h = height(half_width);
  if (sinusoid_ > 0) {
    const QuarterWave wave{half_width, steepness(half_width)};
    const auto sum = wave.chords_up_to(drawing);
    for (int i = 0; i <= chords.bend; ++i) {
      const double wanted = sum.back() * i / chords.bend;
      const auto above = std::upper_bound(sum.begin() + 1, sum.end() - 1, wanted);
      const auto step = static_cast<double>(above - sum.begin());
      const double share = (wanted - *(above - 1)) / (*above - *(above - 1));
      const double u = i == chords.bend ? pi / 2 : (step - 1 + share) * pi / 2 / wave.kSteps;
      line.emplace_back(half_width * u / pi, -0.5 * h * std::cos(u));
    }
    line.back() = {0.5 * half_width, 0};
  } else {
    const double t = opening(half_width);
    for (int i = 0; i <= chords.bend; ++i) {
      const double arc = chords.bend == 0 ? 0 : crown_ * i / chords.bend;
      const double turned = chords.bend == 0 ? 0 : t * i / chords.bend;
      line.emplace_back(arc * sine_over(turned), -0.5 * h + arc * one_minus_cosine_over(turned));
    }
    const Vector2d start = line.back(), end = Vector2d(half_width, 0) - start;
    for (int i = 1; i <= chords.straight / 2; ++i) {
      line.push_back(start + (end - start) * i / chords.straight);
    }
    if (chords.straight % 2 == 0 && chords.straight > 0) line.back() = {0.5 * half_width, 0};
  }
  const bool meets_in_the_middle = sinusoid_ > 0 || chords.straight % 2 == 0;
  for (std::size_t i = line.size() - (meets_in_the_middle ? 1 : 0); i-- > 0;) {
    line.push_back(Vector2d(half_width, 0) - line[i]);
  }
  return line;
}

}  // namespace vstent::stents
