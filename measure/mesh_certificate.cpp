#include "measure/mesh_certificate.hpp"

#include <tbb/parallel_invoke.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "measure/corners.hpp"
#include "vessels/check.hpp"

namespace vstent::measure {
namespace {

AngleQuality angle_quality(const TriangleMesh& mesh) {
  std::vector<double> smallest, largest;
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    const auto x = corners(mesh, t);
    double least = 180, most = 0;
    for (std::size_t k = 0; k < 3; ++k) {
      const Vec3 a = x[(k + 1) % 3] - x[k], b = x[(k + 2) % 3] - x[k];
      const double angle = std::atan2(a.cross(b).norm(), a.dot(b)) * 180 / std::numbers::pi;
      least = std::min(least, angle);
      most = std::max(most, angle);
    }
    smallest.push_back(least);
    largest.push_back(most);
  }
  AngleQuality q;
  if (smallest.empty()) return q;
  std::sort(smallest.begin(), smallest.end());
  std::sort(largest.begin(), largest.end());
  const auto share = [](const std::vector<double>& sorted, double p) {
    return sorted[static_cast<std::size_t>(p * static_cast<double>(sorted.size() - 1))];
  };
  q.smallest = smallest.front();
  q.smallest_p5 = share(smallest, 0.05);
  q.smallest_median = share(smallest, 0.5);
  q.largest = largest.back();
  q.largest_p95 = share(largest, 0.95);
  q.largest_median = share(largest, 0.5);
  return q;
}

std::vector<Vec3> normals(const TriangleMesh& mesh) {
  std::vector<Vec3> result(mesh.triangles.size());
  for (std::size_t t = 0; t < result.size(); ++t) result[t] = area_vector(corners(mesh, t));
  return result;
}

/// Per triangle, the area-weighted normal of those around it that share a vertex with it.
std::vector<Vec3> surroundings(const TriangleMesh& mesh, std::span<const Vec3> normals) {
  std::vector<Vec3> at_vertex(mesh.points.size(), Vec3::Zero());
  for (std::size_t t = 0; t < normals.size(); ++t) {
    for (const int v : mesh.triangles[t]) at_vertex[at(v)] += normals[t];
  }
  std::vector<Vec3> result(normals.size());
  for (std::size_t t = 0; t < normals.size(); ++t) {
    result[t] = -3 * normals[t];
    for (const int v : mesh.triangles[t]) result[t] += at_vertex[at(v)];
  }
  return result;
}

/// A stiff turn of a part of the wall inverts nothing, a triangle that is turned over among its
/// neighbours is inverted whichever way they face.
void count_inverted(const TriangleMesh& before, const TriangleMesh& after, MeshMetrics& m) {
  const std::vector<Vec3> normals_before = normals(before), normals_after = normals(after);
  const std::vector<Vec3> around_before = surroundings(before, normals_before);
  const std::vector<Vec3> around_after = surroundings(after, normals_after);
  for (std::size_t t = 0; t < normals_before.size(); ++t) {
    if (normals_after[t].dot(around_after[t]) < 0 && normals_before[t].dot(around_before[t]) >= 0) {
      if (++m.inverted_triangles == 1) m.damaged_at = centroid(corners(after, t));
    }
    m.turned_triangles += normals_before[t].dot(normals_after[t]) < 0;
  }
}

void compare(const TriangleMesh& before, const TriangleMesh& after, std::span<const char> movable,
             MeshMetrics& m) {
  for (std::size_t v = 0; v < before.points.size(); ++v) {
    m.largest_displacement =
        std::max(m.largest_displacement, (after.points[v] - before.points[v]).norm());
    const bool changed = after.points[v] != before.points[v];
    m.moved_vertices += changed;
    m.changed_outside_patch += changed && m.patch_known && !movable[v];
  }
  count_inverted(before, after, m);
}

}  // namespace

MeshMetrics certify(const TriangleMesh& before, const TriangleMesh& after,
                    std::span<const char> movable) {
  MeshMetrics m;
  m.same_triangles =
      before.points.size() == after.points.size() && before.triangles == after.triangles;
  m.patch_known = m.same_triangles && !movable.empty();
  std::vector<char> touched;
  if (m.same_triangles) {
    compare(before, after, movable, m);
    for (const Triangle& t : before.triangles) {
      touched.push_back(std::any_of(t.begin(), t.end(), [&](int v) {
        return m.patch_known ? movable[at(v)] != 0 : after.points[at(v)] != before.points[at(v)];
      }));
    }
  }
  // Where nothing moved all pairs count: an empty list of marks asks for them.
  if (std::find(touched.begin(), touched.end(), 1) == touched.end()) touched.clear();
  const bool same_points = m.same_triangles && m.moved_vertices == 0;
  using Crossings = std::vector<std::pair<int, int>>;
  Crossings crossings_before, crossings_after;
  vessels::Topology topology_before, topology_after;
  tbb::parallel_invoke([&] { crossings_before = vessels::self_intersections(before, touched); },
                       [&] {
                         if (!same_points)
                           crossings_after = vessels::self_intersections(after, touched);
                       },
                       [&] { topology_before = vessels::topology(before); },
                       [&] { topology_after = vessels::topology(after); },
                       [&] { m.angles_before = angle_quality(before); },
                       [&] { m.angles_after = angle_quality(after); });
  if (same_points) crossings_after = crossings_before;
  m.self_intersections_before = crossings_before.size();
  m.self_intersections_after = crossings_after.size();
  if (m.same_triangles) {
    Crossings fresh;
    std::set_difference(crossings_after.begin(), crossings_after.end(), crossings_before.begin(),
                        crossings_before.end(), std::back_inserter(fresh));
    m.new_self_intersections = fresh.size();
    if (!fresh.empty() && !m.damaged_at)
      m.damaged_at = centroid(corners(after, static_cast<std::size_t>(fresh.front().first)));
  }
  m.openings_before = topology_before.boundary_loops.size();
  m.openings_after = topology_after.boundary_loops.size();
  m.closed_before = m.openings_before == 0;
  m.closed_after = m.openings_after == 0;
  m.non_manifold_edges_after = topology_after.non_manifold_edges.size();
  return m;
}

}  // namespace vstent::measure
