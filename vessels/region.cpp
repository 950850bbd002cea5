#include "vessels/region.hpp"

#include <algorithm>
#include <map>
#include <stdexcept>

#include "sdf/mesh_distance.hpp"
#include "sdf/polyline.hpp"

namespace vstent::vessels {
namespace {

using Edge = std::pair<int, int>;

Edge edge_of(int a, int b) { return a < b ? Edge{a, b} : Edge{b, a}; }

template <class Visit>
void for_each_edge(const Triangle& triangle, Visit&& visit) {
  for (std::size_t k = 0; k < 3; ++k) visit(edge_of(triangle[k], triangle[(k + 1) % 3]));
}

std::vector<std::vector<int>> triangles_around(const TriangleMesh& mesh) {
  std::vector<std::vector<int>> around(mesh.points.size());
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    for (const int vertex : mesh.triangles[t])
      around[static_cast<std::size_t>(vertex)].push_back(static_cast<int>(t));
  }
  return around;
}

/// 1 for vertices on a free edge or on a fixed triangle.
std::vector<char> held_vertices(const TriangleMesh& mesh, std::span<const char> fixed) {
  std::map<Edge, int> uses;
  std::vector<char> held(mesh.points.size(), 0);
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    for_each_edge(mesh.triangles[t], [&](const Edge& edge) { ++uses[edge]; });
    if (!fixed.empty() && fixed[t]) {
      for (const int vertex : mesh.triangles[t]) held[static_cast<std::size_t>(vertex)] = 1;
    }
  }
  for (const auto& [edge, count] : uses) {
    if (count == 1)
      held[static_cast<std::size_t>(edge.first)] = held[static_cast<std::size_t>(edge.second)] = 1;
  }
  return held;
}

/// 1 for vertices no further from the axis than `reach` (mm, per axis point) and `further`.
std::vector<char> vertices_within(const TriangleMesh& mesh, const Polyline& axis,
                                  std::span<const double> reach, double further) {
  const std::vector<double> arc = arc_lengths(axis);
  Box near_axis;
  for (std::size_t i = 0; i < axis.size(); ++i) {
    Box ball;
    ball.include(axis[i]);
    ball.pad(reach[i] + further);
    near_axis.include(ball);
  }
  std::vector<char> within(mesh.points.size(), 0);
  for (std::size_t v = 0; v < mesh.points.size(); ++v) {
    if (near_axis.squared_distance(mesh.points[v]) > 0) continue;
    const PolylinePlace place = nearest_place(axis, arc, mesh.points[v]);
    const double limit = value_at(reach, arc, place.arc_length) + further;
    within[v] = place.squared_distance <= limit * limit;
  }
  return within;
}

}  // namespace

Region find_region(const TriangleMesh& mesh, std::span<const char> fixed, const Polyline& axis,
                   std::span<const double> reach, const GivingWay& giving_way) {
  const std::vector<double> arc = arc_lengths(axis);
  const std::vector<char> held = held_vertices(mesh, fixed);
  std::vector<char> within = vertices_within(mesh, axis, reach, 0);

  Region region;
  const std::vector<std::vector<int>> around = triangles_around(mesh);
  const Vec3 middle = point_at(axis, arc, 0.5 * arc.back());
  const int seed_triangle = sdf::MeshDistance(mesh).closest(middle).triangle;
  std::vector<char> movable(mesh.points.size(), 0);
  std::vector<int> front;
  const auto admit = [&](int vertex) {
    const auto v = static_cast<std::size_t>(vertex);
    if (!within[v] || movable[v]) return;
    if (held[v]) {
      region.meets_opening = true;
      return;
    }
    movable[v] = 1;
    front.push_back(vertex);
  };
  for (const int vertex : mesh.triangles[static_cast<std::size_t>(seed_triangle)]) admit(vertex);
  const auto admit_what_is_joined = [&] {
    while (!front.empty()) {
      const int vertex = front.back();
      front.pop_back();
      for (const int t : around[static_cast<std::size_t>(vertex)]) {
        for (const int other : mesh.triangles[static_cast<std::size_t>(t)]) admit(other);
      }
    }
  };
  admit_what_is_joined();
  const std::vector<char> own = movable;
  if (!giving_way.axis.empty()) {
    const std::vector<char> reached = vertices_within(mesh, giving_way.axis, giving_way.reach, 0);
    const bool cut_short = region.meets_opening;
    within = vertices_within(mesh, axis, reach, giving_way.further);
    for (std::size_t v = 0; v < reached.size(); ++v)
      if (reached[v] && !own[v]) admit(static_cast<int>(v));
    admit_what_is_joined();
    region.meets_opening = cut_short;
  }

  // All triangles at a movable vertex, and those across their edges: pinned support for hinges
  // along the rim.
  std::vector<char> taken(mesh.triangles.size(), 0);
  std::map<Edge, int> rim;
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    const Triangle& triangle = mesh.triangles[t];
    taken[t] = std::any_of(triangle.begin(), triangle.end(),
                           [&](int v) { return movable[static_cast<std::size_t>(v)]; });
    if (taken[t]) for_each_edge(triangle, [&](const Edge& edge) { ++rim[edge]; });
  }
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    if (taken[t]) continue;
    bool adjoins = false;
    for_each_edge(mesh.triangles[t], [&](const Edge& edge) {
      const auto found = rim.find(edge);
      adjoins |= found != rim.end() && found->second == 1;
    });
    if (adjoins) taken[t] = 1;
  }

  std::vector<int> patch_vertex(mesh.points.size(), -1);
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    if (!taken[t]) continue;
    region.triangle_ids.push_back(static_cast<int>(t));
    for (const int vertex : mesh.triangles[t]) patch_vertex[static_cast<std::size_t>(vertex)] = 0;
  }
  for (std::size_t v = 0; v < mesh.points.size(); ++v) {
    if (patch_vertex[v] < 0) continue;
    patch_vertex[v] = static_cast<int>(region.vertices.size());
    region.vertices.push_back(static_cast<int>(v));
    region.pinned.push_back(!movable[v]);
    region.beside.push_back(movable[v] && !own[v]);
  }
  std::vector<double> edges;
  for (const int t : region.triangle_ids) {
    Triangle triangle = mesh.triangles[static_cast<std::size_t>(t)];
    for_each_edge(triangle, [&](const Edge& edge) {
      edges.push_back((mesh.points[static_cast<std::size_t>(edge.first)] -
                       mesh.points[static_cast<std::size_t>(edge.second)])
                          .norm());
    });
    for (int& vertex : triangle) vertex = patch_vertex[static_cast<std::size_t>(vertex)];
    region.triangles.push_back(triangle);
  }
  if (std::all_of(region.pinned.begin(), region.pinned.end(), [](char pinned) { return pinned; })) {
    throw std::invalid_argument("no part of the wall within reach of the stent may move");
  }
  std::nth_element(edges.begin(), edges.begin() + static_cast<std::ptrdiff_t>(edges.size() / 2),
                   edges.end());
  region.median_edge = edges[edges.size() / 2];
  return region;
}

}  // namespace vstent::vessels
