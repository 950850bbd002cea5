#include "meshing/quality.hpp"

#include <oneapi/tbb/blocked_range.h>
#include <oneapi/tbb/parallel_reduce.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>

#include "sdf/mesh_distance.hpp"
#include "vessels/half_edges.hpp"

namespace vstent::meshing {
namespace {

constexpr std::size_t kBins = 20;

std::array<Vec3, 3> corners(const TriangleMesh& mesh, const Triangle& t) {
  return {mesh.points[static_cast<std::size_t>(t[0])], mesh.points[static_cast<std::size_t>(t[1])],
          mesh.points[static_cast<std::size_t>(t[2])]};
}

TriangleMesh part(const TriangleMesh& mesh, std::span<const char> marked) {
  TriangleMesh result{mesh.points, {}};
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t)
    if (marked.empty() || marked[t] != 0) result.triangles.push_back(mesh.triangles[t]);
  return result;
}

}  // namespace

SurfaceQuality measure_quality(const TriangleMesh& whole, std::span<const char> marked) {
  const TriangleMesh mesh = part(whole, marked);
  SurfaceQuality quality;
  quality.triangles = mesh.triangles.size();
  if (mesh.triangles.empty()) return quality;
  quality.smallest_angle = 60;
  for (const Triangle& t : mesh.triangles) {
    const auto x = corners(mesh, t);
    double angle = std::numbers::pi, longest = 0, perimeter = 0;
    const double doubled = (x[1] - x[0]).cross(x[2] - x[0]).norm();
    for (std::size_t k = 0; k < 3; ++k) {
      const Vec3 u = x[(k + 1) % 3] - x[k], v = x[(k + 2) % 3] - x[k];
      angle = std::min(angle, std::atan2(doubled, u.dot(v)));
      longest = std::max(longest, u.norm());
      perimeter += u.norm();
    }
    const double degrees = angle * 180 / std::numbers::pi;
    const double inscribed = doubled / perimeter;
    const double aspect = longest / (2 * std::numbers::sqrt3 * inscribed);
    quality.area += 0.5 * doubled;
    quality.smallest_angle = std::min(quality.smallest_angle, degrees);
    quality.mean_smallest_angle += degrees / static_cast<double>(quality.triangles);
    quality.largest_aspect_ratio = std::max(quality.largest_aspect_ratio, aspect);
    quality.mean_aspect_ratio += aspect / static_cast<double>(quality.triangles);
  }
  const auto edges = vessels::sorted_half_edges(mesh);
  std::vector<double> lengths;
  vessels::for_each_edge(edges, [&](std::size_t begin, std::size_t) {
    lengths.push_back((mesh.points[static_cast<std::size_t>(edges[begin].low)] -
                       mesh.points[static_cast<std::size_t>(edges[begin].high)])
                          .norm());
  });
  std::sort(lengths.begin(), lengths.end());
  quality.shortest_edge = lengths.front();
  quality.longest_edge = lengths.back();
  const double width = (lengths.back() - lengths.front()) / kBins;
  for (std::size_t b = 0; b < kBins; ++b) {
    const double from = lengths.front() + static_cast<double>(b) * width;
    quality.edge_lengths.push_back({from, b + 1 == kBins ? lengths.back() : from + width, 0});
  }
  for (const double length : lengths) {
    quality.mean_edge += length / static_cast<double>(lengths.size());
    const double bin = width > 0 ? (length - lengths.front()) / width : 0;
    ++quality.edge_lengths[std::min(kBins - 1, static_cast<std::size_t>(bin))].edges;
  }
  return quality;
}

double one_way_distance(const TriangleMesh& from, const TriangleMesh& to,
                        std::span<const char> marked) {
  const TriangleMesh looked_at = part(from, marked);
  std::vector<Vec3> samples;
  std::vector<char> used(from.points.size(), 0);
  for (const Triangle& t : looked_at.triangles) {
    const auto x = corners(looked_at, t);
    samples.push_back((x[0] + x[1] + x[2]) / 3);
    for (const int p : t) used[static_cast<std::size_t>(p)] = 1;
  }
  for (std::size_t p = 0; p < used.size(); ++p)
    if (used[p]) samples.push_back(from.points[p]);
  const sdf::MeshDistance distance(to);
  return tbb::parallel_reduce(
      tbb::blocked_range<std::size_t>(0, samples.size(), 256), 0.0,
      [&](const auto& range, double largest) {
        for (std::size_t i = range.begin(); i < range.end(); ++i)
          largest = std::max(largest, distance.closest(samples[i]).distance);
        return largest;
      },
      [](double a, double b) { return std::max(a, b); });
}

double enclosed_volume(const TriangleMesh& mesh) {
  double volume = 0;
  const Vec3 origin = mesh.points.empty() ? Vec3::Zero() : mesh.points.front();
  for (const Triangle& t : mesh.triangles) {
    const auto x = corners(mesh, t);
    volume += (x[0] - origin).dot((x[1] - origin).cross(x[2] - origin)) / 6;
  }
  return volume;
}

}  // namespace vstent::meshing
