#include "measure/measure.hpp"

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <numbers>

#include "sdf/exact_field.hpp"
#include "sdf/polyline.hpp"
#include "stents/axis.hpp"
#include "vessels/check.hpp"
#include "vessels/error.hpp"

namespace vstent::measure {
namespace {

using nlohmann::ordered_json;
using vessels::Section;
using vessels::Surface;

constexpr double kDegrees = 180 / std::numbers::pi;

Vec3 normal(const TriangleMesh& mesh, std::size_t triangle) {
  const Triangle& t = mesh.triangles[triangle];
  const Vec3& a = mesh.points[static_cast<std::size_t>(t[0])];
  return (mesh.points[static_cast<std::size_t>(t[1])] - a)
      .cross(mesh.points[static_cast<std::size_t>(t[2])] - a);
}

void compare_meshes(const Surface& before, const Surface& after, const Comparison& comparison,
                    Metrics& metrics) {
  const std::size_t points = before.mesh.points.size();
  for (std::size_t v = 0; v < points; ++v) {
    const double moved = (after.mesh.points[v] - before.mesh.points[v]).norm();
    metrics.largest_displacement = std::max(metrics.largest_displacement, moved);
    const bool changed = after.mesh.points[v] != before.mesh.points[v];
    metrics.moved_vertices += changed;
    metrics.changed_outside_patch += changed && !comparison.movable[v];
  }
  for (std::size_t t = 0; t < before.mesh.triangles.size(); ++t) {
    metrics.inverted_triangles += normal(before.mesh, t).dot(normal(after.mesh, t)) < 0;
  }
  auto crossings_before = vessels::self_intersections(before.mesh, comparison.patch_triangles);
  auto crossings_after = vessels::self_intersections(after.mesh, comparison.patch_triangles);
  metrics.self_intersections_before = crossings_before.size();
  std::vector<std::pair<int, int>> fresh;
  std::set_difference(crossings_after.begin(), crossings_after.end(), crossings_before.begin(),
                      crossings_before.end(), std::back_inserter(fresh));
  metrics.new_self_intersections = fresh.size();
  const vessels::Topology topology_before = vessels::topology(before.mesh);
  const vessels::Topology topology_after = vessels::topology(after.mesh);
  metrics.openings_before = topology_before.boundary_loops.size();
  metrics.openings_after = topology_after.boundary_loops.size();
  metrics.closed_before = topology_before.boundary_loops.empty();
  metrics.closed_after = topology_after.boundary_loops.empty();
  metrics.non_manifold_edges_after = topology_after.non_manifold_edges.size();
}

void measure_lumen(const Surface& before, const Surface& after, const Comparison& comparison,
                   Metrics& metrics) {
  const vessels::Sectioner sections_before(before.mesh);
  const vessels::Sectioner sections_after(after.mesh);
  const std::vector<double> arc = arc_lengths(comparison.axis_before);
  const std::vector<Vec3> normals_before = tangents(comparison.axis_before);
  const std::vector<Vec3> normals_after = tangents(comparison.axis_after);
  Polyline centroids;
  double opened = 0;
  double ratio = 0;
  for (std::size_t i = 0; i < arc.size(); ++i) {
    Station station;
    station.arc_length = arc[i];
    station.target = comparison.target[i];
    const double reach = 2 * comparison.target[i];
    station.before = sections_before.cut(comparison.axis_before[i], normals_before[i], reach);
    station.after = sections_after.cut(comparison.axis_after[i], normals_after[i], reach);
    const auto narrower = [](double known, double d) { return known > 0 ? std::min(known, d) : d; };
    if (station.before) {
      metrics.narrowest_before =
          narrower(metrics.narrowest_before, station.before->equivalent_diameter);
    }
    if (station.after) {
      metrics.narrowest_after =
          narrower(metrics.narrowest_after, station.after->equivalent_diameter);
      centroids.push_back(station.after->centroid);
    }
    if (station.before && station.after && station.before->equivalent_diameter < station.target) {
      opened += 1;
      ratio += station.after->equivalent_diameter / station.target;
      metrics.opened_min_diameter =
          narrower(metrics.opened_min_diameter, station.after->min_diameter);
    }
    metrics.stations.push_back(std::move(station));
  }
  metrics.opened_mean_over_target = opened > 0 ? ratio / opened : 0;
  metrics.opened_share = opened / static_cast<double>(arc.size());
  if (comparison.reference_diameter > 0) {
    const auto stenosis = [&](double d) { return 100 * (1 - d / comparison.reference_diameter); };
    metrics.stenosis_before = stenosis(metrics.narrowest_before);
    metrics.stenosis_after = stenosis(metrics.narrowest_after);
  }
  metrics.bend_before = kDegrees * stents::end_tangent_angle(comparison.axis_before);
  metrics.bend_after = kDegrees * stents::end_tangent_angle(comparison.axis_after);
  if (centroids.size() > 10) {
    // Single centroids jitter with the mesh; chords over a fifth of the stent give the direction of
    // the lumen's ends.
    const std::size_t span = centroids.size() / 5;
    const Polyline ends{centroids.front(), centroids[span], centroids[centroids.size() - 1 - span],
                        centroids.back()};
    metrics.lumen_bend_after = kDegrees * stents::end_tangent_angle(ends);
  }
}

ordered_json to_json(const std::optional<Section>& section) {
  if (!section) return nullptr;
  return {{"area_mm2", section->area},
          {"equivalent_diameter_mm", section->equivalent_diameter},
          {"min_diameter_mm", section->min_diameter},
          {"max_diameter_mm", section->max_diameter}};
}

ordered_json to_json(const std::optional<double>& value) {
  return value ? ordered_json(*value) : ordered_json(nullptr);
}

}  // namespace

Metrics measure(const Surface& before, const Surface& after, const Comparison& comparison) {
  if (before.mesh.points.size() != after.mesh.points.size() ||
      before.mesh.triangles != after.mesh.triangles) {
    throw Error(ExitCode::geometry,
                after.path + ": does not have the vertices and triangles of " + before.path);
  }
  Metrics metrics;
  compare_meshes(before, after, comparison, metrics);
  measure_lumen(before, after, comparison, metrics);
  const sdf::ExactField stent(comparison.stent);
  std::vector<Vec3> wall;
  for (std::size_t v = 0; v < after.mesh.points.size(); ++v) {
    if (comparison.movable[v]) wall.push_back(after.mesh.points[v]);
  }
  std::vector<sdf::Sample> samples(wall.size());
  stent.sample(wall, samples);
  for (const sdf::Sample& sample : samples) {
    metrics.deepest_penetration = std::max(metrics.deepest_penetration, -sample.distance);
  }
  return metrics;
}

ordered_json to_json(const Metrics& m) {
  ordered_json result;
  result["lumen"] = {{"narrowest_before_mm", m.narrowest_before},
                     {"narrowest_after_mm", m.narrowest_after},
                     {"opened_mean_diameter_over_target", m.opened_mean_over_target},
                     {"opened_min_diameter_mm", m.opened_min_diameter},
                     {"opened_share_of_length", m.opened_share},
                     {"diameter_stenosis_before_percent", to_json(m.stenosis_before)},
                     {"diameter_stenosis_after_percent", to_json(m.stenosis_after)}};
  result["shape"] = {{"stent_bend_before_deg", m.bend_before},
                     {"stent_bend_after_deg", m.bend_after},
                     {"lumen_bend_after_deg", m.lumen_bend_after},
                     {"largest_displacement_mm", m.largest_displacement},
                     {"deepest_penetration_mm", m.deepest_penetration}};
  result["mesh"] = {{"moved_vertices", m.moved_vertices},
                    {"changed_vertices_outside_patch", m.changed_outside_patch},
                    {"inverted_triangles", m.inverted_triangles},
                    {"self_intersections_before", m.self_intersections_before},
                    {"new_self_intersections", m.new_self_intersections},
                    {"closed_before", m.closed_before},
                    {"closed_after", m.closed_after},
                    {"openings_before", m.openings_before},
                    {"openings_after", m.openings_after},
                    {"non_manifold_edges_after", m.non_manifold_edges_after}};
  if (m.struts) result["struts"] = to_json(*m.struts);
  ordered_json stations = ordered_json::array();
  for (const Station& station : m.stations) {
    stations.push_back({{"arc_length_mm", station.arc_length},
                        {"target_diameter_mm", station.target},
                        {"before", to_json(station.before)},
                        {"after", to_json(station.after)}});
  }
  result["stations"] = std::move(stations);
  return result;
}

}  // namespace vstent::measure
