#include "stents/row_shear.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

namespace vstent::stents {
namespace {

constexpr double two_pi = 2 * std::numbers::pi;

}  // namespace

double RowPiece::squared_width(double height) const {
  const double m2 = height * height;
  const auto at = [&](double q, double& slope) {
    double sum = 0;
    slope = 0;
    for (const Step& s : steps) {
      const double d = std::sqrt(q * s.x2 + m2 * s.z2 + s.r2);
      sum += d;
      if (d > 0) slope += 0.5 * s.x2 / d;
    }
    return sum;
  };
  // The square of the length is all but linear in q: exactly so for a straight strut.
  double slope = 0;
  const double flat = at(0, slope);
  if (flat > length) return -1;
  const double one = at(1, slope);
  double q = one > flat ? (length * length - flat * flat) / (one * one - flat * flat) : 1;
  for (int i = 0; i < 30; ++i) {
    const double l = at(q, slope);
    if (slope <= 0) break;
    const double step = (length * length - l * l) / (2 * l * slope);
    q = std::max(q + step, 0.25 * q);
    if (std::abs(step) <= 1e-15 * (1 + q)) break;
  }
  return q;
}

double RowPiece::tallest() const {
  double along = 0;
  for (const Step& s : steps) along += std::sqrt(s.z2);
  if (along == 0) return std::numeric_limits<double>::infinity();
  // From above on a convex, rising function: Newton's steps come down to the root.
  double height = length / along;
  for (int i = 0; i < 50; ++i) {
    double sum = 0, slope = 0;
    for (const Step& s : steps) {
      const double d = std::sqrt(height * height * s.z2 + s.r2);
      sum += d;
      if (d > 0) slope += height * s.z2 / d;
    }
    const double step = (sum - length) / slope;
    height -= step;
    if (std::abs(step) <= 1e-15 * height) break;
  }
  return height;
}

std::optional<RowSolution> solve_row(const RowGeometry& row, const Stretch& stretch) {
  const std::size_t n = row.pieces.size();
  RowSolution solution;
  solution.displacement.assign(n, 0.0);
  solution.heights.assign(n, 1.0);
  std::vector<double> tallest(n), lambda(n), width(n);
  for (std::size_t k = 0; k < n; ++k) tallest[k] = row.pieces[k].tallest();
  const auto bent_height = [&](std::size_t k, double c) {
    return (lambda[k] * (c * row.height + row.links) - row.links) / row.height;
  };
  // Lying flat, struts are widest.
  double flat = -two_pi;
  for (const RowPiece& piece : row.pieces)
    flat += std::sqrt(std::max(piece.squared_width(0), 0.0)) * piece.span;
  // The stretch is taken where the strut comes to lie, so a few rounds.
  for (int round = 0; round < 4; ++round) {
    double highest = std::numeric_limits<double>::infinity();
    for (std::size_t k = 0; k < n; ++k) {
      const double end = k + 1 < n ? solution.displacement[k + 1] : solution.displacement[0];
      lambda[k] = stretch(row.pieces[k].angle + 0.5 * (solution.displacement[k] + end));
      highest = std::min(
          highest, ((tallest[k] * row.height + row.links) / lambda[k] - row.links) / row.height);
    }
    if (!(highest > 0)) return std::nullopt;
    const auto excess = [&](double c) {
      double sum = -two_pi;
      for (std::size_t k = 0; k < n; ++k) {
        const double q = row.pieces[k].squared_width(bent_height(k, c));
        width[k] = std::sqrt(std::max(q, 0.0));
        sum += width[k] * row.pieces[k].span;
      }
      return sum;
    };
    double low = 0, high = highest, at_low = flat, at_high = excess(high);
    if (at_high > 0) return std::nullopt;
    double c = std::min(solution.height, highest);
    for (int i = 0; i < 80; ++i) {
      const double value = excess(c);
      if (std::abs(value) < 1e-11 || high - low < 1e-15) break;
      // Illinois: a bracket end that stays twice counts half.
      if (value > 0) {
        low = c, at_low = value, at_high *= 0.5;
      } else {
        high = c, at_high = value, at_low *= 0.5;
      }
      c = low + (high - low) * at_low / (at_low - at_high);
      if (!(c > low && c < high)) c = 0.5 * (low + high);
    }
    solution.height = c;
    double sum = 0, place = 0;
    for (std::size_t k = 0; k < n; ++k) {
      solution.displacement[k] = place;
      sum += place;
      place += (width[k] - 1) * row.pieces[k].span;
    }
    for (double& d : solution.displacement) d -= sum / static_cast<double>(n);
  }
  for (std::size_t k = 0; k < n; ++k)
    solution.heights[k] = bent_height(k, solution.height) / lambda[k];
  return solution;
}

}  // namespace vstent::stents
