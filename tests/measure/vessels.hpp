// Vessels whose measures have closed forms, with their centerlines.
#pragma once

#include <cmath>
#include <numbers>

#include "measure/measure.hpp"
#include "sdf/polyline.hpp"
#include "tests/vessels/shapes.hpp"
#include "vessels/idealised.hpp"

namespace vstent::tests {

/// A vessel of one branch: its surface and the centerline it was made around.
struct TestVessel {
  vessels::Surface surface;
  vessels::Centerline centerline;
};

inline TestVessel vessel_of(TriangleMesh mesh, Polyline axis, std::vector<double> radii) {
  vessels::CenterlineBranch branch;
  branch.points = std::move(axis);
  branch.radii = std::move(radii);
  return {vessels::make_surface(std::move(mesh), "vessel"), {{branch}}};
}

inline Polyline straight_axis(double length, int pieces) {
  Polyline axis;
  for (int i = 0; i <= pieces; ++i) axis.emplace_back(0, 0, length * i / pieces);
  return axis;
}

/// A tube along z of `around` sides; radius from `radius(z)`.
template <class Radius>
TestVessel lathe(double length, int around, int rings, Radius&& radius) {
  TriangleMesh mesh = tube(1, length, around, rings);
  for (Vec3& x : mesh.points) x.head<2>() *= radius(x.z());
  const Polyline axis = straight_axis(length, rings - 1);
  std::vector<double> radii;
  for (const Vec3& x : axis) radii.push_back(radius(x.z()) * std::cos(std::numbers::pi / around));
  return vessel_of(std::move(mesh), axis, radii);
}

inline TestVessel idealised(const vessels::IdealisedVessel& vessel) {
  Polyline axis = vessels::idealised_axis(vessel, 0.5);
  std::vector<double> radii;
  for (const double s : arc_lengths(axis)) radii.push_back(vessels::idealised_radius(vessel, s));
  return vessel_of(vessels::idealised_vessel(vessel), std::move(axis), std::move(radii));
}

/// A straight smooth stent along z.
inline measure::StentBody straight_stent(double from, double to, double radius,
                                         double voxel = 0.2) {
  const Polyline axis{Vec3(0, 0, from), Vec3(0, 0, 0.5 * (from + to)), Vec3(0, 0, to)};
  return measure::StentBody(
      sdf::voxelise(sdf::make_tube(axis, {radius, radius, radius}), {voxel, 3}));
}

/// A trunk of radius 4 along z, 40 long, and a branch of radius 2 that leaves it at z = 20 in the
/// x-z plane, `angle` (rad) from the trunk's direction: the surface of their union's level set.
constexpr double kTrunk = 4, kBranch = 2, kFork = 20, kForkVoxel = 0.4;
inline TestVessel forked(double angle) {
  const Vec3 along(std::sin(angle), 0, std::cos(angle));
  const auto line = [](const Vec3& from, const Vec3& to) {
    Polyline points;
    const int pieces = static_cast<int>(std::ceil((to - from).norm() / 0.5));
    for (int i = 0; i <= pieces; ++i) points.push_back(from + (to - from) * i / pieces);
    return points;
  };
  const Vec3 fork(0, 0, kFork);
  const std::vector<Polyline> lines{line(Vec3::Zero(), fork), line(fork, Vec3(0, 0, 40)),
                                    line(fork, fork + 20 * along)};
  sdf::Solid solid;
  const auto add = [&](const Polyline& axis, double radius) {
    const sdf::Solid part = sdf::make_tube(axis, std::vector<double>(axis.size(), radius));
    const int caps = static_cast<int>(solid.caps.size());
    for (sdf::Segment segment : part.segments) {
      if (segment.start_cap >= 0) segment.start_cap += caps;
      if (segment.end_cap >= 0) segment.end_cap += caps;
      solid.segments.push_back(segment);
    }
    solid.caps.insert(solid.caps.end(), part.caps.begin(), part.caps.end());
  };
  add(line(Vec3::Zero(), Vec3(0, 0, 40)), kTrunk);
  add(lines[2], kBranch);
  TestVessel vessel;
  vessel.surface = vessels::make_surface(sdf::voxelise(solid, {kForkVoxel, 3}).surface(), "fork");
  for (int id = 0; id < 3; ++id) {
    vessels::CenterlineBranch branch;
    branch.id = id;
    branch.parent = id == 0 ? -1 : 0;
    branch.points = lines[static_cast<std::size_t>(id)];
    branch.radii.assign(branch.points.size(), id == 2 ? kBranch : kTrunk);
    vessel.centerline.branches.push_back(std::move(branch));
  }
  return vessel;
}

/// Area of the regular polygon of `sides` corners on a circle.
inline double polygon_area(int sides, double radius) {
  return 0.5 * sides * radius * radius * std::sin(2 * std::numbers::pi / sides);
}
inline double equivalent_diameter(double area) { return std::sqrt(4 * area / std::numbers::pi); }

}  // namespace vstent::tests
