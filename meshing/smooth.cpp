#include "meshing/smooth.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "meshing/crossings.hpp"
#include "meshing/edge_graph.hpp"
#include "meshing/quality.hpp"
#include "vessels/error.hpp"
#include "vessels/half_edges.hpp"
#include "vessels/text.hpp"

namespace vstent::meshing {
namespace {

constexpr double kPassBand = 0.1;
constexpr double kTurned = 0.1;  // cosine: a triangle that turned further than this has turned over

Vec3 doubled_area(const std::vector<Vec3>& points, const Triangle& t) {
  const Vec3& a = points[static_cast<std::size_t>(t[0])];
  return (points[static_cast<std::size_t>(t[1])] - a)
      .cross(points[static_cast<std::size_t>(t[2])] - a);
}

/// Points all of whose triangles belong to the region and to one wall.
std::vector<char> free_points(const Model& model, std::span<const char> region) {
  std::vector<int> face_at(model.mesh.points.size(), -1);
  std::vector<char> free(model.mesh.points.size(), 1);
  for (std::size_t t = 0; t < model.mesh.triangles.size(); ++t) {
    const int id = model.face_of_triangle[t];
    const bool fixed = (!region.empty() && !region[t]) || face(model, id).cap;
    for (const int p : model.mesh.triangles[t]) {
      int& known = face_at[static_cast<std::size_t>(p)];
      if (fixed || (known >= 0 && known != id)) free[static_cast<std::size_t>(p)] = 0;
      known = id;
    }
  }
  const auto edges = vessels::sorted_half_edges(model.mesh);
  vessels::for_each_edge(edges, [&](std::size_t begin, std::size_t end) {
    if (end - begin == 2) return;
    for (const int p : {edges[begin].low, edges[begin].high}) free[static_cast<std::size_t>(p)] = 0;
  });
  return free;
}

void step(std::vector<Vec3>& points, const EdgeGraph& graph, const std::vector<char>& free,
          double share) {
  std::vector<Vec3> moved = points;
  for (std::size_t p = 0; p < points.size(); ++p) {
    if (!free[p]) continue;
    Vec3 sum = Vec3::Zero();
    double total = 0;
    for (const auto& [q, length] : graph.neighbours(static_cast<int>(p))) {
      sum += points[static_cast<std::size_t>(q)] / length;
      total += 1 / length;
    }
    moved[p] += share * (sum / total - points[p]);
  }
  points = std::move(moved);
}

/// Puts points back until no triangle is turned over; returns how many.
std::size_t hold_turned(const TriangleMesh& before, std::vector<Vec3>& points) {
  std::size_t held = 0;
  for (bool any = true; any;) {
    any = false;
    for (const Triangle& t : before.triangles) {
      const Vec3 old = doubled_area(before.points, t), now = doubled_area(points, t);
      if (now.dot(old) >= kTurned * now.norm() * old.norm()) continue;
      for (const int corner : t) {
        const auto p = static_cast<std::size_t>(corner);
        if (points[p] == before.points[p]) continue;
        points[p] = before.points[p];
        ++held;
        any = true;
      }
    }
  }
  return held;
}

}  // namespace

Smoothed smooth(const Model& model, std::span<const char> region, const SmoothOptions& options,
                vessels::LengthUnit unit) {
  const std::vector<char> free = free_points(model, region);
  const EdgeGraph graph(model.mesh);
  Smoothed result{model, 0, 0, 0};
  std::vector<Vec3>& points = result.model.mesh.points;
  const double back = 1 / (kPassBand - 1 / options.step);
  for (int i = 0; i < options.iterations; ++i) {
    step(points, graph, free, options.step);
    if (options.taubin) step(points, graph, free, back);
  }
  result.held = hold_turned(model.mesh, points);
  std::vector<char> changed(model.mesh.triangles.size(), 0);
  for (std::size_t t = 0; t < changed.size(); ++t) {
    for (const int corner : model.mesh.triangles[t]) {
      const auto p = static_cast<std::size_t>(corner);
      const double move = (points[p] - model.mesh.points[p]).norm();
      result.largest_move = std::max(result.largest_move, move);
      changed[t] |= move > 0;
    }
  }
  const double volume = enclosed_volume(model.mesh);
  result.volume_change = enclosed_volume(result.model.mesh) / volume - 1;
  if (std::abs(result.volume_change) > options.volume_limit) {
    throw Error(ExitCode::geometry,
                "smoothing would change the volume by " +
                    vessels::number(100 * result.volume_change) + " %, more than " +
                    vessels::number(100 * options.volume_limit) + " %: take fewer iterations" +
                    (options.taubin ? "" : ", or Taubin's"));
  }
  require_no_crossings(result.model.mesh, unit, "after smoothing", changed);
  return result;
}

}  // namespace vstent::meshing
