#include "vessels/idealised.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <stdexcept>

namespace vstent::vessels {
namespace {

struct AxisPlace {
  Vec3 point;
  Vec3 tangent;
  Vec3 inward;  // towards the centre of the bend, in the plane of the axis
};

AxisPlace axis_place(const IdealisedVessel& vessel, double s) {
  const double arc_start = 0.25 * vessel.length;
  const double arc_length = 0.5 * vessel.length;
  const double angle = vessel.bend_angle * std::clamp((s - arc_start) / arc_length, 0.0, 1.0);
  const Vec3 tangent(std::sin(angle), 0, std::cos(angle));
  const Vec3 inward(std::cos(angle), 0, -std::sin(angle));
  if (vessel.bend_angle == 0) return {Vec3(0, 0, s), tangent, inward};
  const double bend_radius = arc_length / vessel.bend_angle;
  const Vec3 on_arc(bend_radius * (1 - std::cos(angle)), 0,
                    arc_start + bend_radius * std::sin(angle));
  const double straight = s < arc_start ? s - arc_start : std::max(0.0, s - arc_start - arc_length);
  return {on_arc + straight * tangent, tangent, inward};
}

}  // namespace

double idealised_radius(const IdealisedVessel& vessel, double s) {
  const double u = (s - 0.5 * vessel.length) / (0.5 * vessel.stenosis_length);
  if (std::abs(u) >= 1) return vessel.radius;
  return vessel.radius * (1 - 0.5 * vessel.stenosis * (1 + std::cos(std::numbers::pi * u)));
}

Polyline idealised_axis(const IdealisedVessel& vessel, double spacing) {
  const int pieces = std::max(1, static_cast<int>(std::ceil(vessel.length / spacing)));
  Polyline axis;
  for (int i = 0; i <= pieces; ++i)
    axis.push_back(axis_place(vessel, vessel.length * i / pieces).point);
  return axis;
}

TriangleMesh idealised_vessel(const IdealisedVessel& vessel) {
  if (!(vessel.radius > 0) || !(vessel.length > 0) || !(vessel.edge_length > 0) ||
      !(vessel.stenosis >= 0) || !(vessel.stenosis < 1) || !(vessel.stenosis_length > 0) ||
      !(vessel.eccentricity >= 0) || !(vessel.eccentricity <= 1)) {
    throw std::invalid_argument(
        "idealised vessel: sizes must be positive, stenosis in [0, 1), eccentricity in [0, 1]");
  }
  if (!(std::abs(vessel.bend_angle) * vessel.radius < 0.5 * vessel.length)) {
    throw std::invalid_argument("idealised vessel: the bend is tighter than the vessel is wide");
  }
  const int around = std::max(
      8, static_cast<int>(std::lround(2 * std::numbers::pi * vessel.radius / vessel.edge_length)));
  const double row_height = vessel.edge_length * std::sqrt(3.0) / 2;
  const int rows = std::max(2, static_cast<int>(std::lround(vessel.length / row_height)));
  TriangleMesh mesh;
  for (int row = 0; row <= rows; ++row) {
    const double s = vessel.length * row / rows;
    const AxisPlace place = axis_place(vessel, s);
    const double radius = idealised_radius(vessel, s);
    const Vec3 centre = place.point + vessel.eccentricity * (vessel.radius - radius) * place.inward;
    const Vec3 side = place.tangent.cross(place.inward);
    for (int k = 0; k < around; ++k) {
      const double angle = 2 * std::numbers::pi * (k + 0.5 * (row % 2)) / around;
      mesh.points.push_back(centre +
                            radius * (std::cos(angle) * place.inward + std::sin(angle) * side));
    }
  }
  const auto vertex = [around](int row, int k) {
    return row * around + (k % around + around) % around;
  };
  for (int row = 0; row < rows; ++row) {
    for (int k = 0; k < around; ++k) {
      // Odd rows sit half an edge further round, so the diagonals alternate from row to row.
      if (row % 2 == 0) {
        mesh.triangles.push_back({vertex(row, k), vertex(row, k + 1), vertex(row + 1, k)});
        mesh.triangles.push_back({vertex(row, k + 1), vertex(row + 1, k + 1), vertex(row + 1, k)});
      } else {
        mesh.triangles.push_back({vertex(row, k), vertex(row + 1, k + 1), vertex(row + 1, k)});
        mesh.triangles.push_back({vertex(row, k), vertex(row, k + 1), vertex(row + 1, k + 1)});
      }
    }
  }
  return mesh;
}

}  // namespace vstent::vessels
