// Lumen centerlines: read from VMTK, SimVascular or a bare polyline, or extracted from the lumen itself.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "vessels/surface.hpp"

namespace vstent::vessels {

/// A stretch of lumen axis between ends and bifurcations, with the radius (mm) of the largest inscribed sphere per point.
struct CenterlineBranch {
  int id = 0;            ///< equals its place in Centerline::branches
  int parent = -1;       ///< -1: starts at the inlet; otherwise begins on the last point of that branch
  Polyline points;
  std::vector<double> radii;
};

/// A tree of branches, parents before children; branch 0 begins at the inlet.
struct Centerline {
  std::vector<CenterlineBranch> branches;
};

/// A way through the tree from the inlet to one leaf, as one polyline.
struct CenterlinePath {
  Polyline points;
  std::vector<double> radii;
  std::vector<int> branch_of_point;
  std::vector<double> arc_length;  ///< from the path's start, mm
};

/// The nearest place on a centerline.
struct CenterlinePlace {
  int branch = -1;
  double arc_length = 0;  ///< along that branch, mm
  Vec3 point = Vec3::Zero();
  double radius = 0;
  double distance = 0;    ///< from the asked point
};

/// All paths from the inlet to the leaves that run through `branch` (or all paths for -1), widest way first at forks.
std::vector<CenterlinePath> paths(const Centerline& centerline, int branch = -1);
CenterlinePlace nearest_place(const Centerline& centerline, const Vec3& point);

/// Lines that run together count as one until they part. The inlet is the end with the largest radius, or without radii
/// the first point of the first line. Radii that the file does not have are 0: unknown (see fill_radii).
/// \throws Error (input_file) for a file that is no centerline; (geometry) for fewer than two points, loops, NaN
Centerline read_centerline(const std::filesystem::path& path, LengthUnit unit);

/// Gives points of unknown radius (0: the file had none) their distance to the surface's wall, caps left out.
void fill_radii(Centerline& centerline, const Surface& surface);

struct ExtractionOptions {
  std::optional<Vec3> inlet;  ///< a point near the opening or cap to start from; default: the widest
  double point_spacing = 0;   ///< mm; 0: a fifth of the smallest radius
};
/// Paths of least integral of 1/radius through the lumen from the inlet to every other end, centred on the wall distance's
/// ridge, smoothed, and split where they part. Open or capped surfaces; closed ones without caps use the tree's tips.
/// \throws Error (geometry) when no two ends are found or the lumen is not connected at the resolution that memory allows
Centerline extract_centerline(const Surface& surface, const ExtractionOptions& options = {});

/// .vtp, one polyline per branch with MaximumInscribedSphereRadius, BranchId, ParentId; in `unit`.
void write_centerline(const Centerline& centerline, LengthUnit unit, const std::filesystem::path& path);

}  // namespace vstent::vessels
