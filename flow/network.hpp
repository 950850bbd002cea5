// A tree of branches with an inflow at its root and a condition at every leaf. cgs.
#pragma once

#include <map>

#include "flow/losses.hpp"

namespace vstent::flow {

struct Branch {
  int parent = -1;  ///< -1: the root, branch 0
  Lumen lumen;
  Losses losses;
};

/// Along a branch total pressure p + rho/2 u^2 is lost as Losses say. Where it forks, a branch in
/// which blood runs faster begins with the total pressure at its parent's end (Bernoulli), one in
/// which it runs slower with the pressure there: what dynamic pressure it loses is not recovered.
struct Network {
  std::vector<Branch> branches;  ///< parents first
  Blood blood;
  std::map<int, Condition> outlets;  ///< of every leaf
};

/// Flows (mL/s) and their rates (mL/s2) per branch, and the pressure at the root's start (dyn/cm2).
struct Instant {
  double time = 0, inlet_pressure = 0;
  std::vector<double> flow, rate;
};

/// Per branch and point, dyn/cm2.
std::vector<std::vector<double>> pressures(const Network& network, const Instant& instant);

/// \throws Error (numerical) where the equations have no solution that Newton's method finds
Instant solve_steady(const Network& network, double inflow);

/// One period of the flow that repeats itself, in even steps.
struct Beat {
  std::vector<Instant> instants;
  int beats = 0;  ///< simulated until it repeated
};

/// Second-order backward differences, `steps` to a beat. \throws Error (numerical) also where no
/// beat repeats the one before
Beat solve_beat(const Network& network, const Waveform& inflow, int steps = 200);

}  // namespace vstent::flow
