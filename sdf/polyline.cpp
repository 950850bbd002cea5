#include "sdf/polyline.hpp"

#include <algorithm>
#include <cmath>

namespace vstent {
namespace {

struct Location {
  std::size_t segment;
  double fraction;
};

Location locate(std::span<const double> arc, double s) {
  const auto upper = std::upper_bound(arc.begin() + 1, arc.end() - 1, s);
  const std::size_t segment = static_cast<std::size_t>(upper - arc.begin()) - 1;
  const double span = arc[segment + 1] - arc[segment];
  return {segment, span > 0 ? std::clamp((s - arc[segment]) / span, 0.0, 1.0) : 0.0};
}

/// Gaussian smoothing with a standard deviation of `points` points; ends continued by point
/// reflection.
Polyline gaussian(const Polyline& line, double points) {
  const int n = static_cast<int>(line.size());
  const int reach = std::min(n - 1, static_cast<int>(std::ceil(3 * points)));
  std::vector<double> weights(static_cast<std::size_t>(reach) + 1);
  double total = 0;
  for (int k = 0; k <= reach; ++k) {
    weights[static_cast<std::size_t>(k)] = std::exp(-0.5 * (k / points) * (k / points));
    total += (k == 0 ? 1 : 2) * weights[static_cast<std::size_t>(k)];
  }
  const auto point = [&](int i) -> Vec3 {
    if (i < 0) return 2 * line.front() - line[static_cast<std::size_t>(-i)];
    if (i >= n) return 2 * line.back() - line[static_cast<std::size_t>(2 * (n - 1) - i)];
    return line[static_cast<std::size_t>(i)];
  };
  Polyline result(line.size());
  for (int i = 0; i < n; ++i) {
    Vec3 sum = weights[0] * point(i);
    for (int k = 1; k <= reach; ++k)
      sum += weights[static_cast<std::size_t>(k)] * (point(i - k) + point(i + k));
    result[static_cast<std::size_t>(i)] = sum / total;
  }
  return result;
}

}  // namespace

std::vector<double> arc_lengths(const Polyline& line) {
  std::vector<double> arc(line.size(), 0.0);
  for (std::size_t i = 1; i < line.size(); ++i)
    arc[i] = arc[i - 1] + (line[i] - line[i - 1]).norm();
  return arc;
}

double length(const Polyline& line) { return line.empty() ? 0.0 : arc_lengths(line).back(); }

Vec3 point_at(const Polyline& line, std::span<const double> arc, double s) {
  const Location at = locate(arc, s);
  return line[at.segment] + at.fraction * (line[at.segment + 1] - line[at.segment]);
}

Vec3 tangent_at(const Polyline& line, std::span<const double> arc, double s) {
  const Location at = locate(arc, s);
  return (line[at.segment + 1] - line[at.segment]).normalized();
}

double value_at(std::span<const double> values, std::span<const double> arc, double s) {
  const Location at = locate(arc, s);
  return values[at.segment] + at.fraction * (values[at.segment + 1] - values[at.segment]);
}

std::vector<Vec3> tangents(const Polyline& line) {
  const std::size_t n = line.size();
  std::vector<Vec3> result(n);
  for (std::size_t i = 0; i < n; ++i) {
    Vec3 sum = Vec3::Zero();
    if (i > 0) sum += (line[i] - line[i - 1]).normalized();
    if (i + 1 < n) sum += (line[i + 1] - line[i]).normalized();
    result[i] = sum.normalized();
  }
  return result;
}

Polyline resample(const Polyline& line, double from, double to, double spacing) {
  const std::vector<double> arc = arc_lengths(line);
  const int pieces = std::max(1, static_cast<int>(std::ceil((to - from) / spacing - 1e-9)));
  Polyline result;
  result.reserve(static_cast<std::size_t>(pieces) + 1);
  for (int i = 0; i <= pieces; ++i)
    result.push_back(point_at(line, arc, from + (to - from) * i / pieces));
  return result;
}

Polyline smooth(const Polyline& line, double width) {
  if (line.size() < 3 || width <= 0) return line;
  return gaussian(line, width / (length(line) / static_cast<double>(line.size() - 1)));
}

Polyline smooth_keeping_bends(const Polyline& line, double width) {
  if (line.size() < 3 || width <= 0) return line;
  const double points = width / (length(line) / static_cast<double>(line.size() - 1));
  Polyline result = gaussian(line, points);
  Polyline lost(line.size());
  for (std::size_t i = 0; i < line.size(); ++i) lost[i] = line[i] - result[i];
  const Polyline back = gaussian(lost, points);
  for (std::size_t i = 0; i < line.size(); ++i) result[i] += back[i];
  return result;
}

PolylinePlace nearest_place(const Polyline& line, std::span<const double> arc, const Vec3& x) {
  PolylinePlace best;
  for (std::size_t i = 0; i + 1 < line.size(); ++i) {
    const Vec3 along = line[i + 1] - line[i];
    const double t = std::clamp((x - line[i]).dot(along) / along.squaredNorm(), 0.0, 1.0);
    const double squared = (line[i] + t * along - x).squaredNorm();
    if (squared < best.squared_distance) {
      best = {static_cast<int>(i), arc[i] + t * (arc[i + 1] - arc[i]), squared};
    }
  }
  return best;
}

}  // namespace vstent
