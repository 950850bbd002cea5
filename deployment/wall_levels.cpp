#include "deployment/wall_levels.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <set>

#include "sdf/mesh_distance.hpp"
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

/// Axes of a triangle: along its first edge, across, and its normal; columns.
Eigen::Matrix3d frame(const Vec3& a, const Vec3& b, const Vec3& c) {
  Eigen::Matrix3d axes;
  const Vec3 along = (b - a).normalized();
  const Vec3 normal = (b - a).cross(c - a).normalized();
  axes << along, normal.cross(along), normal;
  return axes;
}

}  // namespace

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
  const sdf::MeshDistance surface({coarse.points, coarse.triangles});
  for (std::size_t v = 0; v < rest_.size(); ++v) {
    if (fine.pinned[v]) continue;
    const auto nearest = surface.closest(rest_[v]);
    if (nearest.triangle < 0) continue;
    Anchor& anchor = anchors_[v];
    anchor.corners = coarse.triangles[at(nearest.triangle)];
    const auto corner = [&](std::size_t k) { return coarse.points[at(anchor.corners[k])]; };
    const Vec3 a = corner(0), ab = corner(1) - a, ac = corner(2) - a, ap = nearest.point - a;
    const Vec3 normal = ab.cross(ac);
    const double squared = normal.squaredNorm();
    if (!(squared > 0)) {
      anchor.corners = {-1, -1, -1};
      continue;
    }
    anchor.weights.y() = ap.cross(ac).dot(normal) / squared;
    anchor.weights.z() = ab.cross(ap).dot(normal) / squared;
    anchor.weights.x() = 1 - anchor.weights.y() - anchor.weights.z();
    anchor.offset = frame(corner(0), corner(1), corner(2)).transpose() * (rest_[v] - nearest.point);
  }
}

std::vector<Vec3> Prolongation::operator()(std::span<const Vec3> coarse_positions) const {
  std::vector<Vec3> fine(rest_);
  for (std::size_t v = 0; v < fine.size(); ++v) {
    const Anchor& anchor = anchors_[v];
    if (anchor.corners[0] < 0) continue;
    const auto corner = [&](std::size_t k) { return coarse_positions[at(anchor.corners[k])]; };
    fine[v] = anchor.weights.x() * corner(0) + anchor.weights.y() * corner(1) +
              anchor.weights.z() * corner(2) +
              frame(corner(0), corner(1), corner(2)) * anchor.offset;
  }
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
