#include "measure/apposition.hpp"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>

#include "measure/corners.hpp"
#include "sdf/polyline.hpp"
#include "sdf/signed_mesh_distance.hpp"

namespace vstent::measure {
namespace {

/// One abluminal facet; `over_opening` where no wall is near or ahead.
struct Facet {
  double area = 0, gap = 0;
  bool over_opening = false;
};

}  // namespace

StentBody::StentBody(sdf::LevelSet level_set)
    : level_set_(std::move(level_set)), surface_(level_set_.surface()), to_surface_(surface_) {}

std::vector<double> StentBody::distances(std::span<const Vec3> points) const {
  std::vector<double> result(points.size());
  const double band = level_set_.background();
  constexpr std::size_t kGrain = 256;
  const auto fill = [&](std::size_t first, std::size_t end) {
    // The neighbour's distance and the way to it bound this one from above.
    double last = std::numeric_limits<double>::infinity();
    for (std::size_t i = first; i < end; ++i) {
      const double sampled = level_set_.sample(points[i]).distance;
      result[i] = sampled;
      if (std::abs(sampled) >= 0.999 * band) {
        const double limit =
            i == first ? last : (last + (points[i] - points[i - 1]).norm()) * (1 + 1e-9) + 1e-9;
        result[i] = std::copysign(to_surface_.closest(points[i], limit).distance, sampled);
      }
      last = std::abs(result[i]);
    }
  };
  tbb::parallel_for(std::size_t{0}, (points.size() + kGrain - 1) / kGrain, [&](std::size_t block) {
    fill(block * kGrain, std::min((block + 1) * kGrain, points.size()));
  });
  return result;
}

AppositionMetrics measure_apposition(const StentBody& stent, const CutSurface& after,
                                     const Polyline& axis_after,
                                     std::span<const double> vertex_distances) {
  const TriangleMesh& surface = stent.surface();
  const std::vector<double> arc = arc_lengths(axis_after);
  const std::vector<Vec3> directions = tangents(axis_after);
  const TriangleMesh& wall = after.surface.mesh;
  const sdf::BoxTree wall_tree = sdf::triangle_tree(wall);
  std::vector<Facet> facets(surface.triangles.size());
  tbb::parallel_for(std::size_t{0}, facets.size(), [&](std::size_t t) {
    const auto x = corners(surface, t);
    const Vec3 area = area_vector(x), middle = centroid(x);
    const Vec3 normal = area.normalized();
    const PolylinePlace place = nearest_place(axis_after, arc, middle);
    const Vec3& along = directions[at(place.segment)];
    Vec3 out = middle - point_at(axis_after, arc, place.arc_length);
    out -= out.dot(along) * along;  // the axis goes on straight beyond its ends
    if (!(area.norm() > 0) || normal.dot(out) < std::sqrt(0.5) * out.norm()) return;
    const Vec3 to_wall = after.ends.wall->closest(middle).point - middle;
    Facet& facet = facets[t];
    facet.area = area.norm();
    facet.gap = std::copysign(to_wall.norm(), to_wall.dot(normal));
    facet.over_opening =
        facet.gap > kAppositionGaps.front() &&
        !std::isfinite(sdf::first_crossing(wall, wall_tree, middle, normal, out.norm()));
  });
  AppositionMetrics m;
  double over_openings = 0, sum = 0;
  for (const Facet& f : facets) {
    if (f.over_opening) {
      over_openings += f.area;
      continue;
    }
    m.area += f.area;
    sum += f.area * std::max(0.0, f.gap);
    m.largest_gap = std::max(m.largest_gap, f.area > 0 ? f.gap : 0);
    for (std::size_t k = 0; k < kAppositionGaps.size(); ++k)
      m.share_with_gap[k] += f.gap > kAppositionGaps[k] ? f.area : 0;
  }
  if (m.area > 0) {
    m.mean_gap = sum / m.area;
    for (double& share : m.share_with_gap) share *= 100 / m.area;
  }
  if (m.area + over_openings > 0) m.over_openings = 100 * over_openings / (m.area + over_openings);
  for (const double distance : vertex_distances)
    m.deepest_penetration = std::max(m.deepest_penetration, -distance);
  return m;
}

}  // namespace vstent::measure
