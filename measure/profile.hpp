// The lumen along the vessel, before and after: sections normal to its axis, and that axis.
#pragma once

#include <optional>

#include "vessels/centerline.hpp"
#include "vessels/lumen_ends.hpp"
#include "vessels/sections.hpp"

namespace vstent::measure {

/// The lumen at one place along the way.
struct Station {
  double arc_length = 0;  ///< from the start of the way, on the centerline before, mm
  double target = 0;      ///< nominal lumen diameter, mm; 0: unknown, or beyond the stent
  bool in_stent = false;  ///< or, where no stent is known, where the lumen changed
  std::optional<vessels::Section> before, after;     ///< nothing where the surface is open
  bool branch_before = false, branch_after = false;  ///< the section runs into a branch
  double curvature_before = 0, curvature_after = 0;  ///< of the axis, 1/mm

  bool whole_before() const { return before && !branch_before; }
  bool whole_after() const { return after && !branch_after; }
};

/// One point of both axes per station, evenly spaced before.
struct Profile {
  Polyline axis_before, axis_after;
  std::vector<Station> stations;
  double spacing = 0;  ///< mm
};

/// One surface, made ready to be cut.
struct CutSurface {
  explicit CutSurface(const vessels::Surface& of);
  /// Nothing where the surface is open, and where a cap closes the outline.
  std::optional<vessels::Section> section(const Vec3& centre, const Vec3& normal,
                                          double reach) const;

  const vessels::Surface& surface;
  vessels::LumenEnds ends;
  vessels::Sectioner sections;
};

/// Centres and radii of the centerline's branches off the way.
struct SideBranchPoint {
  Vec3 centre;
  double radius;
};
std::vector<SideBranchPoint> side_branch_points(const vessels::Centerline& centerline,
                                                const vessels::CenterlinePath& way);

/// Sections between arc lengths `from` and `to` of the way, `spacing` (mm) apart.
///
/// The axis before is the way, smoothed over half its mean radius and then moved sideways, twice,
/// to the centroids of its sections. After, every point of it goes sideways with the centroid of
/// its section: where the two surfaces have the same triangles, the outline is carried with the
/// wall; otherwise the surface after is cut where the axis is by then, three times. An axis never
/// moves along itself, so stations stay at their places.
///
/// A section runs into a branch when a point of its outline belongs to one: it lies within 1.5
/// radii of the branch's centerline outside this lumen's inscribed circle, and its power distance
/// |x - c|^2 - r^2 to that is smaller than to this lumen's.
Profile sample_profile(const CutSurface& before, const CutSurface& after, bool same_triangles,
                       const vessels::Centerline& centerline, const vessels::CenterlinePath& way,
                       double from, double to, double spacing);

}  // namespace vstent::measure
