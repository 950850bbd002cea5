// A stent whose design is the surface of a straight one, from a file.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "stents/smooth_tube.hpp"
#include "stents/straight_surface.hpp"

namespace vstent::deployment {

/// Lengths in mm.
struct SurfaceDesign {
  std::string name;
  stents::StraightSurface surface;
  /// Of its struts: the median of the radial thickness over the outer surface, and the width that a
  /// rectangle of this thickness and the solid's volume over its area has.
  double thickness = 0, width = 0;
  stents::Cell cell = stents::Cell::open;
  double crimped_diameter = 0, largest_diameter = 0;  ///< outer; 0: not known
  std::vector<std::string> findings;  ///< of the file: what was repaired or is doubtful
};

/// The outer surface's facets face away from the axis within 25 degrees: on a round wire those lie
/// at most a tenth of its radius below its top.
inline constexpr double kOuterFacet = 0.9;

/// A surface file by its extension, or a design file with a "surface".
bool is_surface_design(const std::string& design);

/// my_stent.stl (also .vtp .vtk .obj), in millimetres, or a design file
/// {"surface": "my_stent.stl", "unit": "mm"} that may add "cell" (open, closed), "axis" ([x, y, z],
/// proximal to distal), "flip" (ends exchanged), "crimped_diameter", "largest_diameter", "name".
/// \throws Error (input_file) a file that cannot be read; (geometry) a surface that is open,
/// not oriented or no straight tube; (usage) a wrong key, or a unit that makes no stent
SurfaceDesign read_surface_design(const std::string& path);

/// \throws Error (usage) a diameter (mm) that the design does not reach, or that its metal fills
void require_reachable(const SurfaceDesign& design, double smallest, double largest,
                       const std::string& key);

/// What a surface without a mechanism cannot do, in figures: struts that widen, a length that
/// stays.
std::string limits_of(const SurfaceDesign& design, double diameter);

}  // namespace vstent::deployment
