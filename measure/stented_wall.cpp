#include "measure/stented_wall.hpp"

#include <tbb/parallel_for.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <queue>

#include "measure/corners.hpp"
#include "sdf/mesh_distance.hpp"
#include "sdf/polyline.hpp"

namespace vstent::measure {
namespace {

/// Inscribed and farthest radius of the lumen around the axis at a station.
struct Reach {
  double inscribed = 0, farthest = 0;
};

std::vector<Reach> reaches(const Polyline& axis, const std::vector<Station>& stations, bool after) {
  std::vector<Reach> result(stations.size());
  for (std::size_t i = 0; i < stations.size(); ++i) {
    const Station& s = stations[i];
    if (!(after ? s.whole_after() : s.whole_before())) continue;
    result[i].inscribed = std::numeric_limits<double>::infinity();
    for (const Vec3& x : (after ? s.after : s.before)->outline) {
      result[i].inscribed = std::min(result[i].inscribed, (x - axis[i]).norm());
      result[i].farthest = std::max(result[i].farthest, (x - axis[i]).norm());
    }
  }
  // Stations whose section says nothing take the largest of the known.
  Reach widest;
  for (const Reach& r : result) {
    widest.inscribed = std::max(widest.inscribed, r.inscribed);
    widest.farthest = std::max(widest.farthest, r.farthest);
  }
  for (Reach& r : result)
    if (r.farthest == 0) r = widest;
  return result;
}

double squared(double x) { return x * x; }

bool belongs_to_branch(const Vec3& x, const Vec3& own, double inscribed,
                       std::span<const SideBranchPoint> branches) {
  const double power = (x - own).squaredNorm() - squared(inscribed);
  return std::any_of(branches.begin(), branches.end(), [&](const SideBranchPoint& b) {
    const double distance = (x - b.centre).squaredNorm();
    return (b.centre - own).squaredNorm() > squared(inscribed) &&
           distance < squared(1.5 * b.radius) && distance - squared(b.radius) < power;
  });
}

Percentiles percentiles(const std::vector<double>& values, const std::vector<double>& areas,
                        std::span<const char> chosen) {
  std::vector<std::pair<double, double>> sorted;
  double total = 0;
  for (std::size_t t = 0; t < values.size(); ++t) {
    if (!chosen[t]) continue;
    sorted.emplace_back(values[t], areas[t]);
    total += areas[t];
  }
  std::sort(sorted.begin(), sorted.end());
  const auto at_share = [&](double share) {
    double sum = 0;
    for (const auto& [value, area] : sorted) {
      sum += area;
      if (sum >= share * total) return value;
    }
    return sorted.back().first;
  };
  return {at_share(0.05), at_share(0.5), at_share(0.95), at_share(0.99)};
}

/// Shortest ways along edges from the stented triangles' vertices, no farther than `limit`.
std::vector<double> ways_along_edges(const TriangleMesh& mesh, std::span<const char> stented,
                                     double limit) {
  std::vector<std::vector<int>> neighbours(mesh.points.size());
  for (const Triangle& t : mesh.triangles) {
    for (std::size_t k = 0; k < 3; ++k) {
      neighbours[at(t[k])].push_back(t[(k + 1) % 3]);
      neighbours[at(t[(k + 1) % 3])].push_back(t[k]);
    }
  }
  std::vector<double> way(mesh.points.size(), std::numeric_limits<double>::infinity());
  using Entry = std::pair<double, int>;
  std::priority_queue<Entry, std::vector<Entry>, std::greater<>> front;
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    if (!stented[t]) continue;
    for (const int v : mesh.triangles[t]) {
      if (way[at(v)] == 0) continue;
      way[at(v)] = 0;
      front.emplace(0, v);
    }
  }
  while (!front.empty()) {
    const auto [length, v] = front.top();
    front.pop();
    if (length > way[at(v)]) continue;
    for (const int w : neighbours[at(v)]) {
      const double longer = length + (mesh.points[at(v)] - mesh.points[at(w)]).norm();
      if (longer >= way[at(w)] || longer > limit) continue;
      way[at(w)] = longer;
      front.emplace(longer, w);
    }
  }
  return way;
}

}  // namespace

std::vector<char> stented_triangles(const TriangleMesh& mesh, const Polyline& axis,
                                    const std::vector<Station>& stations, bool after,
                                    std::span<const SideBranchPoint> branches) {
  const std::vector<double> arc = arc_lengths(axis);
  const std::vector<Reach> reach = reaches(axis, stations, after);
  Box box;
  double farthest = 0;
  for (std::size_t i = 0; i < stations.size(); ++i) {
    if (!stations[i].in_stent) continue;
    box.include(axis[i]);
    farthest = std::max(farthest, 1.1 * reach[i].farthest);
  }
  std::vector<char> result(mesh.triangles.size(), 0);
  tbb::parallel_for(std::size_t{0}, result.size(), [&](std::size_t t) {
    const Vec3 x = centroid(corners(mesh, t));
    if (box.squared_distance(x) > farthest * farthest) return;
    const PolylinePlace place = nearest_place(axis, arc, x);
    const auto before = static_cast<std::size_t>(place.segment);
    const bool later = place.arc_length - arc[before] > arc[before + 1] - place.arc_length;
    const std::size_t i = before + later;
    if (!stations[i].in_stent || place.squared_distance > squared(1.1 * reach[i].farthest)) return;
    const Vec3 own = point_at(axis, arc, place.arc_length);
    result[t] = !belongs_to_branch(x, own, reach[i].inscribed, branches);
  });
  return result;
}

