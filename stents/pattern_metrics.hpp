// What a pattern measures, taken from its geometry: metal, cells, counts.
#pragma once

#include <vector>

#include "stents/pattern.hpp"

namespace vstent::stents {

/// An opening all around which there is metal; those at the ends of the stent are none.
struct MeshCell {
  double area = 0;          ///< mm^2, free of metal
  double circle = 0;        ///< mm, diameter of the largest circle that fits in
  double angle = 0, z = 0;  ///< of that circle's centre
};

struct PatternMetrics {
  double length = 0;            ///< mm
  double radius = 0;            ///< mm, mean, of centre lines
  double strut_width = 0;       ///< mm
  double metal_to_artery = 0;   ///< struts' union over the area of the cylinder they lie on
  std::vector<MeshCell> cells;  ///< by ascending area
  double median_cell = 0, smallest_cell = 0, largest_cell = 0, mean_cell = 0;  ///< mm^2
  double largest_circle = 0;  ///< mm, diameter, of all cells
  double pores_per_mm2 = 0;   ///< mean cells that the free area makes, per area of the cylinder
  int struts = 0;             ///< pieces between crowns, joints and crossings
  int crowns = 0, connectors = 0;
  int crossings = 0;  ///< of wires
  double pixel = 0;   ///< mm, of the raster that areas were taken from
};

/// Struts are drawn at their width on the cylinder of their centre lines, unrolled, whose radius is
/// the mean at each place along the stent. Areas come from a raster of exact distances: pixels that
/// an edge passes count by the share that its distance gives, so that areas are off by less than
/// pixel / 8 times the length of their edge and converge with pixel^2. Circles come from the
/// distances themselves, to pixel / 1000. Gaps narrower than two pixels count as closed.
/// pixel 0: an eighth of the strut width, more only where that would take more than 10 million.
/// \throws std::invalid_argument a pixel above a third of the strut width
PatternMetrics measure(const Pattern& pattern, double pixel = 0);

}  // namespace vstent::stents
