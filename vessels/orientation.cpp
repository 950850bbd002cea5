#include "vessels/orientation.hpp"

#include <Eigen/Geometry>
#include <cmath>
#include <numeric>

#include "vessels/half_edges.hpp"

namespace vstent::vessels {
namespace {

struct Neighbour {
  int triangle;
  bool agrees;  // as the file has them
  int low, high;
};

double volume(const Vec3& a, const Vec3& b, const Vec3& c) { return a.dot(b.cross(c)) / 6.0; }

// Twice the largest ambiguity that rounding leaves to the sign of a flat piece's volume, relative
// to its area^(3/2).
constexpr double kFlat = 1e-5;

}  // namespace

Orientation orient(const TriangleMesh& mesh, const std::vector<int>& polygon_of_triangle) {
  const std::size_t count = mesh.triangles.size();
  const std::vector<HalfEdge> edges = sorted_half_edges(mesh);
  std::vector<std::vector<Neighbour>> neighbours(count);
  std::vector<const HalfEdge*> boundary;
  for_each_edge(edges, [&](std::size_t begin, std::size_t end) {
    const HalfEdge& first = edges[begin];
    if (end - begin == 1) boundary.push_back(&first);
    if (end - begin != 2) return;
    const HalfEdge& second = edges[begin + 1];
    const bool agrees = first.ascending != second.ascending;
    neighbours[static_cast<std::size_t>(first.triangle)].push_back(
        {second.triangle, agrees, first.low, first.high});
    neighbours[static_cast<std::size_t>(second.triangle)].push_back(
        {first.triangle, agrees, first.low, first.high});
  });
  for (std::size_t t = 1; t < count; ++t) {
    if (polygon_of_triangle[t] != polygon_of_triangle[t - 1]) continue;
    const int vertex = mesh.triangles[t][0];
    neighbours[t].push_back({static_cast<int>(t) - 1, true, vertex, vertex});
    neighbours[t - 1].push_back({static_cast<int>(t), true, vertex, vertex});
  }

  Orientation result;
  result.turned.assign(count, 0);
  std::vector<int> piece(count, -1);
  int pieces = 0;
  for (std::size_t seed = 0; seed < count; ++seed) {
    if (piece[seed] >= 0) continue;
    piece[seed] = pieces;
    std::vector<int> queue = {static_cast<int>(seed)};
    for (std::size_t q = 0; q < queue.size(); ++q) {
      const auto t = static_cast<std::size_t>(queue[q]);
      for (const Neighbour& neighbour : neighbours[t]) {
        const auto n = static_cast<std::size_t>(neighbour.triangle);
        const char wanted =
            neighbour.agrees ? result.turned[t] : static_cast<char>(1 - result.turned[t]);
        if (piece[n] < 0) {
          piece[n] = pieces;
          result.turned[n] = wanted;
          queue.push_back(neighbour.triangle);
        } else if (result.turned[n] != wanted && t < n) {
          result.one_sided_edges.push_back({neighbour.low, neighbour.high});
        }
      }
    }
    ++pieces;
  }
  std::sort(result.one_sided_edges.begin(), result.one_sided_edges.end());

  // Boundary vertices joined by boundary edges form a rim; a fan to its centroid closes it.
  std::vector<int> rim(mesh.points.size());
  std::iota(rim.begin(), rim.end(), 0);
  const auto root = [&](int v) {
    while (rim[static_cast<std::size_t>(v)] != v) {
      int& parent = rim[static_cast<std::size_t>(v)];
      parent = rim[static_cast<std::size_t>(parent)];
      v = parent;
    }
    return v;
  };
  for (const HalfEdge* edge : boundary) {
    const int a = root(edge->low);
    const int b = root(edge->high);
    if (a != b) rim[static_cast<std::size_t>(std::max(a, b))] = std::min(a, b);
  }
  std::vector<Vec3> rim_sum(mesh.points.size(), Vec3::Zero());
  std::vector<double> rim_weight(mesh.points.size(), 0.0);
  const auto at = [&](int v) -> const Vec3& { return mesh.points[static_cast<std::size_t>(v)]; };
  for (const HalfEdge* edge : boundary) {
    const auto r = static_cast<std::size_t>(root(edge->low));
    const double length = (at(edge->high) - at(edge->low)).norm();
    rim_sum[r] += 0.5 * length * (at(edge->low) + at(edge->high));
    rim_weight[r] += length;
  }

  std::vector<Vec3> origin(static_cast<std::size_t>(pieces), Vec3::Zero());
  std::vector<double> volumes(static_cast<std::size_t>(pieces), 0.0),
      areas(static_cast<std::size_t>(pieces), 0.0);
  std::vector<std::size_t> sizes(static_cast<std::size_t>(pieces), 0),
      flips(static_cast<std::size_t>(pieces), 0);
  for (std::size_t t = 0; t < count; ++t) {
    const auto p = static_cast<std::size_t>(piece[t]);
    if (sizes[p]++ == 0) origin[p] = at(mesh.triangles[t][0]);
    const Vec3 a = at(mesh.triangles[t][0]) - origin[p];
    const Vec3 b = at(mesh.triangles[t][1]) - origin[p];
    const Vec3 c = at(mesh.triangles[t][2]) - origin[p];
    volumes[p] += (result.turned[t] != 0 ? -1.0 : 1.0) * volume(a, b, c);
    areas[p] += 0.5 * (b - a).cross(c - a).norm();
    flips[p] += result.turned[t] != 0 ? 1 : 0;
  }
  for (const HalfEdge* edge : boundary) {
    const auto t = static_cast<std::size_t>(edge->triangle);
    const auto p = static_cast<std::size_t>(piece[t]);
    const auto r = static_cast<std::size_t>(root(edge->low));
    if (rim_weight[r] <= 0) continue;
    const Vec3 centre = rim_sum[r] / rim_weight[r] - origin[p];
    const bool ascending = edge->ascending != (result.turned[t] != 0);
    const Vec3 low = at(edge->low) - origin[p];
    const Vec3 high = at(edge->high) - origin[p];
    volumes[p] += ascending ? volume(high, low, centre) : volume(low, high, centre);
  }
  std::vector<char> reverse(static_cast<std::size_t>(pieces), 0);
  for (std::size_t p = 0; p < reverse.size(); ++p) {
    const bool flat = std::abs(volumes[p]) <= kFlat * std::pow(areas[p], 1.5);
    reverse[p] = flat ? 2 * flips[p] > sizes[p] : volumes[p] < 0;
    if (reverse[p] != 0 && flips[p] == 0) ++result.inward_components;
  }
  for (std::size_t t = 0; t < count; ++t) {
    if (reverse[static_cast<std::size_t>(piece[t])] != 0)
      result.turned[t] = static_cast<char>(1 - result.turned[t]);
    result.turned_count += result.turned[t] != 0 ? 1 : 0;
  }
  return result;
}

}  // namespace vstent::vessels
