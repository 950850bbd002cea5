// Arithmetic on polylines: arc length, interpolation, resampling, smoothing, nearest place.
#pragma once

#include <span>

#include "sdf/geometry.hpp"

namespace vstent {

/// Arc length (mm) at every point, 0 at the first.
std::vector<double> arc_lengths(const Polyline& line);
double length(const Polyline& line);

/// The point at arc length s, clamped to the ends; and the unit tangent of the segment it lies on.
Vec3 point_at(const Polyline& line, std::span<const double> arc_lengths, double s);
Vec3 tangent_at(const Polyline& line, std::span<const double> arc_lengths, double s);
double value_at(std::span<const double> values, std::span<const double> arc_lengths, double s);

/// Unit tangents at the points: the mean direction of the adjoining segments.
std::vector<Vec3> tangents(const Polyline& line);

/// Evenly spaced points from arc length `from` to `to`, both included; the spacing is at most
/// `spacing`.
Polyline resample(const Polyline& line, double from, double to, double spacing);

/// Gaussian smoothing by arc length with standard deviation `width` (mm) of an evenly spaced line;
/// the ends are continued by point reflection, so that they and straight lines stay where they are.
Polyline smooth(const Polyline& line, double width);

/// The same, and once more on what it took away: bends shrink only with the fourth power of width
/// over bend radius.
Polyline smooth_keeping_bends(const Polyline& line, double width);

struct PolylinePlace {
  int segment = 0;
  double arc_length = 0;
  double squared_distance = std::numeric_limits<double>::infinity();
};
/// The nearest place of the line to x, by trying every segment; ties go to the earlier one.
PolylinePlace nearest_place(const Polyline& line, std::span<const double> arc_lengths,
                            const Vec3& x);

}  // namespace vstent
