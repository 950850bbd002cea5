// The time loop of Algorithm 1: the stent grows a little, the wall gives way, until forces balance.
#pragma once

#include <functional>

#include "deployment/give_way.hpp"
#include "deployment/stent_model.hpp"
#include "sdf/level_set.hpp"
#include "xpbd/solver.hpp"

namespace vstent::deployment {

/// One row of history.csv.
struct StepRecord {
  int step = 0;
  bool settling = false;  ///< the stent has its final size
  double expansion = 0;   ///< 0 start radius .. 1 nominal
  double radius = 0;      ///< mm, outer, at the proximal end
  double straightening = 0;
  int contacts = 0;         ///< places of the wall that the stent pushes
  double largest_move = 0;  ///< mm in this step
  double residual = 0;      ///< static force residual over mean contact force
  double deepest = 0;  ///< mm, as the step began: the wall inside struts, beyond what it is let
  double contact_force = 0;     ///< N, sum
  double energy = 0;            ///< N mm, stored in the wall
  double stent_shift = 0;       ///< mm, largest, of the axis of a stent that gives way
  double stent_unbalanced = 0;  ///< force on it, as last looked at, over the sum of contact forces
  int vertices = 0;             ///< of the wall that was solved: coarse first, the patch at the end
};

struct Outcome {
  std::vector<Vec3> positions;        ///< of all mesh vertices, mm
  std::vector<char> moved;            ///< per mesh vertex: belongs to the patch that may move
  Polyline axis;                      ///< of the stent, final
  std::vector<double> radii;          ///< outer, per axis point, mm
  std::vector<double> nominal_radii;  ///< where no wall narrows it
  StentShape stent;                   ///< its outer surface, or its struts
  std::optional<stents::PlacedStent> struts;
  std::shared_ptr<const stents::SurfaceMap> surface;  ///< null for all but a surface
  std::optional<GivenWay> given_way;                  ///< nothing for a rigid stent
  std::vector<StepRecord> history;
  std::vector<Vec3> patch;  ///< of the patch's vertices, mm
  bool converged = false;
  double contact_force = 0;  ///< N, sum over the vertices in contact
};

/// Called after every step with the record and the vertices of the patch; a false return stops the
/// run.
using Observer = std::function<bool(const StepRecord&, std::span<const Vec3> patch_positions)>;

/// \throws Error (numerical) when a position stops being a number; (interrupted) when the observer
/// says stop
Outcome deploy(const Setup& setup, const Observer& observe = {});

}  // namespace vstent::deployment
