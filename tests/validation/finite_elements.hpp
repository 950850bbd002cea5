// The set-up that finite elements (CalculiX 2.20, solid, axisymmetric) solved: a tube of 40 mm,
// radius 5 mm and wall 0.5 mm with a cosine stenosis of 24 mm, clamped at both ends, widened by a
// rigid cylinder of 16 mm with an edge of 0.25 mm radius, without friction.
#pragma once

#include <filesystem>
#include <fstream>
#include <sstream>
#include <string>

#include "tests/xpbd/shapes.hpp"
#include "xpbd/equilibrium.hpp"

namespace vstent::tests {

struct FiniteElementCase {
  std::string file;      // of ../shared/reference/fem, without extension
  double narrowing = 0;  // of the diameter
  double poisson_ratio = 0.45;
  double radius = 5;  // of the cylinder at the end, mm
};

inline const FiniteElementCase kFiniteElementCases[] = {
    {"ccx_B1_nh_sev60_L12", 0.6, 0.45, 5},
    {"ccx_B3_nh_sev30_L12", 0.3, 0.45, 5},
    {"ccx_B5_nh_sev60_L12_nu33", 0.6, 1.0 / 3, 5},
    {"ccx_S1_lin_straight_1pc", 0, 0.45, 5.05},
};

/// The lumen's line along one half of the tube, at rest and widened; mm.
struct LumenPoint {
  double rest_z, rest_radius, z, radius;
};

inline std::vector<LumenPoint> read_lumen(const std::filesystem::path& file) {
  std::ifstream in(file);
  std::vector<LumenPoint> lumen;
  std::string line;
  std::getline(in, line);
  while (std::getline(in, line)) {
    std::istringstream row(line);
    LumenPoint p{};
    char comma;
    if (row >> p.rest_z >> comma >> p.rest_radius >> comma >> p.z >> comma >> p.radius)
      lumen.push_back(p);
  }
  return lumen;
}

/// `value` over `place` at `at`, linear between the points.
template <class Place, class Value>
double interpolated(const std::vector<LumenPoint>& lumen, double at, const Place& place,
                    const Value& value) {
  std::size_t k = 1;
  while (k + 1 < lumen.size() && place(lumen[k]) < at) ++k;
  const double share = (at - place(lumen[k - 1])) / (place(lumen[k]) - place(lumen[k - 1]));
  return value(lumen[k - 1]) + share * (value(lumen[k]) - value(lumen[k - 1]));
}

struct WidenedTube {
  Mesh mesh;
  std::vector<Vec3> places;
  double residual = 0;  // relative
};

/// The same on a sheet at the lumen. `edge`: of the triangles, mm; `jitter`: of the edge.
inline WidenedTube widen(const FiniteElementCase& c, double length, double edge,
                         xpbd::MembraneModel model, double jitter = 0) {
  constexpr double kHalfStenosis = 12, kHalfStent = 8, kEdgeRadius = 0.25, kTolerance = 2e-4;
  WidenedTube tube{make_tube({.length = length, .edge = edge, .jitter = jitter}), {}, 0};
  for (Vec3& p : tube.mesh.points) {
    const double z = std::abs(p.z());
    const double dip =
        z < kHalfStenosis ? 0.5 * (1 + std::cos(std::numbers::pi * z / kHalfStenosis)) : 0;
    p.head<2>() *= 1 - c.narrowing * dip;
  }
  const xpbd::Sheet sheet = xpbd::make_sheet(
      tube.mesh.points, tube.mesh.triangles, tube.mesh.pinned,
      xpbd::Membrane{.thickness = 0.5, .poisson_ratio = c.poisson_ratio, .model = model});
  double radius = 0;
  const auto cylinder = [&](std::span<const Vec3> places, std::span<xpbd::Gap> gaps) {
    for (std::size_t i = 0; i < places.size(); ++i) {
      const Vec3& p = places[i];
      const double rho = distance_from_axis(p);
      const Vec3 out(p.x() / rho, p.y() / rho, 0), along(0, 0, p.z() < 0 ? -1 : 1);
      const double r = rho - (radius - kEdgeRadius), z = std::abs(p.z()) - kHalfStent;
      if (z <= 0)
        gaps[i] = {r - kEdgeRadius, out};
      else if (r <= 0)
        gaps[i] = {z - kEdgeRadius, along};
      else
        gaps[i] = {std::hypot(r, z) - kEdgeRadius, (r * out + z * along).normalized()};
    }
  };
  tube.places = tube.mesh.points;
  const double narrowest = 5 * (1 - c.narrowing);
  // What opens by less than a tenth of its radius needs no steps.
  const int steps = c.radius > 1.1 * narrowest ? 4 : 1;
  for (int step = 1; step <= steps; ++step) {
    radius = narrowest + (c.radius - narrowest) * step / steps;
    xpbd::Equilibrium equilibrium(sheet, tube.places, cylinder);
    for (int i = 0; i < 1500 && equilibrium.balance().relative > kTolerance; ++i)
      equilibrium.iterate({.largest_move = edge});
    tube.residual = equilibrium.balance().relative;
    tube.places.assign(equilibrium.positions().begin(), equilibrium.positions().end());
  }
  return tube;
}

/// mm, over all vertices.
struct Difference {
  double radius_rms = 0, radius_max = 0;  ///< of the lumen's radius at the same place along it
  double axial_rms = 0, axial_max = 0;    ///< of where the wall's own points have gone along it
};

inline Difference compare(const WidenedTube& tube, const std::vector<LumenPoint>& lumen) {
  Difference d;
  for (std::size_t i = 0; i < tube.places.size(); ++i) {
    const Vec3& p = tube.places[i];
    const double radius = interpolated(
        lumen, std::abs(p.z()), [](const LumenPoint& q) { return q.z; },
        [](const LumenPoint& q) { return q.radius; });
    const double z = interpolated(
        lumen, std::abs(tube.mesh.points[i].z()), [](const LumenPoint& q) { return q.rest_z; },
        [](const LumenPoint& q) { return q.z; });
    const double by_radius = std::abs(distance_from_axis(p) - radius);
    const double by_z = std::abs(std::abs(p.z()) - z);
    d.radius_max = std::max(d.radius_max, by_radius);
    d.axial_max = std::max(d.axial_max, by_z);
    d.radius_rms += by_radius * by_radius;
    d.axial_rms += by_z * by_z;
  }
  const auto count = static_cast<double>(tube.places.size());
  d.radius_rms = std::sqrt(d.radius_rms / count);
  d.axial_rms = std::sqrt(d.axial_rms / count);
  return d;
}

}  // namespace vstent::tests
