#include "vessels/sections.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <unordered_map>

namespace vstent::vessels {
namespace {

using PlanePoint = Eigen::Vector2d;

/// A cut through a mesh edge, named by the edge so that neighbouring triangles agree on it.
struct EdgeCut {
  std::uint64_t edge;
  Vec3 point;
  EdgeCrossing crossing;
};

std::uint64_t edge_key(int a, int b) {
  const auto [low, high] = std::minmax(a, b);
  return (static_cast<std::uint64_t>(low) << 32) | static_cast<std::uint32_t>(high);
}

double signed_area(const std::vector<PlanePoint>& outline) {
  double sum = 0;
  for (std::size_t i = 0; i < outline.size(); ++i) {
    const PlanePoint& p = outline[i];
    const PlanePoint& q = outline[(i + 1) % outline.size()];
    sum += p.x() * q.y() - p.y() * q.x();
  }
  return 0.5 * sum;
}

bool winds_around_origin(const std::vector<PlanePoint>& outline) {
  bool inside = false;
  for (std::size_t i = 0; i < outline.size(); ++i) {
    const PlanePoint& p = outline[i];
    const PlanePoint& q = outline[(i + 1) % outline.size()];
    if ((p.y() > 0) != (q.y() > 0) && p.x() - p.y() * (q.x() - p.x()) / (q.y() - p.y()) > 0)
      inside = !inside;
  }
  return inside;
}

PlanePoint area_centroid(const std::vector<PlanePoint>& outline, double area) {
  PlanePoint sum = PlanePoint::Zero();
  for (std::size_t i = 0; i < outline.size(); ++i) {
    const PlanePoint& p = outline[i];
    const PlanePoint& q = outline[(i + 1) % outline.size()];
    sum += (p + q) * (p.x() * q.y() - p.y() * q.x());
  }
  return sum / (6 * area);
}

/// Between the farthest crossings of the outline on both sides of `from` along `direction`.
double chord(const std::vector<PlanePoint>& outline, const PlanePoint& from,
             const PlanePoint& direction) {
  double ahead = 0, behind = 0;
  const PlanePoint normal(-direction.y(), direction.x());
  PlanePoint p = outline.back() - from;
  double dp = p.dot(normal);
  for (const PlanePoint& next : outline) {
    const PlanePoint q = next - from;
    const double dq = q.dot(normal);
    if ((dp > 0) != (dq > 0)) {
      const double along = (p + (q - p) * (dp / (dp - dq))).dot(direction);
      ahead = std::max(ahead, along);
      behind = std::max(behind, -along);
    }
    p = q;
    dp = dq;
  }
  return ahead + behind;
}

Section measure(const std::vector<Vec3>& points, const std::vector<PlanePoint>& outline,
                const Vec3& origin, const Vec3& u, const Vec3& v) {
  Section section;
  section.outline = points;
  const double area = signed_area(outline);
  section.area = std::abs(area);
  const PlanePoint centroid = area_centroid(outline, area);
  section.centroid = origin + centroid.x() * u + centroid.y() * v;
  for (std::size_t i = 0; i < outline.size(); ++i) {
    section.perimeter += (outline[(i + 1) % outline.size()] - outline[i]).norm();
  }
  section.equivalent_diameter = std::sqrt(4 * section.area / std::numbers::pi);
  constexpr int kDirections =
      90;  // every 2 degrees: a chord is at most 1 - cos(1 deg) = 0.015 % off its extreme
  section.min_diameter = std::numeric_limits<double>::infinity();
  for (int k = 0; k < kDirections; ++k) {
    const double angle = std::numbers::pi * k / kDirections;
    const PlanePoint direction(std::cos(angle), std::sin(angle));
    const double across = chord(outline, centroid, direction);
    section.min_diameter = std::min(section.min_diameter, across);
    section.max_diameter = std::max(section.max_diameter, across);
  }
  return section;
}

std::vector<Box> triangle_boxes(const TriangleMesh& mesh) {
  std::vector<Box> boxes(mesh.triangles.size());
  for (std::size_t t = 0; t < boxes.size(); ++t) {
    for (const int vertex : mesh.triangles[t])
      boxes[t].include(mesh.points[static_cast<std::size_t>(vertex)]);
  }
  return boxes;
}

}  // namespace

Sectioner::Sectioner(const TriangleMesh& mesh) : mesh_(mesh), tree_(triangle_boxes(mesh)) {
  for (const Vec3& x : mesh_.points) bounds_.include(x);
}

std::optional<Section> Sectioner::cut(const Vec3& centre, const Vec3& normal, double reach) const {
  const Vec3 axis = normal.normalized();
  int smallest = 0;
  axis.cwiseAbs().minCoeff(&smallest);
  const Vec3 u = axis.cross(Vec3::Unit(smallest)).normalized();
  const Vec3 v = axis.cross(u);

  // Each cut triangle joins two cut edges, from the one where its oriented boundary goes below the
  // plane to the other, so that every outline is a cycle of the links.
  struct Link {
    EdgeCut from;
    std::uint64_t to;
    bool seen;
  };
  std::unordered_map<std::uint64_t, Link> links;
  std::vector<std::uint64_t> starts;
  Box box;
  box.include(centre);
  box.pad(reach);
  tree_.overlapping(box, [&](int t) {
    const Triangle& triangle = mesh_.triangles[static_cast<std::size_t>(t)];
    double height[3];
    for (int k = 0; k < 3; ++k) {
      height[k] =
          (mesh_.points[static_cast<std::size_t>(triangle[static_cast<std::size_t>(k)])] - centre)
              .dot(axis);
    }
    std::optional<EdgeCut> down;
    std::optional<EdgeCut> up;
    for (int k = 0; k < 3; ++k) {
      const int l = (k + 1) % 3;
      if ((height[k] >= 0) == (height[l] >= 0)) continue;
      const int a = triangle[static_cast<std::size_t>(k)];
      const int b = triangle[static_cast<std::size_t>(l)];
      const Vec3& p = mesh_.points[static_cast<std::size_t>(a)];
      const Vec3& q = mesh_.points[static_cast<std::size_t>(b)];
      const double share = height[k] / (height[k] - height[l]);
      const EdgeCut cut{edge_key(a, b), p + (q - p) * share, {a, b, share, t}};
      (height[k] >= 0 ? down : up) = cut;
    }
    if (!down || !up) return;
    if (links.emplace(down->edge, Link{*down, up->edge, false}).second)
      starts.push_back(down->edge);
  });

  std::sort(starts.begin(), starts.end());
  std::optional<Section> best;
  for (const std::uint64_t start : starts) {
    std::vector<Vec3> points;
    std::vector<EdgeCrossing> crossings;
    std::uint64_t edge = start;
    bool closed = false;
    while (!closed) {
      const auto link = links.find(edge);
      if (link == links.end() || link->second.seen) break;
      link->second.seen = true;
      points.push_back(link->second.from.point);
      crossings.push_back(link->second.from.crossing);
      edge = link->second.to;
      closed = edge == start;
    }
    if (!closed || points.size() < 3) continue;
    std::vector<PlanePoint> outline;
    outline.reserve(points.size());
    for (const Vec3& p : points) outline.emplace_back((p - centre).dot(u), (p - centre).dot(v));
    if (!winds_around_origin(outline) || std::abs(signed_area(outline)) <= 0) continue;
    if (best && std::abs(signed_area(outline)) >= best->area) continue;
    best = measure(points, outline, centre, u, v);
    best->crossings = std::move(crossings);
  }
  return best;
}

std::optional<Section> Sectioner::cut_within_growing_reach(const Vec3& centre, const Vec3& normal,
                                                           double reach) const {
  const Box& b = bounds_;
  const double all =
      (centre - b.lower).cwiseAbs().cwiseMax((b.upper - centre).cwiseAbs()).maxCoeff();
  for (;; reach *= 2) {
    auto section = cut(centre, normal, reach);
    if (section || reach >= all) return section;
  }
}

}  // namespace vstent::vessels
