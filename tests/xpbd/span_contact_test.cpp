#include <gtest/gtest.h>

#include "xpbd/solver.hpp"

namespace vstent::xpbd {
namespace {

constexpr double kStiffness = 2.0;  // N/mm
constexpr std::array<double, 3> kWeights{0.5, 0.3, 0.2};

/// Three particles on springs to the plane z = 0, and no other constraint.
Sheet three_springs() {
  Sheet sheet;
  sheet.positions = {Vec3(0, 0, 0), Vec3(1, 0, 0), Vec3(0, 1, 0)};
  sheet.inverse_mass.assign(3, 1.0);
  for (int i = 0; i < 3; ++i)
    sheet.attachments.push_back({i, sheet.positions[static_cast<std::size_t>(i)], kStiffness});
  scale_masses(sheet, 1.0, 1.0);
  return sheet;
}

SpanContact lifted_to(double height) {
  return {.vertices = {0, 1, 2},
          .weights = kWeights,
          .normal = Vec3::UnitZ(),
          .offset = height,
          .key = 7};
}

/// Stationarity: k z_i = lambda w_i with sum w_i z_i = 1, so z_i = w_i / sum w^2.
void expect_balanced_lift(std::span<const Vec3> positions, double tolerance) {
  const double squares = 0.25 + 0.09 + 0.04;
  for (std::size_t i = 0; i < 3; ++i)
    EXPECT_NEAR(positions[i].z(), kWeights[i] / squares, tolerance);
}

TEST(SpanContact, RelaxationSharesTheLiftByWeight) {
  Solver solver(three_springs());
  const SpanContact contact = lifted_to(1);
  RelaxReport report;
  for (int i = 0; i < 300; ++i) report = solver.relax({}, {.largest_move = 0}, {&contact, 1});
  expect_balanced_lift(solver.positions(), 1e-9);
  EXPECT_LT(report.balance.relative, 1e-9);
  EXPECT_NEAR(report.balance.contact_force_sum, kStiffness / 0.38, 1e-8);
  EXPECT_EQ(report.balance.in_contact, 1);
}

TEST(SpanContact, TimeStepsSettleInTheSamePlace) {
  Solver solver(three_springs());
  const SpanContact contact = lifted_to(1);
  for (int i = 0; i < 500; ++i) solver.step({}, {.adaptive_damping = true}, {&contact, 1});
  expect_balanced_lift(solver.positions(), 1e-8);
}

TEST(SpanContact, PushesButNeverPulls) {
  Solver solver(three_springs());
  const SpanContact high = lifted_to(1);
  for (int i = 0; i < 50; ++i) solver.relax({}, {.largest_move = 0}, {&high, 1});
  const SpanContact low = lifted_to(-1);
  RelaxReport report;
  for (int i = 0; i < 500; ++i) report = solver.relax({}, {.largest_move = 0}, {&low, 1});
  for (const Vec3& x : solver.positions()) EXPECT_NEAR(x.z(), 0, 1e-9);
  EXPECT_EQ(report.balance.in_contact, 0);
}

TEST(SpanContact, APinnedCornerLeavesTheLiftToTheOthers) {
  Sheet sheet = three_springs();
  sheet.inverse_mass[0] = 0;
  Solver solver(sheet);
  const SpanContact contact = lifted_to(1);
  for (int i = 0; i < 300; ++i) solver.relax({}, {.largest_move = 0}, {&contact, 1});
  EXPECT_EQ(solver.positions()[0].z(), 0);
  EXPECT_NEAR(solver.positions()[1].z(), 0.3 / 0.13, 1e-9);
  EXPECT_NEAR(solver.positions()[2].z(), 0.2 / 0.13, 1e-9);
}

}  // namespace
}  // namespace vstent::xpbd
