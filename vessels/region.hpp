// The part of the wall that may move: one connected patch around the stent, held at its rim.
#pragma once

#include <span>

#include "sdf/geometry.hpp"

namespace vstent::vessels {

/// The patch in its own numbering, ready for a sheet. Vertices that may not move support the patch
/// from outside, so that the wall stays smooth across its rim.
struct Region {
  std::vector<int> vertices;        ///< of the surface mesh, ascending
  std::vector<char> pinned;         ///< per patch vertex: 1 where it stays where it is
  std::vector<Triangle> triangles;  ///< by patch vertex
  std::vector<int> triangle_ids;    ///< of the surface mesh
  double median_edge = 0;           ///< mm
  bool meets_opening = false;       ///< the patch was cut short by an open rim or a cap
  std::vector<char> beside;         ///< per patch vertex: 1 where it may move only to give way
};

/// Wall that a widened vessel would reach, although it is not its own.
struct GivingWay {
  Polyline axis;              ///< of the widened vessel
  std::vector<double> reach;  ///< mm, per axis point: what lies nearer is reached
  double further = 0;         ///< mm that a vessel may move beyond the patch's own limits
};

/// Vertices may move where their distance to `axis` is at most `reach` (mm, per axis point), they
/// are joined to the wall nearest to the axis's middle by such vertices, and they lie neither on an
/// open rim nor on a triangle marked `fixed` (caps). A vessel that merely lies close is not joined,
/// so it stays; unless it gives way: then what is joined to a place that is reached moves as well.
/// \throws std::invalid_argument when nothing may move
Region find_region(const TriangleMesh& mesh, std::span<const char> fixed, const Polyline& axis,
                   std::span<const double> reach, const GivingWay& giving_way = {});

}  // namespace vstent::vessels
