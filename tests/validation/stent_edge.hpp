// A long thin tube beside the end of a slightly wider rigid cylinder: thin-shell theory in closed
// form.
#pragma once

#include <cmath>
#include <vector>

#include "tests/xpbd/shapes.hpp"
#include "xpbd/equilibrium.hpp"

namespace vstent::tests {

/// Radial displacement beside the end over the cylinder's oversize, at q = beta s.
inline double beside_the_end(double q) {
  return std::exp(-q) * (std::cos(q) + 0.717102 * std::sin(q));
}

struct StentEdge {
  double beta = 0;      // 1/mm
  double oversize = 0;  // mm, over the narrowed tube
  struct Ring {
    double s = 0, w = 0;  // mm from the end, mm outwards of the narrowed tube
  };
  std::vector<Ring> rings;
};

/// On a neo-Hookean sheet of radius 5 mm and thickness 1 mm, widened by a hundredth.
inline StentEdge widen_beside_a_stent(double edge) {
  constexpr double kRadius = 5, kThickness = 1, kNu = 0.45, kOversize = 0.05;
  const Mesh mesh = make_tube({.radius = kRadius, .length = 56, .edge = edge});
  const xpbd::Sheet sheet =
      xpbd::make_sheet(mesh.points, mesh.triangles, mesh.pinned,
                       xpbd::Membrane{.thickness = kThickness,
                                      .poisson_ratio = kNu,
                                      .model = xpbd::MembraneModel::neo_hookean});
  const double spacing = (mesh.points[0] - mesh.points[1]).norm() * std::sqrt(3.0) / 2;
  // The last row that touches lies at the end.
  const double end = spacing * std::floor(8 / spacing), reach = end + 0.5 * spacing;
  xpbd::Equilibrium equilibrium(
      sheet, mesh.points, [&](std::span<const Vec3> places, std::span<xpbd::Gap> gaps) {
        for (std::size_t i = 0; i < places.size(); ++i) {
          const Vec3& p = places[i];
          const double rho = distance_from_axis(p);
          const double beyond = std::abs(p.z()) - reach;
          gaps[i] = beyond > 0
                        ? xpbd::Gap{beyond, Vec3::Zero()}
                        : xpbd::Gap{rho - kRadius - kOversize, Vec3(p.x() / rho, p.y() / rho, 0)};
        }
      });
  for (int i = 0; i < 2000 && equilibrium.balance().relative > 1e-5; ++i) equilibrium.iterate({});

  StentEdge result{
      std::pow(3 * (1 - kNu * kNu), 0.25) / std::sqrt(kRadius * kThickness), kOversize, {}};
  // Clamped ends resist the stented part's axial pull: the whole tube narrows by nu^2 / (1 - nu^2)
  // of its mean, and what decays is the displacement beyond that.
  double mean = 0;
  for (const Vec3& p : equilibrium.positions()) mean += distance_from_axis(p) - kRadius;
  mean /= static_cast<double>(mesh.points.size());
  const double narrowed = kNu * kNu / (1 - kNu * kNu) * mean;
  result.oversize += narrowed;
  const auto around = static_cast<std::size_t>(std::lround(2 * std::numbers::pi * kRadius / edge));
  for (std::size_t i = 0; i < mesh.points.size(); i += around)
    if (const double s = mesh.points[i].z() - end; s > -1e-9 && result.beta * s < 5)
      result.rings.push_back(
          {s, (distance_from_axis(equilibrium.positions()[i]) - kRadius + narrowed)});
  return result;
}

}  // namespace vstent::tests
