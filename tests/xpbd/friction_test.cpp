// A tube widened on a longer cylinder with friction: the middle sticks, the ends slide in.
#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include "tests/xpbd/shapes.hpp"
#include "xpbd/equilibrium.hpp"

namespace vstent::tests {
namespace {

constexpr double kRadius = 5, kHalfLength = 20, kNu = 0.45, kWidening = 0.005;

struct Widened {
  Mesh mesh;
  std::vector<Vec3> places;
};

/// Free at both ends, widened in a few steps that hand on where friction holds.
Widened widen_on_cylinder(double coefficient) {
  Widened tube{make_tube({.radius = kRadius, .length = 2 * kHalfLength, .edge = 1}), {}};
  tube.mesh.pinned.assign(tube.mesh.points.size(), 0);
  const xpbd::Sheet sheet = xpbd::make_sheet(
      tube.mesh.points, tube.mesh.triangles, tube.mesh.pinned,
      xpbd::Membrane{
          .thickness = 0.1, .poisson_ratio = kNu, .model = xpbd::MembraneModel::neo_hookean});
  double radius = kRadius;
  const auto cylinder = [&](std::span<const Vec3> places, std::span<xpbd::Gap> gaps) {
    for (std::size_t i = 0; i < places.size(); ++i) {
      const double distance = distance_from_axis(places[i]);
      gaps[i] = {distance - radius, Vec3(places[i].x(), places[i].y(), 0) / distance};
    }
  };
  tube.places = tube.mesh.points;
  std::vector<Vec3> anchors;
  constexpr int kSteps = 4;
  for (int step = 1; step <= kSteps; ++step) {
    radius = kRadius * (1 + kWidening * step / kSteps);
    xpbd::Equilibrium equilibrium(sheet, tube.places, cylinder, {coefficient, 1e-5 * kRadius},
                                  anchors);
    for (int i = 0; i < 3000 && equilibrium.balance().relative > 1e-4; ++i) equilibrium.iterate({});
    EXPECT_LE(equilibrium.balance().relative, 1e-4) << coefficient;
    tube.places.assign(equilibrium.positions().begin(), equilibrium.positions().end());
    anchors = equilibrium.anchors();
  }
  return tube;
}

/// mm that the ends come in, and the half length of what has not moved by a hundredth of that.
struct Slid {
  double ends = 0, stuck = 0;
};

Slid measure(const Widened& tube) {
  double end = 0;
  for (const Vec3& p : tube.mesh.points) end = std::max(end, p.z());
  Slid slid;
  int count = 0;
  for (std::size_t i = 0; i < tube.places.size(); ++i)
    if (std::abs(tube.mesh.points[i].z()) > end - 1e-6) {
      slid.ends += std::abs(tube.mesh.points[i].z()) - std::abs(tube.places[i].z());
      ++count;
    }
  slid.ends /= count;
  slid.stuck = end;
  for (std::size_t i = 0; i < tube.places.size(); ++i)
    if (std::abs(tube.places[i].z() - tube.mesh.points[i].z()) > 0.01 * slid.ends)
      slid.stuck = std::min(slid.stuck, std::abs(tube.mesh.points[i].z()));
  return slid;
}

// From a free end the axial tension N grows by mu times the pressure (E t e + nu N) / R, until it
// is what a tube needs that does not shorten, nu E t e / (1 - nu^2): over L = R / (mu nu) ln(1 / (1
// - nu^2)), while the end comes in by e (L / nu - R / mu). Widening e of 0.5 %: nothing of second
// order is left beyond a percent; a row of triangles is 0.87 mm long.
TEST(Friction, HoldsATubeAsFarAsItsPressureAllows) {
  for (const double mu : {0.3, 0.6}) {
    const Slid slid = measure(widen_on_cylinder(mu));
    const double length = kRadius / (mu * kNu) * std::log(1 / (1 - kNu * kNu));
    const double end = kWidening * (length / kNu - kRadius / mu);
    EXPECT_NEAR(slid.ends / end, 1, 0.05) << mu;
    // What slides near the stuck part does so with the square of the way: a hundredth of the ends'
    // at a tenth of the length.
    EXPECT_NEAR(kHalfLength - slid.stuck, 0.9 * length, 1.2) << mu;
  }
}

TEST(Friction, TendsToNoneAndToSticking) {
  const double free = measure(widen_on_cylinder(0)).ends;
  EXPECT_NEAR(free / (kNu * kWidening * kHalfLength), 1, 0.02);
  EXPECT_NEAR(measure(widen_on_cylinder(1e-4)).ends / free, 1, 0.01);
  // Rows at the ends slide by what their own triangles shorten.
  EXPECT_LT(measure(widen_on_cylinder(20)).ends, 0.02 * free);
}

TEST(Friction, GivesTheSameBitsForAnyNumberOfThreads) {
  const auto run = [&](std::size_t threads) {
    const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads);
    return widen_on_cylinder(0.4).places;
  };
  const std::vector<Vec3> one = run(1);
  for (const std::size_t threads : {2, 3, 8}) EXPECT_EQ(run(threads), one) << threads;
}

}  // namespace
}  // namespace vstent::tests
