// How good are a surface's triangles, and how far is one surface from another?
#pragma once

#include <span>

#include "sdf/geometry.hpp"

namespace vstent::meshing {

struct SurfaceQuality {
  std::size_t triangles = 0;
  double area = 0;                 ///< mm2
  double smallest_angle = 0;       ///< degrees
  double mean_smallest_angle = 0;  ///< degrees; 60 where all triangles are equilateral
  double largest_aspect_ratio =
      0;  ///< longest side over 2 sqrt(3) inscribed radii; 1 is equilateral
  double mean_aspect_ratio = 0;
  double shortest_edge = 0, mean_edge = 0, longest_edge = 0;  ///< mm
  struct Bin {
    double from = 0, to = 0;  ///< mm
    std::size_t edges = 0;
  };
  std::vector<Bin> edge_lengths;  ///< twenty bins from the shortest to the longest
};

/// Of all triangles, or of the marked ones.
SurfaceQuality measure_quality(const TriangleMesh& mesh, std::span<const char> marked = {});

/// Largest distance (mm) from the points and centroids of `from`'s marked (or all) triangles to the
/// surface `to`.
double one_way_distance(const TriangleMesh& from, const TriangleMesh& to,
                        std::span<const char> marked = {});

/// mm3, of a closed outward surface.
double enclosed_volume(const TriangleMesh& mesh);

}  // namespace vstent::meshing
