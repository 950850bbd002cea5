// Flow in trees against closed forms and conservation.
#include <gtest/gtest.h>

#include <cmath>
#include <complex>
#include <numbers>

#include "flow/network.hpp"

namespace vstent::flow {
namespace {

constexpr double kPi = std::numbers::pi;

Branch tube(int parent, double diameter, double length, const Blood& blood) {
  const double area = 0.25 * kPi * diameter * diameter;
  Branch branch{parent, {{0, length / 2, length}, {area, area, area}}, {}};
  branch.losses = losses_along(branch.lumen, blood);
  return branch;
}

Network single(const Condition& outlet, double diameter = 0.4, double length = 10) {
  Network network;
  network.branches = {tube(-1, diameter, length, network.blood)};
  network.outlets = {{0, outlet}};
  return network;
}

/// An aorta that forks twice; its branches' velocities differ.
Network tree() {
  Network n;
  n.branches = {tube(-1, 2.0, 5, n.blood), tube(0, 1.8, 10, n.blood), tube(0, 0.7, 8, n.blood),
                tube(1, 1.1, 6, n.blood), tube(1, 1.3, 4, n.blood)};
  n.outlets = {{2, Rcr{800, 1e-4, 9000, 0}},
               {3, Resistance{4000, 5 * kDynPerCm2PerMmHg}},
               {4, Rcr{300, 5e-4, 2500, 0}}};
  return n;
}

TEST(Network, ATubeAndItsOutletAreInSeries) {
  const Network network = single(Resistance{1500, 2000});
  const Instant instant = solve_steady(network, 12);
  const double tube = 128 * 0.04 * 10 / (kPi * std::pow(0.4, 4));
  EXPECT_NEAR(instant.inlet_pressure, 2000 + 12 * (1500 + tube), 1e-6);
  const auto p = pressures(network, instant);
  EXPECT_NEAR(p[0][1], 2000 + 12 * (1500 + tube / 2), 1e-6);
  EXPECT_NEAR(p[0][2], 2000 + 12 * 1500, 1e-6);
}

TEST(Network, BernoulliWithoutLossIsRecovered) {
  // Inviscid blood that speeds up in a cone: p + rho/2 u^2 stays.
  Network network;
  network.blood.viscosity = 1e-12;
  Branch cone{-1, {{0, 5}, {1.0, 0.25}}, {}};
  cone.losses = losses_along(cone.lumen, network.blood);
  network.branches = {cone};
  network.outlets = {{0, Pressure{1e5}}};
  const Instant instant = solve_steady(network, 50);
  EXPECT_NEAR(instant.inlet_pressure - 1e5, 0.5 * 1.06 * (200.0 * 200 - 50 * 50), 1e-3);
}

TEST(Network, FlowIsConservedAtForksAndEveryOutletsLawHolds) {
  const Network n = tree();
  const Instant instant = solve_steady(n, 85);
  EXPECT_NEAR(instant.flow[0], 85, 1e-7);
  EXPECT_NEAR(instant.flow[0], instant.flow[1] + instant.flow[2], 1e-9);
  EXPECT_NEAR(instant.flow[1], instant.flow[3] + instant.flow[4], 1e-9);
  const auto p = pressures(n, instant);
  for (const auto& [leaf, condition] : n.outlets) {
    const Resistance r = steady(condition);
    const auto b = static_cast<std::size_t>(leaf);
    EXPECT_NEAR(p[b].back(), r.distal_pressure + r.resistance * instant.flow[b],
                1e-9 * p[b].back());
  }
  // At a fork faster blood has its parent's total pressure, slower blood its pressure.
  for (const std::size_t b : {1u, 2u, 3u, 4u}) {
    const auto parent = static_cast<std::size_t>(n.branches[b].parent);
    const double up = instant.flow[parent] / n.branches[parent].lumen.area.back();
    const double here = instant.flow[b] / n.branches[b].lumen.area.front();
    const double gained = here > up ? 0.5 * 1.06 * (here * here - up * up) : 0;
    EXPECT_NEAR(p[b].front(), p[parent].back() - gained, 1e-6) << b;
  }
}

TEST(Network, MoreInflowCostsMoreThanInProportion) {
  Network n = single(Resistance{1000, 0}, 1.0, 10);
  n.branches[0].lumen = {{0, 4, 5, 6, 10}, {0.8, 0.8, 0.1, 0.8, 0.8}};
  n.branches[0].losses = losses_along(n.branches[0].lumen, n.blood);
  const double slow = solve_steady(n, 20).inlet_pressure - 20 * 1000;
  const double fast = solve_steady(n, 60).inlet_pressure - 60 * 1000;
  EXPECT_GT(fast, 3 * slow);
  EXPECT_LT(fast, 9 * slow);  // the viscous part grows in proportion
}

/// Sinusoidal flow of mean q0 and amplitude q1 into a tube with an outlet of impedance Z(omega).
void expect_sinusoidal(const Network& network, double steady_resistance,
                       const std::complex<double>& impedance, double distal, double period) {
  constexpr double kMean = 20, kAmplitude = 15;
  constexpr int kSamples = 4000, kSteps = 200;
  Waveform inflow;
  for (int i = 0; i <= kSamples; ++i) {
    inflow.time.push_back(period * i / kSamples);
    inflow.value.push_back(kMean + kAmplitude * std::cos(2 * kPi * i / kSamples));
  }
  const Beat beat = solve_beat(network, inflow, kSteps);
  ASSERT_EQ(beat.instants.size(), static_cast<std::size_t>(kSteps));
  // Backward differences of order two have a relative error of (omega h)^2 / 3 in the derivative,
  // and no part of the pressure can change by more than that share of the whole amplitude; periods
  // repeat to 1e-6 of the pressure.
  const double h = 2 * kPi / kSteps;
  const double amplitude = kAmplitude * std::abs(impedance);
  const double tolerance = h * h / 3 * 2 * amplitude + 1e-5 * (distal + kMean * steady_resistance);
  for (const Instant& instant : beat.instants) {
    const std::complex<double> phase =
        std::exp(std::complex<double>(0, 2 * kPi * instant.time / period));
    const double exact =
        distal + kMean * steady_resistance + kAmplitude * (impedance * phase).real();
    EXPECT_NEAR(instant.inlet_pressure, exact, tolerance) << instant.time;
  }
}

struct Tube {
  double resistance, inertance;
};
Tube tube_of(const Network& network) {
  const Losses& losses = network.branches[0].losses;
  return {losses.viscous.back(), losses.inertance.back()};
}

TEST(Network, SinusoidalFlowIntoAWindkessel) {
  const double period = 0.8, omega = 2 * kPi / period;
  const Rcr rcr{90, 8e-4, 1200, 4000};
  const Network network = single(rcr, 1.5, 12);
  const Tube tube = tube_of(network);
  const std::complex<double> i(0, 1);
  const std::complex<double> z = tube.resistance + i * omega * tube.inertance + rcr.proximal +
                                 rcr.distal / (1.0 + i * omega * rcr.distal * rcr.capacitance);
  expect_sinusoidal(network, tube.resistance + rcr.proximal + rcr.distal, z, 4000, period);
}

TEST(Network, SinusoidalFlowIntoACoronaryBed) {
  const double period = 1.0, omega = 2 * kPi / period;
  Coronary bed;
  bed.arterial = 300, bed.micro = 500, bed.venous = 200;
  bed.arterial_compliance = 1e-4, bed.micro_compliance = 8e-4;
  bed.venous_pressure = 6000;
  const Network network = single(bed, 1.5, 12);
  const Tube tube = tube_of(network);
  const std::complex<double> i(0, 1);
  const std::complex<double> muscle =
      bed.micro + 1.0 / (1.0 / bed.venous + i * omega * bed.micro_compliance);
  const std::complex<double> z = tube.resistance + i * omega * tube.inertance + bed.arterial +
                                 1.0 / (1.0 / muscle + i * omega * bed.arterial_compliance);
  expect_sinusoidal(network, tube.resistance + 1000, z, 6000, period);
}

TEST(Network, ThePressureOfTheMusclePushesBloodBack) {
  // The same muscle pressure all the time changes nothing: a capacitor carries no steady flow.
  Coronary bed;
  bed.arterial = 300, bed.micro = 500, bed.venous = 200;
  bed.arterial_compliance = 1e-4, bed.micro_compliance = 8e-4;
  const Waveform flow{{0, 0.4, 1}, {10, 30, 10}};
  const Beat rest = solve_beat(single(bed), flow);
  bed.intramyocardial_pressure = constant(5e4);
  const Beat pressed = solve_beat(single(bed), flow);
  bed.intramyocardial_pressure = {{0, 0.3, 0.6, 1}, {0, 5e4, 0, 0}};
  const Beat squeezed = solve_beat(single(bed), flow);
  double largest = 0;
  for (std::size_t i = 0; i < rest.instants.size(); ++i) {
    EXPECT_NEAR(rest.instants[i].inlet_pressure, pressed.instants[i].inlet_pressure,
                2e-5 * pressed.instants[i].inlet_pressure);
    largest =
        std::max(largest, squeezed.instants[i].inlet_pressure - rest.instants[i].inlet_pressure);
  }
  EXPECT_GT(largest, 1000);
}

TEST(Network, ASlowWindkesselStillReachesItsBeat) {
  // R C = 6 s, 7.5 beats: the mean pressure is that of the mean flow, whatever the start.
  const Waveform flow{{0, 0.1, 0.35, 0.8}, {0, 300, 0, 0}};
  const Network network = single(Rcr{60, 5e-3, 1200, 0}, 2.5, 10);
  const Beat beat = solve_beat(network, flow);
  double sum = 0;
  for (const Instant& instant : beat.instants) sum += instant.inlet_pressure;
  const double total = tube_of(network).resistance + 1260;
  // Samples h apart miss the mean of a flow by h^2/8 times the change of slope at a corner between
  // them, over the period: that at 0.35 s is, 5e-5 of the mean. Beats repeat to 1e-6.
  EXPECT_NEAR(sum / static_cast<double>(beat.instants.size()), total * mean(flow),
              1e-4 * total * mean(flow));
}

TEST(Network, ABeatOfATreeConservesFlow) {
  const Network n = tree();
  const Beat beat = solve_beat(n, {{0, 0.15, 0.4, 0.8}, {10, 400, -20, 10}});
  for (const Instant& instant : beat.instants) {
    EXPECT_NEAR(instant.flow[0], instant.flow[1] + instant.flow[2], 1e-8);
    EXPECT_NEAR(instant.flow[0], instant.flow[2] + instant.flow[3] + instant.flow[4], 1e-8);
  }
}

}  // namespace
}  // namespace vstent::flow
