// What does a stent change in the flow? The reduced model of a lumen, before and after.
#pragma once

#include "flow/faces.hpp"
#include "flow/lumen_tree.hpp"

namespace vstent::flow {

/// A stretch of the vessel to measure the pressure drop over; mm.
struct Stretch {
  Vec3 from, to;        ///< on the lumen before, proximal and distal
  double diameter = 0;  ///< a vessel's there, by which the places of pressure lie beyond it
};

struct Question {
  const vessels::Surface& before;
  const vessels::Surface& after;        ///< may be the same
  vessels::Centerline centerline;       ///< of `before`, radii known
  std::optional<Stretch> stretch = {};  ///< nothing: the narrowing that costs most pressure
};

/// A place on the tree; mm from the start of a branch, and along the path.
struct TreePlace {
  int branch = 0;
  std::size_t point = 0;
  double along = 0;
};

/// The way of blood past the stretch, from the root to a leaf.
struct TreePath {
  std::vector<int> branches;
  std::vector<double> start;  ///< mm along the path at which each begins
};

/// Pressures in dyn/cm2, flows in mL/s; means are over the beat.
struct Answer {
  Network network;
  double mean_inflow = 0;
  std::optional<Beat> beat;                        ///< nothing in steady flow
  std::vector<double> mean_flow;                   ///< per branch
  std::vector<std::vector<double>> mean_pressure;  ///< per branch and point
  double proximal = 0, distal = 0;                 ///< mean pressures beside the stretch
  double drop = 0;                                 ///< their difference
  double lowest_drop = 0, highest_drop = 0;        ///< by other published coefficients
  std::optional<double> peak_drop;                 ///< largest of any instant
  std::optional<double> peak_to_peak;              ///< of the two places' largest pressures
  double inlet = 0;                                ///< mean pressure
  double ratio = 0;                                ///< distal / inlet: FFR in hyperaemia
};

struct Study {
  LumenTree tree;
  std::vector<TreeEnd> ends;
  Inflow inflow;
  Waveform inflow_volume;  ///< mL/s
  double inlet_area = 0;   ///< cm2
  TreePath path;
  TreePlace proximal, distal;                      ///< of the two pressures
  double stretch_from = 0, stretch_to = 0;         ///< mm along the path
  std::string stretch_is = "the treated stretch";  ///< for a person
  std::optional<Answer> before;                    ///< nothing where there is one surface
  Answer after;
  std::vector<std::string> notes;
};

/// The pressures beside the stretch are taken one diameter before and two behind it.
/// \throws Error: usage for conditions that do not fit, geometry, numerical
Study study(const Question& question, const BoundaryConditions& conditions);

/// Outlets for want of better: a mean pressure of `pressure` (dyn/cm2) at all of them, flow shared
/// by diameter to the power 7/3 (Huo and Kassab 2009).
BoundaryConditions assumed_conditions(const Question& question, const Inflow& inflow,
                                      double pressure, const Blood& blood);

}  // namespace vstent::flow