WallStretch wall_stretch(const TriangleMesh& before, std::span<const Vec3> points_after,
                         const Polyline& axis) {
  const std::size_t count = before.triangles.size();
  const std::vector<double> ones(count, 1.0);
  WallStretch stretch{ones, ones, ones, ones, ones};
  const std::vector<double> arc = arc_lengths(axis);
  const std::vector<Vec3> along = tangents(axis);
  tbb::parallel_for(std::size_t{0}, count, [&](std::size_t t) {
    const Triangle& v = before.triangles[t];
    const std::array<Vec3, 3> a = corners(before, t);
    const std::array<Vec3, 3> b{points_after[at(v[0])], points_after[at(v[1])],
                                points_after[at(v[2])]};
    const Vec3 area = area_vector(a);
    if (a == b || !(area.norm() > 0)) return;
    const Vec3 normal = area.normalized();
    const PolylinePlace place = nearest_place(axis, arc, centroid(a));
    const Vec3 tangent = along[static_cast<std::size_t>(place.segment)];
    Vec3 axial = tangent - tangent.dot(normal) * normal;
    // Seen end on, as a cap is, a triangle has no direction along the axis.
    if (axial.norm() < 1e-6) axial = normal.unitOrthogonal();
    axial.normalize();
    const Vec3 around = normal.cross(axial);
    using Matrix = Eigen::Matrix<double, 3, 2>;
    Matrix frame, to;
    frame << axial, around;
    to << b[1] - b[0], b[2] - b[0];
    Eigen::Matrix2d from;  // edges before, along and around
    from << axial.dot(a[1] - a[0]), axial.dot(a[2] - a[0]), around.dot(a[1] - a[0]),
        around.dot(a[2] - a[0]);
    const Matrix gradient = to * from.inverse();
    stretch.axial[t] = gradient.col(0).norm();
    stretch.circumferential[t] = gradient.col(1).norm();
    stretch.area_ratio[t] = area_vector(b).norm() / area.norm();
    const Eigen::Matrix2d c = gradient.transpose() * gradient;
    const double middle = 0.5 * c.trace();
    const double spread = std::hypot(0.5 * (c(0, 0) - c(1, 1)), c(0, 1));
    stretch.largest[t] = std::sqrt(middle + spread);
    stretch.smallest[t] = std::sqrt(std::max(0.0, middle - spread));
  });
  return stretch;
}

std::optional<WallMetrics> measure_wall(const TriangleMesh& before, const WallStretch& stretch,
                                        std::span<const char> stented) {
  WallMetrics m;
  std::vector<double> areas(before.triangles.size());
  std::array<double, kOverstretch.size()> over{};
  for (std::size_t t = 0; t < areas.size(); ++t) {
    if (!stented[t]) continue;
    areas[t] = area_vector(corners(before, t)).norm();
    m.area_before += areas[t];
    for (std::size_t k = 0; k < over.size(); ++k)
      over[k] += stretch.circumferential[t] > kOverstretch[k] ? areas[t] : 0;
  }
  if (!(m.area_before > 0)) return std::nullopt;
  for (std::size_t k = 0; k < over.size(); ++k) m.overstretched[k] = 100 * over[k] / m.area_before;
  m.circumferential = percentiles(stretch.circumferential, areas, stented);
  m.axial = percentiles(stretch.axial, areas, stented);
  m.area_ratio = percentiles(stretch.area_ratio, areas, stented);
  m.largest = percentiles(stretch.largest, areas, stented);
  m.smallest = percentiles(stretch.smallest, areas, stented);
  return m;
}

std::optional<double> distance_to_neighbours(const TriangleMesh& mesh,
                                             std::span<const char> stented, double within) {
  const std::vector<double> way = ways_along_edges(mesh, stented, 2 * within);
  TriangleMesh others;
  others.points = mesh.points;
  for (const Triangle& t : mesh.triangles) {
    if (std::none_of(t.begin(), t.end(), [&](int v) { return std::isfinite(way[at(v)]); }))
      others.triangles.push_back(t);
  }
  if (others.triangles.empty()) return std::nullopt;
  const sdf::MeshDistance distance(others);
  double nearest = within;
  bool found = false;
  for (std::size_t v = 0; v < mesh.points.size(); ++v) {
    if (way[v] != 0) continue;
    const auto closest = distance.closest(mesh.points[v], nearest);
    if (closest.triangle < 0) continue;
    nearest = closest.distance;
    found = true;
  }
  return found ? std::optional(nearest) : std::nullopt;
}

}  // namespace vstent::measure
