// What became of the branches that leave the treated vessel?
#pragma once

#include "measure/profile.hpp"

namespace vstent::measure {

/// The ostium is the section across the branch's own centerline behind the parent's wall: half a
/// branch radius behind the place where the centerline leaves the parent's inscribed spheres, or
/// the first place further on, in steps of a tenth of the radius up to three, where the outline
/// closes and is no wider than 1.5 branch diameters (an oblique branch leaves the parent later on
/// one side). After: the same loop carried with the wall where the triangles are the same,
/// otherwise the cut of the surface after in the same plane.
struct SideBranch {
  int branch = 0;                                     ///< id in the centerline
  double arc_length = 0;                              ///< where it leaves the way, mm
  bool in_stent = false;                              ///< within the treated length
  std::optional<double> ostium_before, ostium_after;  ///< mm2
  /// Smallest over largest diameter; of the cut in the loop's plane.
  std::optional<double> symmetry_before, symmetry_after;
  /// % of the ostium from which the way along the branch into the parent meets the stent before
  /// the parent's axis. A smooth tube is one closed body.
  std::optional<double> coverage;
};

/// Branches that leave the way between the first and the last station. `stent`: its surface; empty:
/// none known.
std::vector<SideBranch> measure_side_branches(const CutSurface& before, const CutSurface& after,
                                              bool same_triangles, const Profile& profile,
                                              const vessels::Centerline& centerline,
                                              const vessels::CenterlinePath& way,
                                              const TriangleMesh& stent);

}  // namespace vstent::measure
