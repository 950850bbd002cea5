// A wall made smoother without shrinking.
#pragma once

#include <span>

#include "meshing/model.hpp"
#include "vessels/units.hpp"

namespace vstent::meshing {

struct SmoothOptions {
  int iterations = 10;
  double step = 0.5;  ///< share of the way to the mean of the neighbours, by inverse edge length
  /// Each step is followed by a step back that undoes the shrinking of waves longer than about ten
  /// edges (Taubin 1995, pass band 0.1). Off: plain Laplacian.
  bool taubin = true;
  double volume_limit = 0.005;  ///< largest change of the enclosed volume, as a share
};

struct Smoothed {
  Model model;
  double volume_change = 0;  ///< share
  double largest_move = 0;   ///< mm
  std::size_t held = 0;      ///< points put back, because a triangle would have turned over
};

/// Moves the points of walls within `region` (per triangle; empty: all). Points of caps, on edges
/// between faces and on the region's border stay.
/// \throws Error (geometry) when the volume would change by more than the limit, or triangles cross
Smoothed smooth(const Model& model, std::span<const char> region, const SmoothOptions& options = {},
                vessels::LengthUnit unit = vessels::LengthUnit::mm);

}  // namespace vstent::meshing
