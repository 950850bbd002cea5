#include "vessels/lumen_ends.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>

#include "vessels/check.hpp"
#include "vessels/half_edges.hpp"

namespace vstent::vessels {
namespace {

constexpr double kDegree = std::numbers::pi / 180.0;
constexpr double kFlatEdge = 3.0 * kDegree;  // neighbours that turn less belong to one planar patch
constexpr double kSharpRim = 25.0 * kDegree;  // a cap meets its wall at a larger angle, on average
constexpr double kCapPlanarity = 0.97;        // |sum of area vectors| / area; 1 for a plane
constexpr double kCapRoundness = 0.35;  // 4 pi area / rim^2; 1 for a circle, 0.36 for a 6:1 ellipse
constexpr double kLumenBehindEnd =
    1.5;  // radii: two radii behind an end the wall is no farther away

Vec3 area_vector(const TriangleMesh& mesh, const Triangle& t) {
  const auto& p = mesh.points;
  const Vec3 a = p[static_cast<std::size_t>(t[0])];
  return 0.5 * (p[static_cast<std::size_t>(t[1])] - a).cross(p[static_cast<std::size_t>(t[2])] - a);
}

double angle_between(const Vec3& a, const Vec3& b) {
  return std::atan2(a.cross(b).norm(), a.dot(b));
}

struct SharedEdge {
  int a = 0, b = 0;
  int left = -1, right = -1;
};

/// Edges between exactly two triangles, sorted.
std::vector<SharedEdge> shared_edges(const TriangleMesh& mesh) {
  std::vector<SharedEdge> edges;
  const std::vector<HalfEdge> half_edges = sorted_half_edges(mesh);
  for_each_edge(half_edges, [&](std::size_t begin, std::size_t end) {
    const HalfEdge& first = half_edges[begin];
    if (end - begin == 2)
      edges.push_back({first.low, first.high, first.triangle, half_edges[begin + 1].triangle});
  });
  return edges;
}

/// Patches grown over flat edges, as a patch number per triangle.
std::vector<int> planar_patches(std::size_t triangles, const std::vector<SharedEdge>& edges,
                                const std::vector<Vec3>& areas) {
  std::vector<int> root(triangles);
  std::iota(root.begin(), root.end(), 0);
  const auto find = [&](int t) {
    while (root[static_cast<std::size_t>(t)] != t) {
      auto& up = root[static_cast<std::size_t>(t)];
      up = root[static_cast<std::size_t>(up)];
      t = up;
    }
    return t;
  };
  for (const SharedEdge& edge : edges) {
    if (angle_between(areas[static_cast<std::size_t>(edge.left)],
                      areas[static_cast<std::size_t>(edge.right)]) > kFlatEdge) {
      continue;
    }
    const int a = find(edge.left);
    const int b = find(edge.right);
    root[static_cast<std::size_t>(std::max(a, b))] = std::min(a, b);
  }
  std::vector<int> patch(triangles);
  for (std::size_t t = 0; t < triangles; ++t) patch[t] = find(static_cast<int>(t));
  return patch;
}

struct Patch {
  Vec3 area_vector = Vec3::Zero();
  Vec3 moment = Vec3::Zero();  // sum of area * centroid
  double area = 0;
  double rim = 0;        // length of the edges to other patches
  double rim_angle = 0;  // length-weighted sum of the angles there
  std::size_t triangles = 0;
  bool reaches_boundary = false;

