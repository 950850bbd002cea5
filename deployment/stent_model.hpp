// The stent of a case on its way from crimped to its final size: where it is, and what is
// voxelised.
#pragma once

#include <optional>

#include "deployment/setup.hpp"
#include "deployment/stent_shape.hpp"
#include "deployment/yielding_stent.hpp"
#include "stents/surface_map.hpp"

namespace vstent::deployment {

/// The stent at a share of its expansion.
struct StentState {
  Polyline axis;  ///< from end to end, partly straightened; as many points as Placement::axis
  std::vector<double> radii;                          ///< outer, there, mm
  std::optional<stents::PlacedStent> struts;          ///< nothing for a smooth tube or a surface
  std::shared_ptr<const stents::SurfaceMap> surface;  ///< null for all but a surface
  double straightening = 0;  ///< share of the axis's turns that is taken out
};

/// \throws Error (geometry) a bend that the design cannot follow
StentState stent_state(const Setup& setup, double expansion);

/// The expanded stent on the axis and with the outer radii to which the wall has pushed it: as many
/// points as Placement::axis. \throws Error (geometry) a bend that the design cannot follow
StentState yielded_state(const Setup& setup, const StentLine& line);

/// What reaches beyond the radii of an expanded stent and holds the wall there: metal in bends, a
/// sleeve. mm
double envelope_beyond(const Setup& setup, const StentState& state);

/// Its metal, or its smooth outer surface.
StentShape shape_of(const Setup& setup, const StentState& state);

/// The smooth solid that the stent's outer radii span, drawn `inset` (mm) inside them: contact at
/// that distance puts the wall on the outer surface over the whole length, and rounds its edge just
/// beyond the ends.
sdf::Solid envelope_of(const Setup& setup, const StentState& state, double inset);

/// As the balloon widens it at a share of its expansion: at the end by what recoil takes back, and
/// over all metal. Smooth tubes as they are.
StentState inflated(const Setup& setup, StentState state, double expansion);

/// Steps in which the stent, or its balloon, grows: none may move its surface by more than
/// growth_per_step; with friction, where the wall is in balance at each, a tenth as many, at least
/// ten. \throws Error (usage) more than a million
int growth_steps(const Setup& setup);

/// The straight stent of this design with the nominal outer radii of `tube`, or on the way to it
/// from `start_radius` (mm) everywhere. \throws Error (usage) beyond the design's limits
stents::Pattern expanded_pattern(const stents::Design& design, const stents::SmoothTube& tube,
                                 double start_radius, double expansion);

}  // namespace vstent::deployment
