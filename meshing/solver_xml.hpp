// A case for svMultiPhysics: solver.xml beside a mesh-complete, and the files that it names.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "flow/boundary_conditions.hpp"
#include "meshing/model.hpp"

namespace vstent::meshing {

struct SolverOptions {
  int steps_per_beat = 1000;
  int beats = 3;                                          ///< the last one is saved
  std::string zero_d_library = "libsvzero_interface.so";  ///< where a 0-D model is coupled
};

/// Texts of files, all for one folder, in cgs.
struct SolverCase {
  std::string xml;                           ///< solver.xml
  std::map<std::string, std::string> files;  ///< by name: waveforms, svzerod_3Dcoupling.json
  std::vector<std::string> notes;            ///< for a person, one line each
  double period = 0, time_step = 0;          ///< s
  int time_steps = 0;
};

/// Blood flow through the model: its walls at rest, at each cap its condition. Flow into the vessel
/// is negative in these files. Outlets that svMultiPhysics does not know (coronary beds,
/// resistances to a distal pressure) are coupled through svZeroDSolver, and with them every RCR
/// outlet, since svMultiPhysics takes no RCR outlet beside a coupled one. Windkessels start at the
/// pressure that the mean inflow would hold in them. \throws Error (usage) when conditions and caps
/// are not the same, when nothing flows in
SolverCase solver_case(const Model& model, const flow::BoundaryConditions& conditions,
                       const SolverOptions& options);

/// A waveform as svMultiPhysics reads it: a line with the numbers of samples and of Fourier modes,
/// then time and flow; `modes` follow the samples to within 1 % of their range where 64 can.
struct WaveformText {
  std::string text;
  int modes = 0;
  double deviation = 0;  ///< largest, as a share of the range
};
WaveformText svmultiphysics_flow(const flow::Waveform& into_vessel);

}  // namespace vstent::meshing
