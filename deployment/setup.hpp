// From a case to everything the simulation needs: the surface, the stent's place in it, the patch,
// every number derived.
#pragma once

#include <algorithm>

#include "deployment/case.hpp"
#include "deployment/surface_design.hpp"
#include "deployment/wall_material.hpp"
#include "stents/place.hpp"
#include "stents/specification.hpp"
#include "vessels/centerline.hpp"
#include "vessels/check.hpp"
#include "vessels/region.hpp"
#include "vessels/surface.hpp"

namespace vstent::deployment {

/// Where the stent will be. Lengths in mm.
struct Placement {
  vessels::CenterlinePath way;  ///< inlet to leaf, through the stented place
  double centre = 0;            ///< arc length of the stent's middle along `way`
  Polyline axis;  ///< the stent's own axis, proximal to distal, evenly spaced, before straightening
  std::vector<double> arc;  ///< arc length along `axis`
  /// For struts, which are longer while they are crimped: the axis as far as they ever reach within
  /// the vessel, and the arc length of the stent's middle on it.
  Polyline long_axis;
  double long_middle = 0;
  std::vector<double> wall_distance;  ///< from each axis point to the nearest wall
  double reference_diameter =
      0;  ///< smaller reference lumen of the two landing zones; 0 when neither can be measured
  double narrowest_diameter = 0;  ///< smallest equivalent diameter in the stented length, before
};

/// mm
struct StrutSize {
  double width = 0, thickness = 0;
  double half() const { return 0.5 * std::min(width, thickness); }
};

/// A case made ready. `specification` has every value filled in.
struct Setup {
  Case specification;
  vessels::Surface surface;
  vessels::CheckReport check;
  vessels::Centerline centerline;
  Placement placement;
  vessels::Region region;
  stents::SmoothTube stent;  ///< its final outer dimensions
  stents::Specification design_specification;
  std::shared_ptr<const stents::Design> design;         ///< null: a smooth tube, or a surface
  std::shared_ptr<const SurfaceDesign> surface_design;  ///< null: a smooth tube, or parameters
  StrutSize strut;                                      ///< zero for a smooth tube
  WallMaterial material;                                ///< of the patch
  std::optional<vessels::Surface> unrefined;  ///< as read, where `surface` was refined for struts
  double start_radius = 0;                    ///< inside the narrowest lumen
  /// mm, edges of the coarser walls that the patch's shape is first found on.
  std::vector<double> level_spacings;
  std::vector<std::string> warnings;

  bool has_struts() const { return design || surface_design; }
};

/// Reads, checks, places and derives.
/// \throws Error: input_file, geometry (a surface that cannot be stented, a stent that reaches over
/// the vessel's end, a target below the present lumen, a bend tighter than the stent is wide) or
/// usage
Setup prepare(Case specification);

/// The same, growing on the patch itself, in steps and at a distance that fit its edges.
Setup on_patch_alone(Setup setup);

}  // namespace vstent::deployment
