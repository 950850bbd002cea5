// What did the stent do? Measured on two surfaces, before and after, whatever made them.
#pragma once

#include <filesystem>
#include <nlohmann/json_fwd.hpp>

#include "measure/apposition.hpp"
#include "measure/lumen.hpp"
#include "measure/mesh_certificate.hpp"
#include "measure/shape.hpp"
#include "measure/side_branches.hpp"
#include "measure/stented_wall.hpp"
#include "measure/strut_metrics.hpp"

namespace vstent::measure {

/// What is compared, and what is known of the stent. Lengths in mm.
struct Comparison {
  const vessels::Surface& before;
  const vessels::Surface& after;
  const vessels::Centerline& centerline;  ///< of `before`, radii known
  const StentBody* stent = nullptr;       ///< null: not known
  vessels::CenterlinePath way = {};       ///< through the treated place; empty: found
  Polyline stent_axis_before = {}, stent_axis_after = {};  ///< its own; empty: not known
  std::vector<double> target = {};  ///< nominal lumen diameter per point of that axis
  double nominal_diameter = 0;      ///< instead, one for the whole stent; 0: not known
  std::vector<char> movable = {};   ///< per vertex, 1 in the patch; empty: not known
};

/// A stent that was made from a design, for what only the design knows.
struct StentMetrics {
  std::optional<double> length, nominal_length, foreshortening, recoil;  ///< mm, mm, %, %
};

/// A figure that is nothing or 0 for want of input is null in metrics.json, with the reason.
struct Metrics : LumenMetrics, ShapeMetrics, MeshMetrics {
  bool has_stent = false;
  bool changed = false;  ///< the treated length is known: by the stent or by what moved
  StentMetrics stent;
  std::optional<AppositionMetrics> apposition;
  double deepest_penetration = 0;   ///< mm, that of the apposition
  std::optional<WallMetrics> wall;  ///< only where the triangles are the same
  std::optional<double> neighbours_before, neighbours_after;  ///< mm; nothing: none within reach
  double neighbours_within = 0;                               ///< mm
  std::vector<SideBranch> branches;
  std::optional<StrutMetrics> struts;  ///< nothing for a smooth tube
};

struct Measurement {
  Metrics metrics;
  vessels::Fields vertex_fields, triangle_fields;  ///< for the surface after
};

/// \throws Error (geometry) where the two surfaces cannot be the same vessel in the same unit, the
/// stent lies elsewhere, or the centerline is none of this vessel
Measurement measure(const Comparison& comparison);

}  // namespace vstent::measure
