#include "sdf/memory.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "sdf/prepared_solid.hpp"

namespace vstent::sdf {
namespace {

constexpr double kLeafSide = 8, kPageSide = 128;  // nodes; a page is a node above OpenVDB's leaves
constexpr double kLeafBytes = 2300;               // values, mask, allocation; candidates in passing
constexpr double kPageBytes = 132e3;  // where the leaves are, OpenVDB's and the sampler's
constexpr double kPieceBytes = 1500;  // prepared, and listed in the blocks it touches
constexpr double kFixedBytes = 4e6;   // OpenVDB's root and its child, each thread's last slab

/// Cubes of this side (mm) that meet a shell: those whose middle lies within the mean half width of
/// a cube of it, 0.75 sides for random directions.
double volume_of_shell(double length, double radius, double reach, bool has_ends) {
  const double outer = radius + reach;
  const double inner = std::max(0.0, radius - reach);
  double volume = std::numbers::pi * (outer * outer - inner * inner) * length;
  if (has_ends)
    volume += 4.0 / 3.0 * std::numbers::pi * (outer * outer * outer - inner * inner * inner);
  return volume;
}

double cubes_at_band(const Solid& solid, double band, double side) {
  const double reach = band + 0.75 * side;
  double volume = 0;
  Box box;
  const auto add = [&](const auto& piece, double radius, bool continues) {
    volume += volume_of_shell((piece.b - piece.a).norm(), radius, reach, !continues);
    for (const Vec3& end : {piece.a, piece.b}) {
      Box ball;
      ball.include(end);
      ball.pad(radius + band + side);
      box.include(ball);
    }
  };
  for (std::size_t i = 0; i < solid.segments.size(); ++i) {
    const Segment& s = solid.segments[i];
    add(s, 0.5 * (s.radius_a + s.radius_b), i > 0 && solid.segments[i - 1].b == s.a);
  }
  for (std::size_t i = 0; i < solid.struts.size(); ++i) {
    const Strut& s = solid.struts[i];
    add(s, prepare(s).outer_radius(), i > 0 && solid.struts[i - 1].b == s.a);
  }
  return std::min(volume, (box.upper - box.lower).prod()) / (side * side * side);
}

}  // namespace

double estimated_bytes(const Solid& solid, double voxel_size, double half_width) {
  const double band = half_width * voxel_size;
  return kLeafBytes * cubes_at_band(solid, band, kLeafSide * voxel_size) +
         kPageBytes * cubes_at_band(solid, band, kPageSide * voxel_size) +
         kPieceBytes * static_cast<double>(solid.segments.size() + solid.struts.size()) +
         kFixedBytes;
}

double estimated_bytes(double area, double voxel_size, double outside_width, double inside_width) {
  const auto cubes = [&](double side) {
    return area * (outside_width + inside_width + 1.5 * side) / (side * side * side) / voxel_size /
           voxel_size;
  };
  return kLeafBytes * cubes(kLeafSide) + kPageBytes * cubes(kPageSide) + kFixedBytes;
}

}  // namespace vstent::sdf
