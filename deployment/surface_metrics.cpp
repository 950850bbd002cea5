#include "deployment/surface_metrics.hpp"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>

#include "measure/moved_wall.hpp"
#include "sdf/signed_mesh_distance.hpp"

namespace vstent::deployment {
namespace {

/// A piece of the outer surface.
struct Piece {
  Vec3 point, outward;
  double area;
};

/// Facets that face away from the axis, in pieces no larger than the struts are wide.
std::vector<Piece> outer_surface(const SurfaceDesign& design, const stents::SurfaceMap& map) {
  const TriangleMesh& straight = design.surface.mesh;
  std::vector<Piece> pieces;
  for (const Triangle& t : straight.triangles) {
    const Vec3& a = straight.points[static_cast<std::size_t>(t[0])];
    const Vec3& b = straight.points[static_cast<std::size_t>(t[1])];
    const Vec3& c = straight.points[static_cast<std::size_t>(t[2])];
    const Vec3 centre = (a + b + c) / 3, normal = (b - a).cross(c - a);
    const Vec3 radial = Vec3(centre.x(), centre.y(), 0).normalized();
    if (!(normal.dot(radial) > kOuterFacet * normal.norm())) continue;
    const Vec3 pa = map.placed(a), pb = map.placed(b), pc = map.placed(c);
    const double size = std::max({(pb - pa).norm(), (pc - pb).norm(), (pa - pc).norm()});
    const int parts = std::max(1, static_cast<int>(std::ceil(size / design.width)));
    const double area = 0.5 * (pb - pa).cross(pc - pa).norm() / (parts * parts);
    const auto add = [&](double u, double v) {
      const Vec3 x = a + u / parts * (b - a) + v / parts * (c - a);
      const Vec3 placed = map.placed(x);
      // Radial lines stay radial lines at their own scale.
      const Vec3 out = Vec3(x.x(), x.y(), 0).normalized();
      pieces.push_back({placed, map.placed(Vec3(x + out)) - placed, area});
    };
    for (int i = 0; i < parts; ++i) {
      for (int j = 0; i + j < parts; ++j) {
        add(i + 1.0 / 3, j + 1.0 / 3);
        if (i + j + 1 < parts) add(i + 2.0 / 3, j + 2.0 / 3);
      }
    }
  }
  return pieces;
}

}  // namespace

StrutMetrics measure_surface(const TriangleMesh& wall_mesh, std::span<const char> wall_triangles,
                             const SurfaceDesign& design, const stents::SurfaceMap& map,
                             const StentEnvelope& envelope) {
  StrutMetrics metrics;
  const measure::MovedWall wall(wall_mesh, wall_triangles);
  const double radius = map.largest_radius();
  const double half = 0.5 * design.thickness;

  const std::vector<Piece> pieces = outer_surface(design, map);
  measure::GapSums gaps;
  std::vector<double> gap(pieces.size());
  tbb::parallel_for(std::size_t{0}, pieces.size(), [&](std::size_t i) {
    const Vec3 from = pieces[i].point - half * pieces[i].outward;
    double ahead = wall.ahead(from, pieces[i].outward, 3 * half);
    if (!std::isfinite(ahead)) ahead = wall.ahead(from, pieces[i].outward, radius + half);
    gap[i] = ahead - half;
  });
  for (std::size_t i = 0; i < pieces.size(); ++i) gaps.add(gap[i], pieces[i].area);
  metrics.outer_area = gaps.all;
  gaps.put_into(metrics);

  const double strut = std::min(design.width, design.thickness);
  const std::vector<Vec3> samples = wall.sampled(0.25 * strut);
  const std::vector<double> depth = measure::depths(samples, envelope.axis, envelope.radii);
  const std::vector<Vec3> near = measure::put_prolapse(samples, depth, 2 * strut, metrics);
  std::vector<double> distance(near.size());
  sdf::SignedMeshDistance(map.placed(design.surface.mesh)).distances(near, distance);
  for (const double d : distance)
    metrics.deepest_penetration = std::max(metrics.deepest_penetration, -d);
  return metrics;
}

}  // namespace vstent::deployment