  bool is_cap() const {
    return !reaches_boundary && rim > 0 && area > 0 && area_vector.norm() > kCapPlanarity * area &&
           4.0 * std::numbers::pi * area > kCapRoundness * rim * rim && rim_angle > kSharpRim * rim;
  }
};

/// Marks the triangles of caps and appends their ends.
std::vector<char> find_caps(const Surface& surface, const std::vector<char>& at_boundary,
                            std::vector<LumenEnd>& ends) {
  const TriangleMesh& mesh = surface.mesh;
  const std::size_t count = mesh.triangles.size();
  std::vector<Vec3> areas(count);
  for (std::size_t t = 0; t < count; ++t) areas[t] = area_vector(mesh, mesh.triangles[t]);
  const std::vector<SharedEdge> edges = shared_edges(mesh);

  const auto caps_among = [&](const std::vector<int>& patch_of_triangle) {
    std::map<int, Patch> patches;
    double total_area = 0;
    for (std::size_t t = 0; t < count; ++t) {
      Patch& patch = patches[patch_of_triangle[t]];
      const Triangle& corners = mesh.triangles[t];
      const double area = areas[t].norm();
      Vec3 centroid = Vec3::Zero();
      for (const int corner : corners) {
        centroid += mesh.points[static_cast<std::size_t>(corner)] / 3.0;
      }
      patch.area_vector += areas[t];
      patch.moment += area * centroid;
      patch.area += area;
      ++patch.triangles;
      patch.reaches_boundary |= at_boundary[t] != 0;
      total_area += area;
    }
    for (const SharedEdge& edge : edges) {
      const int left = patch_of_triangle[static_cast<std::size_t>(edge.left)];
      const int right = patch_of_triangle[static_cast<std::size_t>(edge.right)];
      if (left == right) continue;
      const double edge_length = (mesh.points[static_cast<std::size_t>(edge.a)] -
                                  mesh.points[static_cast<std::size_t>(edge.b)])
                                     .norm();
      const double angle = angle_between(areas[static_cast<std::size_t>(edge.left)],
                                         areas[static_cast<std::size_t>(edge.right)]);
      for (const int side : {left, right}) {
        patches[side].rim += edge_length;
        patches[side].rim_angle += edge_length * angle;
      }
    }
    std::vector<std::pair<int, Patch>> caps;
    for (const auto& [id, patch] : patches) {
      if (patch.is_cap() && patch.area < 0.5 * total_area) caps.emplace_back(id, patch);
    }
    return caps;
  };

  std::vector<int> patch_of_triangle = surface.face_of_triangle;
  std::vector<std::pair<int, Patch>> caps;
  if (patch_of_triangle.size() == count) caps = caps_among(patch_of_triangle);
  if (caps.empty()) {
    patch_of_triangle = planar_patches(count, edges, areas);
    caps = caps_among(patch_of_triangle);
    // A coarse wall has sharp planar facets of its own; those of caps are far larger.
    double largest = 0;
    for (const auto& [id, patch] : caps) largest = std::max(largest, patch.area);
    double total_area = 0;
    for (const Vec3& area : areas) total_area += area.norm();
    const double mean_area = total_area / static_cast<double>(count);
    std::erase_if(caps, [&](const auto& cap) {
      return cap.second.triangles < 4 || cap.second.area < 3.0 * mean_area ||
             cap.second.area < 1e-3 * largest;
    });
    if (!caps.empty()) {
      const sdf::MeshDistance everything(mesh);
      std::erase_if(caps, [&](const auto& cap) {
        const Patch& patch = cap.second;
        const double radius = std::sqrt(patch.area / std::numbers::pi);
        const Vec3 inside =
            patch.moment / patch.area - 2.0 * radius * patch.area_vector.normalized();
        return everything.closest(inside).distance > kLumenBehindEnd * radius;
      });
    }
  }
  std::vector<char> is_cap(count, 0);
  for (const auto& [id, patch] : caps) {
    ends.push_back({patch.moment / patch.area, patch.area_vector.normalized(),
                    std::sqrt(patch.area / std::numbers::pi), false});
    for (std::size_t t = 0; t < count; ++t)
      if (patch_of_triangle[t] == id) is_cap[t] = 1;
  }
  return is_cap;
}

/// A fan over a boundary loop around its length-weighted centre; returns the opening it covers.
LumenEnd close_loop(TriangleMesh& mesh, const std::vector<int>& loop) {
  Vec3 moment = Vec3::Zero();
  double perimeter = 0;
  for (std::size_t i = 0; i < loop.size(); ++i) {
    const Vec3& a = mesh.points[static_cast<std::size_t>(loop[i])];
    const Vec3& b = mesh.points[static_cast<std::size_t>(loop[(i + 1) % loop.size()])];
    const double edge_length = (b - a).norm();
    moment += 0.5 * edge_length * (a + b);
    perimeter += edge_length;
  }
  LumenEnd opening;
  opening.centre = perimeter > 0 ? Vec3(moment / perimeter)
                                 : mesh.points[static_cast<std::size_t>(loop.front())];
  const int centre = static_cast<int>(mesh.points.size());
  mesh.points.push_back(opening.centre);
  Vec3 total_area = Vec3::Zero();
  for (std::size_t i = 0; i < loop.size(); ++i) {
    const Triangle triangle{loop[(i + 1) % loop.size()], loop[i], centre};
    mesh.triangles.push_back(triangle);
    total_area += area_vector(mesh, triangle);
  }
  opening.outward = total_area.norm() > 0 ? Vec3(total_area.normalized()) : Vec3::UnitX();
  opening.radius = std::sqrt(total_area.norm() / std::numbers::pi);
  return opening;
}

}  // namespace

LumenEnds find_lumen_ends(const Surface& surface) {
  LumenEnds result;
  result.closed = surface.mesh;
  const Topology facts = topology(surface.mesh);

  std::vector<char> boundary_vertex(surface.mesh.points.size(), 0);
  std::vector<LumenEnd> openings;
  for (const std::vector<int>& loop : facts.boundary_loops) {
    for (const int vertex : loop) boundary_vertex[static_cast<std::size_t>(vertex)] = 1;
    openings.push_back(close_loop(result.closed, loop));
  }
  std::vector<char> at_boundary(surface.mesh.triangles.size(), 0);
  for (std::size_t t = 0; t < at_boundary.size(); ++t) {
    for (const int corner : surface.mesh.triangles[t]) {
      at_boundary[t] |= boundary_vertex[static_cast<std::size_t>(corner)];
    }
  }

  std::vector<LumenEnd> caps;
  result.is_cap = find_caps(surface, at_boundary, caps);
  TriangleMesh wall;
  wall.points = surface.mesh.points;
  for (std::size_t t = 0; t < result.is_cap.size(); ++t) {
    if (!result.is_cap[t]) wall.triangles.push_back(surface.mesh.triangles[t]);
  }

  result.wall = std::make_shared<const sdf::MeshDistance>(wall);

  // Behind a vessel's end the wall stays about a radius away; behind a hole in a wider lumen it
  // recedes.
  if (!openings.empty()) {
    double widest = 0;
    for (const LumenEnd& opening : openings) widest = std::max(widest, opening.radius);
    std::erase_if(openings, [&](const LumenEnd& opening) {
      const Vec3 behind = opening.centre - 2.0 * opening.radius * opening.outward;
      return opening.radius < 0.3 * widest &&
             result.wall->closest(behind).distance > kLumenBehindEnd * opening.radius;
    });
  }
  result.ends = std::move(openings);
  result.ends.insert(result.ends.end(), caps.begin(), caps.end());
  return result;
}

}  // namespace vstent::vessels
