// The stent's own mechanics, without a wall: against closed forms and differences.
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "deployment/rest_search.hpp"
#include "sdf/polyline.hpp"

namespace vstent::deployment {
namespace {

using Eigen::VectorXd;

StentLine straight(double length, double radius, int pieces) {
  StentLine line;
  for (int i = 0; i <= pieces; ++i) {
    line.axis.push_back(Vec3(0, 0, length * i / pieces));
    line.radii.push_back(radius);
  }
  return line;
}

/// A quarter of a helix.
StentLine curved(int pieces) {
  StentLine line;
  for (int i = 0; i <= pieces; ++i) {
    const double angle = 0.5 * std::numbers::pi * i / pieces;
    line.axis.push_back(Vec3(20 * std::cos(angle), 20 * std::sin(angle), 6 * angle));
    line.radii.push_back(3);
  }
  return line;
}

/// Numbers that look like chance, the same everywhere.
VectorXd scattered(Eigen::Index count, double size) {
  VectorXd v(count);
  for (Eigen::Index i = 0; i < count; ++i)
    v[i] = size * std::sin(1.7 * static_cast<double>(i * i) + 0.3);
  return v;
}

// Dead loads p_i at the axis's points have the potential -sum p_i . x_i: forces are minus the
// gradient of all energy, wherever the stent is. Central differences err by h^2/6 times third
// derivatives and by rounding over h: 1e-8 and 1e-9 of forces here.
TEST(YieldingStent, ForcesAreTheGradientOfItsEnergy) {
  const YieldingStent stent(curved(60), {40.0, 0.3});
  std::vector<Vec3> loads;
  for (int i = 0; i <= 60; ++i)
    loads.push_back(Vec3(std::sin(0.9 * i), std::cos(1.3 * i), std::sin(0.4 * i * i)));
  const VectorXd place = scattered(stent.unknowns(), 0.02);
  const auto energy = [&](const VectorXd& at) {
    const StentLine line = stent.shape(at);
    double sum = stent.energy(at);
    for (std::size_t i = 0; i < loads.size(); ++i) sum -= loads[i].dot(line.axis[i]);
    return sum;
  };
  const StentLine line = stent.shape(place);
  std::vector<Push> pushes;
  for (std::size_t i = 0; i < loads.size(); ++i) pushes.push_back({line.axis[i], loads[i]});
  const VectorXd forces = stent.forces(place, pushes);
  const double h = 1e-5;
  // Loads on the axis do not act on the radii; the spring of these is in the energy alone.
  const double scale = forces.cwiseAbs().maxCoeff();
  for (Eigen::Index k = 0; k + stent.losses() < stent.unknowns(); ++k) {
    VectorXd step = VectorXd::Zero(stent.unknowns());
    step[k] = h;
    const double slope = (energy(place + step) - energy(place - step)) / (2 * h);
    EXPECT_NEAR(forces[k], -slope, 1e-7 * scale) << k;
  }
}

// Pushes on the surface towards the axis narrow it: the work on a uniform loss of 1 mm is their
// sum. A uniform loss is all splines at 1, since B-splines sum to one.
TEST(YieldingStent, PushesTowardsTheAxisNarrowIt) {
  const YieldingStent stent(straight(20, 3, 100), {std::nullopt, 0.3});
  std::vector<Push> pushes;
  for (int i = 0; i < 200; ++i) {
    const Vec3 out(std::cos(0.7 * i), std::sin(0.7 * i), 0);
    pushes.push_back({3 * out + Vec3(0, 0, 0.1 * i), -0.02 * out});
  }
  const VectorXd forces = stent.forces(VectorXd::Zero(stent.unknowns()), pushes);
  EXPECT_NEAR(forces.tail(stent.losses()).sum(), 200 * 0.02, 1e-12);
  // A millimetre of diameter lost is a force of 0.3 N/mm, which did half its work over 0.5 mm.
  VectorXd half = VectorXd::Zero(stent.unknowns());
  half.tail(stent.losses()).setConstant(0.5);
  EXPECT_NEAR(stent.energy(half), 0.5 * 0.3 * 0.5 * 20, 1e-12);
  EXPECT_NEAR(stent.shape(half).radii[37], 2.5, 1e-12);
}

TEST(YieldingStent, KeepsItsLengthHoweverItBends) {
  const YieldingStent stent(curved(60), {40.0, std::nullopt});
  const StentLine line = stent.shape(scattered(stent.unknowns(), 0.05));
  EXPECT_GT((line.axis.front() - stent.shape(VectorXd::Zero(stent.unknowns())).axis.front()).norm(),
            0.5);
  EXPECT_NEAR(length(line.axis), length(curved(60).axis), 1e-10);
}

// On a stiff axis forces are their resultant and moment, in work on 1 mm rms: a force F through the
// middle shifts it uniformly, so F itself.
TEST(YieldingStent, TheLargestForceIsTheResultantOfAStiffStent) {
  const YieldingStent stent(straight(20, 3, 101), {});
  const Push push{Vec3(0, 0, 10), Vec3(0.3, -0.4, 7.0)};  // along the axis it does not count
  const VectorXd forces = stent.forces(VectorXd::Zero(stent.unknowns()), {&push, 1});
  EXPECT_NEAR(largest_force(stent, forces), 0.5, 1e-9);
  // A couple M turns it: rms of z - L/2 is L / sqrt(12), with end points weighed by half 1 + 2/n^2
  // more at most; so sqrt(12) M / L.
  const std::vector<Push> couple{{Vec3(0, 0, 15), Vec3(0.1, 0, 0)},
                                 {Vec3(0, 0, 5), Vec3(-0.1, 0, 0)}};
  const VectorXd turning = stent.forces(VectorXd::Zero(stent.unknowns()), couple);
  EXPECT_NEAR(largest_force(stent, turning), std::sqrt(12.0) * 1.0 / 20, 1e-3);
}

/// The rest of a stent on springs (N/mm per mm of its length) with a load at its middle.
StentLine on_springs(const YieldingStent& stent, const StentLine& rest, double spring, double load,
                     int* looks = nullptr) {
  RestSearch search(stent, load);  // mm: far beyond what it moves
  const std::vector<double> arc = arc_lengths(rest.axis);
  const std::size_t last = arc.size() - 1;
  for (int look = 1; look <= 60; ++look) {
    const StentLine line = stent.shape(search.place());
    std::vector<Push> pushes;
    double energy = stent.energy(search.place()), sum = 0;
    for (std::size_t i = 0; i <= last; ++i) {
      const double share = 0.5 * (arc[std::min(i + 1, last)] - arc[i > 0 ? i - 1 : 0]);
      const Vec3 moved = line.axis[i] - rest.axis[i];
      Push push{line.axis[i], -spring * share * moved};
      energy += 0.5 * spring * share * moved.squaredNorm();
      sum += push.force.norm();
      if (i == last / 2) {
        push.force.x() += load;
        energy -= load * moved.x();
      }
      pushes.push_back(push);
    }
    const VectorXd forces = stent.forces(search.place(), pushes);
    if (looks) *looks = look;
    if (largest_force(stent, forces) < 1e-5 * load) return line;
    search.looked(forces, energy, sum + load);
  }
  ADD_FAILURE() << "found no rest";
  return rest;
}

// A free beam of length L on springs k with a load P at its middle (Hetenyi 1946, chapter III):
// w(L/2) = P b/(2 k) (cosh bL + cos bL + 2)/(sinh bL + sin bL), w(0) = 2 P b/k cosh(bL/2) cos(bL/2)
// / (sinh bL + sin bL), b^4 = k/(4 EI). Splines a radius h apart follow its curvature to (b h)^4 /
// 384; the concentrated load leaves a kink in curvature's slope, within a few per cent of one span.
TEST(RestSearch, AFreeBeamOnSpringsBendsAsHetenyiSays) {
  const double length = 24, stiffness = 50, spring = 0.4, load = 0.01;
  const StentLine rest = straight(length, 1, 240);
  for (const double radius : {1.0, 3.0}) {
    const StentLine line = straight(length, radius, 240);
    const YieldingStent stent(line, {stiffness, std::nullopt});
    int looks = 0;
    const StentLine found = on_springs(stent, rest, spring, load, &looks);
    const double b = std::pow(spring / (4 * stiffness), 0.25), bl = b * length;
    const double below = std::sinh(bl) + std::sin(bl);
    const double middle = load * b / (2 * spring) * (std::cosh(bl) + std::cos(bl) + 2) / below;
    const double end = 2 * load * b / spring * std::cosh(bl / 2) * std::cos(bl / 2) / below;
    EXPECT_NEAR(found.axis[120].x(), middle, 0.01 * middle) << radius;
    EXPECT_NEAR(found.axis.front().x(), end, 0.01 * middle) << radius;
    EXPECT_LT(looks, 40);
  }
}

// Stiff, it only shifts: by the load over all springs.
TEST(RestSearch, AStiffBeamShiftsAsAWhole) {
  const StentLine rest = straight(24, 3, 240);
  for (const std::optional<double> stiffness : {std::optional<double>(), std::optional(1e9)}) {
    const YieldingStent stent(rest, {stiffness, std::nullopt});
    const StentLine found = on_springs(stent, rest, 0.4, 1.0);
    for (const Vec3& x : found.axis) EXPECT_NEAR(x.x(), 1.0 / (0.4 * 24), 1e-5);
  }
}

}  // namespace
}  // namespace vstent::deployment
