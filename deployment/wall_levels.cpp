#include "deployment/wall_levels.hpp"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <set>

#include "sdf/box_tree.hpp"
#include "sdf/nearest.hpp"
#include "vessels/check.hpp"
#include "xpbd/neighbourhoods.hpp"

namespace vstent::deployment {
namespace {

// Vertices of the coarsest level: small enough to grow in next to no time, fine enough to follow
// the vessel. Levels between have at most about a ninth of the next one's vertices, edges three
// times as long.
constexpr double kCoarsest = 1500;
constexpr double kLargestRatio = 9;
// A wall of so many times the coarsest's vertices is coarse enough itself.
constexpr double kCoarseEnough = 4.5;

std::size_t at(int i) { return static_cast<std::size_t>(i); }

xpbd::Graph graph_of(const WallMesh& mesh) {
  std::set<std::pair<int, int>> edges;
  for (const Triangle& t : mesh.triangles)
    for (std::size_t k = 0; k < 3; ++k)
      if (t[k] != t[(k + 1) % 3]) edges.insert(std::minmax(t[k], t[(k + 1) % 3]));
  std::vector<xpbd::GraphEdge> lengths;
  for (const auto& [i, j] : edges)
    lengths.push_back({i, j, (mesh.points[at(i)] - mesh.points[at(j)]).norm()});
  return xpbd::make_graph(mesh.points.size(), lengths);
}

/// Twice the area long.
Vec3 area_normal(std::span<const Vec3> points, const Triangle& t) {
  return (points[at(t[1])] - points[at(t[0])]).cross(points[at(t[2])] - points[at(t[0])]);
}

/// Axes of a triangle: along its first edge, across, and its normal; columns.
Eigen::Matrix3d frame(std::span<const Vec3> points, const Triangle& t) {
  const Vec3 along = (points[at(t[1])] - points[at(t[0])]).normalized();
  const Vec3 normal = area_normal(points, t).normalized();
  Eigen::Matrix3d axes;
  axes << along, normal.cross(along), normal;
  return axes;
}

Vec3 weighted(std::span<const Vec3> points, const Triangle& t, const Vec3& weights) {
  return weights.x() * points[at(t[0])] + weights.y() * points[at(t[1])] +
         weights.z() * points[at(t[2])];
}

}  // namespace

WallMesh patch_of(const Setup& setup) {
  WallMesh patch{{}, setup.region.triangles, setup.region.pinned, setup.material};
  for (const int v : setup.region.vertices)
    patch.points.push_back(setup.surface.mesh.points[at(v)]);
  return patch;
}

xpbd::SurfaceOfWall surface_of(const WallMesh& wall) {
  return {wall.triangles, wall.material.thickness, wall.material.youngs_modulus};
}

bool crosses_itself(const WallMesh& wall) {
  return !vessels::self_intersections({wall.points, wall.triangles}).empty();
}

WallMesh coarsened(const WallMesh& fine, double spacing) {
  // The rim first: what is held there is then known as finely as the rest.
  std::vector<int> order;
  for (const bool pinned : {true, false})
    for (std::size_t v = 0; v < fine.points.size(); ++v)
      if ((fine.pinned[v] != 0) == pinned) order.push_back(static_cast<int>(v));
  const xpbd::Neighbourhoods cells = xpbd::find_neighbourhoods(graph_of(fine), order, spacing);
  WallMesh coarse;
  for (const int seed : cells.seeds) {
    coarse.points.push_back(fine.points[at(seed)]);
    coarse.pinned.push_back(fine.pinned[at(seed)]);
    coarse.material.youngs_modulus.push_back(fine.material.youngs_modulus[at(seed)]);
    coarse.material.thickness.push_back(fine.material.thickness[at(seed)]);
  }
  std::set<Triangle> known;
  for (const Triangle& t : fine.triangles) {
    const Triangle joined{cells.home[at(t[0])], cells.home[at(t[1])], cells.home[at(t[2])]};
    if (joined[0] == joined[1] || joined[1] == joined[2] || joined[2] == joined[0]) continue;
    Triangle sorted = joined;
    std::sort(sorted.begin(), sorted.end());
    if (known.insert(sorted).second) coarse.triangles.push_back(joined);
  }
  return coarse;
}

Prolongation::Prolongation(const WallMesh& coarse, const WallMesh& fine)
    : rest_(fine.points), anchors_(fine.points.size()) {
  std::vector<Box> boxes;
  std::vector<Vec3> facing;
  for (const Triangle& t : coarse.triangles) {
    Box& box = boxes.emplace_back();
    for (const int v : t) box.include(coarse.points[at(v)]);
    facing.push_back(area_normal(coarse.points, t));
  }
  std::vector<Vec3> normals(rest_.size(), Vec3::Zero());
  for (const Triangle& t : fine.triangles)
    for (const int v : t) normals[at(v)] += area_normal(fine.points, t);
  const sdf::BoxTree tree(boxes);
  tbb::parallel_for(std::size_t{0}, rest_.size(), [&](std::size_t v) {
    if (fine.pinned[v]) return;
    const auto weights = [&](int triangle) {
      const Triangle& t = coarse.triangles[at(triangle)];
      return nearest_on_triangle(rest_[v], coarse.points[at(t[0])], coarse.points[at(t[1])],
                                 coarse.points[at(t[2])]);
    };
    const auto offset = [&](int triangle) {
      return Vec3(rest_[v] -
                  weighted(coarse.points, coarse.triangles[at(triangle)], weights(triangle)));
    };
    const auto squared_distance = [&](int triangle) { return offset(triangle).squaredNorm(); };
    auto found = tree.nearest(rest_[v], [&](int triangle) {
      return facing[at(triangle)].dot(normals[v]) > 0 ? squared_distance(triangle)
                                                      : std::numeric_limits<double>::infinity();
    });
    if (found.item < 0) found = tree.nearest(rest_[v], squared_distance);
    if (found.item < 0 || !(facing[at(found.item)].squaredNorm() > 0)) return;
    const Triangle& corners = coarse.triangles[at(found.item)];
    anchors_[v] = {corners, weights(found.item),
                   frame(coarse.points, corners).transpose() * offset(found.item)};
  });
}

std::vector<Vec3> Prolongation::operator()(std::span<const Vec3> coarse_positions) const {
  std::vector<Vec3> fine(rest_);
  tbb::parallel_for(std::size_t{0}, fine.size(), [&](std::size_t v) {
    const Anchor& anchor = anchors_[v];
    if (anchor.corners[0] < 0) return;
    fine[v] = weighted(coarse_positions, anchor.corners, anchor.weights) +
              frame(coarse_positions, anchor.corners) * anchor.offset;
  });
  return fine;
}

std::vector<double> level_spacings(std::size_t vertices, double median_edge) {
  const double surplus = static_cast<double>(vertices) / kCoarsest;
  if (surplus <= kCoarseEnough) return {};
  const int levels =
      static_cast<int>(std::ceil(std::log(surplus) / std::log(kLargestRatio) - 0.25));
  std::vector<double> spacings;
  for (int level = 0; level < levels; ++level)  // evenly, by the square root of the vertices
    spacings.push_back(median_edge * std::pow(surplus, 0.5 * (levels - level) / levels));
  return spacings;
}

}  // namespace vstent::deployment
