#include "meshing/edge_lengths.hpp"

#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "meshing/edge_graph.hpp"
#include "vessels/half_edges.hpp"

namespace vstent::meshing {
namespace {

struct Edge {
  int a = 0, b = 0;
  double length = 0;
  bool curve = false;  ///< between faces, or on the border
  double bend = 0;     ///< rad, signed; 0 on curves
};

Vec3 doubled_area(const TriangleMesh& mesh, int triangle) {
  const auto& [a, b, c] = mesh.triangles[static_cast<std::size_t>(triangle)];
  const Vec3& origin = mesh.points[static_cast<std::size_t>(a)];
  return (mesh.points[static_cast<std::size_t>(b)] - origin)
      .cross(mesh.points[static_cast<std::size_t>(c)] - origin);
}

std::vector<Edge> edges_of(const TriangleMesh& mesh, std::span<const int> face) {
  std::vector<Edge> edges;
  const auto halves = vessels::sorted_half_edges(mesh);
  vessels::for_each_edge(halves, [&](std::size_t begin, std::size_t end) {
    const auto& first = halves[begin];
    const Vec3 along = mesh.points[static_cast<std::size_t>(first.high)] -
                       mesh.points[static_cast<std::size_t>(first.low)];
    Edge edge{first.low, first.high, along.norm(), true, 0};
    if (end - begin == 2 && face[static_cast<std::size_t>(first.triangle)] ==
                                face[static_cast<std::size_t>(halves[begin + 1].triangle)]) {
      edge.curve = false;
      const Vec3 n = doubled_area(mesh, first.triangle),
                 m = doubled_area(mesh, halves[begin + 1].triangle);
      const double side = (first.ascending ? 1 : -1) * n.cross(m).dot(along);
      edge.bend = std::copysign(std::atan2(n.cross(m).norm(), n.dot(m)), side);
    }
    edges.push_back(edge);
  });
  return edges;
}

EdgeGraph graph_of(std::size_t points, const std::vector<Edge>& edges) {
  std::vector<std::array<int, 2>> ends;
  std::vector<double> lengths;
  for (const Edge& e : edges) {
    ends.push_back({e.a, e.b});
    lengths.push_back(e.length);
  }
  return {points, ends, lengths};
}

std::vector<double> curvatures(const TriangleMesh& mesh, const std::vector<Edge>& edges) {
  const std::size_t count = mesh.points.size();
  std::vector<Eigen::Matrix3d> bends(count, Eigen::Matrix3d::Zero());
  std::vector<double> areas(count, 0);
  for (const Edge& e : edges) {
    if (e.curve || !(e.length > 0)) continue;
    const Vec3 along =
        mesh.points[static_cast<std::size_t>(e.b)] - mesh.points[static_cast<std::size_t>(e.a)];
    const Eigen::Matrix3d bend = 0.5 * e.bend / e.length * along * along.transpose();
    bends[static_cast<std::size_t>(e.a)] += bend;
    bends[static_cast<std::size_t>(e.b)] += bend;
  }
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    const double third = doubled_area(mesh, static_cast<int>(t)).norm() / 6;
    for (const int p : mesh.triangles[t]) areas[static_cast<std::size_t>(p)] += third;
  }
  for (int round = 0; round < 3; ++round) {
    auto summed_bends = bends;
    auto summed_areas = areas;
    for (const Edge& e : edges) {
      if (e.curve) continue;
      const auto a = static_cast<std::size_t>(e.a), b = static_cast<std::size_t>(e.b);
      summed_bends[a] += bends[b];
      summed_bends[b] += bends[a];
      summed_areas[a] += areas[b];
      summed_areas[b] += areas[a];
    }
    bends = std::move(summed_bends);
    areas = std::move(summed_areas);
  }
  std::vector<double> result(count, 0);
  for (std::size_t p = 0; p < count; ++p) {
    if (!(areas[p] > 0)) continue;
    const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(bends[p] / areas[p],
                                                                Eigen::EigenvaluesOnly);
    result[p] = solver.eigenvalues().cwiseAbs().maxCoeff();
  }
  return result;
}

}  // namespace

std::vector<double> curvatures(const TriangleMesh& mesh, std::span<const int> face_of_triangle) {
  return curvatures(mesh, edges_of(mesh, face_of_triangle));
}

LengthField::LengthField(const TriangleMesh& mesh, std::span<const int> face_of_triangle,
                         std::span<const char> kept, const EdgeLengths& wanted)
    : wish_(mesh.points.size(), wanted.everywhere), grading_(wanted.grading) {
  const std::vector<Edge> edges = edges_of(mesh, face_of_triangle);
  if (wanted.adaptive) {
    const auto& [shortest, longest, deviation] = *wanted.adaptive;
    const std::vector<double> curved = curvatures(mesh, edges);
    for (std::size_t p = 0; p < wish_.size(); ++p) {
      const double squared = 6 * deviation / std::max(curved[p], 1e-12) - 3 * deviation * deviation;
      wish_[p] = std::clamp(std::sqrt(std::max(0.0, squared)), shortest, longest);
    }
    graph_of(mesh.points.size(), edges).spread(wish_, grading_);
  }
  std::vector<double> longest(mesh.points.size(), 0);
  for (const Edge& e : edges) {
    const auto a = static_cast<std::size_t>(e.a), b = static_cast<std::size_t>(e.b);
    if (!e.curve || !kept[a] || !kept[b]) continue;
    for (const std::size_t p : {a, b}) longest[p] = std::max(longest[p], e.length);
  }
  std::vector<Box> boxes;
  for (std::size_t p = 0; p < longest.size(); ++p) {
    if (!(longest[p] > 0)) continue;
    kept_.push_back({mesh.points[p], longest[p]});
    longest_kept_ = std::max(longest_kept_, longest[p]);
    boxes.emplace_back().include(mesh.points[p]);
  }
  tree_ = sdf::BoxTree(boxes);
  uniform_ = kept_.empty() && !wanted.adaptive;
}

double LengthField::at(const Vec3& x, double wish) const {
  if (kept_.empty()) return wish;
  // Lengths over the grading are distances: both bounds are nearest points with a head start, which
  // keeps the tree's box distances lower bounds. Nothing beyond `limit` matters.
  const auto nearest = [&](double limit, auto&& head_start) {
    const auto squared_reach = [&](int item) {
      const Kept& one = kept_[static_cast<std::size_t>(item)];
      const double reach = (one.point - x).norm() + head_start(one) / grading_;
      return reach * reach;
    };
    return std::sqrt(tree_.nearest(x, squared_reach, limit * limit).squared_distance);
  };
  double length = grading_ * nearest(wish / grading_, [](const Kept& one) { return one.length; });
  // A triangle on an edge that stays cannot have shorter sides: cutting them would never end.
  if (longest_kept_ > length) {
    length = longest_kept_ -
             grading_ * nearest((longest_kept_ - length) / grading_,
                                [&](const Kept& one) { return longest_kept_ - one.length; });
  }
  return length;
}

}  // namespace vstent::meshing
