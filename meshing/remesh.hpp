// Triangles of a wanted length on part of a model; the rest stays, bit by bit.
#pragma once

#include <span>

#include "meshing/edge_lengths.hpp"
#include "meshing/model.hpp"
#include "meshing/quality.hpp"
#include "vessels/units.hpp"

namespace vstent::meshing {

struct RemeshOptions {
  EdgeLengths edge_lengths;
  /// Edges between faces (rims of caps) within the region may be cut and joined along their curve.
  bool resample_rims = false;
  int iterations = 6;
};

/// The kept points and triangles come first, in their order; then what is new.
struct Remeshed {
  Model model;
  std::vector<int> kept_point;     ///< per point: the one of the model before that it is, -1: new
  std::vector<int> kept_triangle;  ///< per triangle, the same
  std::vector<char> is_new;        ///< per triangle
  std::vector<int> origin;         ///< per triangle: the kept one, or the nearest before
  /// Triangles of the region that stayed, because new ones there would have crossed others.
  std::size_t left = 0;
  SurfaceQuality before, after;  ///< of the region
  double deviation = 0;          ///< mm, larger of both one-way distances
  double volume_change = 0;      ///< share of the model's volume; 0 for open models
};

/// Remeshes the triangles marked in `region` (empty: all) within their faces; caps stay plane.
/// \throws Error (usage) for lengths that are none; (resources) for too many triangles; (geometry)
/// naming places when new triangles would cross others on most of the region
Remeshed remesh(const Model& model, std::span<const char> region, const RemeshOptions& options,
                vessels::LengthUnit unit = vessels::LengthUnit::mm);

}  // namespace vstent::meshing
