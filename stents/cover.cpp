#include "stents/cover.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <stdexcept>
#include <string>

#include "stents/axis.hpp"

namespace vstent::stents {
namespace {

constexpr int kSides = 64;

/// A tube's wall between two offsets (mm) from the outer radii.
void add_shell(TriangleMesh& mesh, const Polyline& axis, std::span<const Frame> frames,
               std::span<const double> radii, double inner, double outer) {
  const int first = static_cast<int>(mesh.points.size());
  const int rows = static_cast<int>(axis.size());
  for (std::size_t i = 0; i < axis.size(); ++i) {
    for (const double offset : {inner, outer}) {
      for (int k = 0; k < kSides; ++k) {
        const double angle = 2 * std::numbers::pi * k / kSides;
        const Vec3 out =
            std::cos(angle) * frames[i].normal + std::sin(angle) * frames[i].binormal();
        mesh.points.push_back(axis[i] + (radii[i] + offset) * out);
      }
    }
  }
  const auto corner = [&](int row, int side, int k) {
    return first + (2 * row + side) * kSides + k % kSides;
  };
  const auto quad = [&](int a, int b, int c, int d) {
    mesh.triangles.push_back({a, b, c});
    mesh.triangles.push_back({a, c, d});
  };
  for (int k = 0; k < kSides; ++k) {
    for (int row = 0; row + 1 < rows; ++row) {
      quad(corner(row, 1, k), corner(row, 1, k + 1), corner(row + 1, 1, k + 1),
           corner(row + 1, 1, k));
      quad(corner(row, 0, k), corner(row + 1, 0, k), corner(row + 1, 0, k + 1),
           corner(row, 0, k + 1));
    }
    quad(corner(0, 0, k), corner(0, 0, k + 1), corner(0, 1, k + 1), corner(0, 1, k));
    quad(corner(rows - 1, 1, k), corner(rows - 1, 1, k + 1), corner(rows - 1, 0, k + 1),
         corner(rows - 1, 0, k));
  }
}

}  // namespace

bool covered(const Cover& cover) { return cover.inner > 0 || cover.outer > 0; }

TriangleMesh cover_surface(const Cover& cover, const Polyline& axis,
                           std::span<const double> outer_radii, double strut_thickness) {
  TriangleMesh mesh;
  if (!covered(cover)) return mesh;
  const std::vector<Frame> frames = rotation_minimising_frames(axis);
  const double smallest = *std::min_element(outer_radii.begin(), outer_radii.end());
  if (cover.inner > 0 && smallest <= strut_thickness + cover.inner) {
    throw std::invalid_argument("an inner sleeve of " + std::to_string(cover.inner) +
                                " mm fills the stent of outer radius " + std::to_string(smallest) +
                                " mm");
  }
  if (cover.outer > 0) add_shell(mesh, axis, frames, outer_radii, 0, cover.outer);
  if (cover.inner > 0)
    add_shell(mesh, axis, frames, outer_radii, -strut_thickness - cover.inner, -strut_thickness);
  return mesh;
}

}  // namespace vstent::stents
