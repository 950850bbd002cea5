// Tubes against closed forms: final radius, contact force, the transition beside a stent, no twist
// (V5, V7, V8).
#include <gtest/gtest.h>

#include "tests/xpbd/shapes.hpp"

namespace vstent::tests {
namespace {

using xpbd::Sheet;
using xpbd::Solver;
using xpbd::UniformStiffness;

/// Relaxes on a cylinder that grows to `radius` by `steps`, until the relative residual is below
/// 1e-6.
void expand(Solver& solver, const Mesh& mesh, double from, double radius, double half_length,
            double stiffness = 0, int steps = 20) {
  for (int step = 1; step <= 8000; ++step) {
    const double now = from + (radius - from) * std::min(1.0, static_cast<double>(step) / steps);
    const auto contacts =
        cylinder_contacts(solver.positions(), mesh.pinned, now, half_length, stiffness);
    if (solver.relax(contacts, {}).balance.relative < 1e-6 && step > steps) return;
  }
  ADD_FAILURE() << "not settled";
}

TEST(StraightTube, ComesToRestOnARigidStent) {
  const Mesh mesh = make_tube({.length = 40, .edge = 1});
  const Sheet sheet =
      xpbd::make_sheet(mesh.points, mesh.triangles, mesh.pinned, UniformStiffness{1e5, 1e3});
  Solver solver(sheet);
  expand(solver, mesh, 5, 5.5, 8);
  for (const Vec3& p : solver.positions()) {
    if (std::abs(p.z()) < 7) {
      EXPECT_NEAR(distance_from_axis(p), 5.5, 1e-6);
    }
  }
}

/// Stretches of the band |z| < 4, axial and along the hoop, and what membrane theory makes of them.
struct Band {
  double axial = 0, hoop = 0, rest_length = 0;
  double hoop_tension = 0;  // N/mm of rest length: dW/d(hoop stretch)
  std::vector<char> outside;
};

Band measure_band(const Mesh& mesh, std::span<const Vec3> settled, double stiffness) {
  Band band;
  double top = 0, rest_top = 0, radius = 0;
  int inside = 0;
  band.outside.assign(mesh.points.size(), 1);
  for (std::size_t i = 0; i < mesh.points.size(); ++i) {
    if (std::abs(mesh.points[i].z()) > 4) continue;
    band.outside[i] = 0;
    radius += distance_from_axis(settled[i]);
    ++inside;
    if (mesh.points[i].z() > rest_top) {
      rest_top = mesh.points[i].z();
      top = settled[i].z();
    }
  }
  band.axial = top / rest_top;
  band.hoop = radius / inside / distance_from_axis(mesh.points[0]);
  band.rest_length = 2 * rest_top;
  const double diagonal = std::sqrt(band.hoop * band.hoop / 4 + 3 * band.axial * band.axial / 4);
  band.hoop_tension =
      stiffness / std::sqrt(3.0) * (2 * (band.hoop - 1) + (diagonal - 1) * band.hoop / diagonal);
  return band;
}

TEST(StraightTube, SinksIntoASoftStentAsTheStiffnessesSay) {
  for (double edge : {2.0, 1.0}) {
    const Mesh mesh = make_tube({.length = 40, .edge = edge});
    const Sheet sheet =
        xpbd::make_sheet(mesh.points, mesh.triangles, mesh.pinned, UniformStiffness{1e5, 1e3});
    Solver solver(sheet);
    expand(solver, mesh, 5, 5.5, 8, 1e5);
    const Band band = measure_band(mesh, solver.positions(), 1e5);
    const double spacing = (mesh.points[0] - mesh.points[1]).norm();
    const double area = spacing * spacing * std::sqrt(3.0) / 2;
    const double sinking = band.hoop_tension * area / (5 * 1e5);
    EXPECT_NEAR((5.5 - 5 * band.hoop) / sinking, 1, 0.03) << edge;
  }
}

TEST(StraightTube, PushesBackWithTheHoopsTension) {
  const Mesh mesh = make_tube({.length = 40, .edge = 1});
  const Sheet sheet =
      xpbd::make_sheet(mesh.points, mesh.triangles, mesh.pinned, UniformStiffness{1e5, 1e3});
  Solver solver(sheet);
  expand(solver, mesh, 5, 5.5, 8);
  const Band band = measure_band(mesh, solver.positions(), 1e5);
  const auto contacts = cylinder_contacts(solver.positions(), band.outside, 5.5, 8);
  // N rings of vertices stand for N spacings.
  const double spacing = (mesh.points[0] - mesh.points[1]).norm() * std::sqrt(3.0) / 2;
  const double expected = 2 * std::numbers::pi * band.hoop_tension * (band.rest_length + spacing);
  EXPECT_NEAR(solver.balance(contacts, 1e-3).contact_force_sum / expected, 1, 0.01);
}

/// Radial displacement of a linear tube beside a rigid stent's end, over the oversize; q = beta s.
double transition(double q) { return std::exp(-q) * (std::cos(q) + 0.717102 * std::sin(q)); }

TEST(Transition, DecaysBesideAStentAsThinShellTheorySays) {
  // beta^4 = k_d / (3 R^2 k_b); beta = 0.5 / mm, beta h = 0.2.
  const double radius = 5, beta = 0.5, stretching = 1;
  const double bending = stretching / (3 * radius * radius * std::pow(beta, 4));
  const Mesh mesh = make_tube({.radius = radius, .length = 56, .edge = 0.4});
  const Sheet sheet = xpbd::make_sheet(mesh.points, mesh.triangles, mesh.pinned,
                                       UniformStiffness{stretching, bending});
  const double spacing = (mesh.points[0] - mesh.points[1]).norm() * std::sqrt(3.0) / 2;
  const double end = spacing * std::floor(8 / spacing), oversize = 0.05;
  Solver solver(sheet);
  expand(solver, mesh, radius, radius + oversize, end + 0.01 * spacing, 0, 1);

  // Clamped ends resist the stented part's axial pull, and the whole tube narrows by nu^2 / (1 -
  // nu^2) of its mean.
  double mean = 0;
  for (const Vec3& p : solver.positions()) mean += distance_from_axis(p) - radius;
  mean /= static_cast<double>(mesh.points.size());
  double worst = 0, last_s = 0, last_w = oversize, length_found = 0;
  for (std::size_t i = 0; i < mesh.points.size();
       i += static_cast<std::size_t>(std::lround(2 * std::numbers::pi * radius / 0.4))) {
    const double s = mesh.points[i].z() - end;
    if (s < -1e-9 || beta * s > 5) continue;
    const double w = distance_from_axis(solver.positions()[i]) - radius + 0.125 * mean;
    worst = std::max(worst, std::abs(w - oversize * transition(beta * s)));
    if (length_found == 0 && w < 0.1 * oversize)
      length_found = last_s + (s - last_s) * (last_w - 0.1 * oversize) / (last_w - w);
    last_s = s;
    last_w = w;
  }
  EXPECT_LT(worst, 0.05 * oversize + 1e-4);
  EXPECT_NEAR(beta * length_found / 1.7213, 1, 0.05);
}

TEST(AxisymmetricTube, DoesNotTwistAndStaysRound) {
  const Mesh mesh = make_tube({.length = 40, .edge = 1, .narrowing = 0.6});
  Sheet sheet =
      xpbd::make_sheet(mesh.points, mesh.triangles, mesh.pinned, xpbd::Membrane{.thickness = 0.5});
  xpbd::scale_masses(sheet, 1, 0.5);
  for (const bool stepped : {true, false}) {
    Solver solver(sheet);
    for (int step = 0; step <= 1200; ++step) {
      const double radius = 1.98 + (5 - 1.98) * std::min(1.0, step / 60.0);
      const auto contacts = cylinder_contacts(solver.positions(), mesh.pinned, radius, 8);
      if (stepped)
        solver.step(contacts, {.iterations = 1, .velocity_limit = 0.1, .adaptive_damping = true});
      else
        solver.relax(contacts, {});
    }
    const std::size_t around = 31;
    for (std::size_t ring = 0; ring < mesh.points.size(); ring += around) {
      double swirl = 0, nearest = 1e9, farthest = 0;
      for (std::size_t i = ring; i < ring + around; ++i) {
        const Vec3 &p = solver.positions()[i], &p0 = mesh.points[i];
        swirl += std::remainder(std::atan2(p.y(), p.x()) - std::atan2(p0.y(), p0.x()),
                                2 * std::numbers::pi) /
                 around;
        nearest = std::min(nearest, distance_from_axis(p));
        farthest = std::max(farthest, distance_from_axis(p));
      }
      EXPECT_LT(std::abs(swirl) * 180 / std::numbers::pi, 0.05) << stepped;
      EXPECT_LT(farthest - nearest, 1e-3 * 5) << stepped;
    }
  }
}

}  // namespace
}  // namespace vstent::tests
