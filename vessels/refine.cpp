#include "vessels/refine.hpp"

#include <limits>
#include <tuple>

#include "vessels/error.hpp"
#include "vessels/half_edges.hpp"
#include "vessels/text.hpp"

namespace vstent::vessels {
namespace {

constexpr int kRim = -1;
constexpr int kCrowded = -2;  // three or more triangles meet

class Bisection {
 public:
  Bisection(const TriangleMesh& mesh, std::size_t vertex_limit) : vertex_limit_(vertex_limit) {
    result_.mesh = mesh;
    result_.origin.resize(mesh.triangles.size());
    for (std::size_t t = 0; t < result_.origin.size(); ++t) result_.origin[t] = static_cast<int>(t);
    find_neighbours();
  }

  RefinedMesh operator()(const EdgeLimit& longest_edge) {
    const TriangleMesh& mesh = result_.mesh;
    for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
      for (;;) {
        const int side = longest_side(static_cast<int>(t));
        const auto [a, b] = ends(static_cast<int>(t), side);
        const double limit = longest_edge(result_.origin[t], Vec3(0.5 * (point(a) + point(b))));
        if ((point(b) - point(a)).norm() <= limit) break;
        cut_path(static_cast<int>(t));
      }
    }
    return std::move(result_);
  }

 private:
  const Vec3& point(int v) const { return result_.mesh.points[static_cast<std::size_t>(v)]; }
  Triangle& triangle(int t) { return result_.mesh.triangles[static_cast<std::size_t>(t)]; }
  std::array<int, 3>& across(int t) { return neighbours_[static_cast<std::size_t>(t)]; }

  std::pair<int, int> ends(int t, int side) {
    const auto k = static_cast<std::size_t>(side);
    return {triangle(t)[k], triangle(t)[(k + 1) % 3]};
  }

  /// Ties go by vertex number, so that both triangles of an edge agree on it.
  int longest_side(int t) {
    int longest = 0;
    std::tuple<double, int, int> best{-1, 0, 0};
    for (int side = 0; side < 3; ++side) {
      const auto [a, b] = ends(t, side);
      const auto low = std::min(a, b), high = std::max(a, b);
      const std::tuple<double, int, int> own{(point(high) - point(low)).squaredNorm(), low, high};
      if (own > best) {
        best = own;
        longest = side;
      }
    }
    return longest;
  }

  void find_neighbours() {
    neighbours_.assign(result_.mesh.triangles.size(), {kRim, kRim, kRim});
    const std::vector<HalfEdge> edges = sorted_half_edges(result_.mesh);
    const auto side_of = [&](const HalfEdge& e) {
      for (int side = 0; side < 3; ++side) {
        const auto [a, b] = ends(e.triangle, side);
        if (std::min(a, b) == e.low && std::max(a, b) == e.high)
          return static_cast<std::size_t>(side);
      }
      return std::size_t{0};
    };
    for_each_edge(edges, [&](std::size_t begin, std::size_t end) {
      if (end - begin == 1) return;
      for (std::size_t e = begin; e < end; ++e) {
        const int other =
            end - begin > 2 ? kCrowded : edges[e == begin ? begin + 1 : begin].triangle;
        across(edges[e].triangle)[side_of(edges[e])] = other;
      }
    });
  }

  int side_towards(int t, int low, int high) {
    for (int side = 0; side < 3; ++side) {
      const auto [a, b] = ends(t, side);
      if (std::min(a, b) == low && std::max(a, b) == high) return side;
    }
    return -1;
  }

  /// Walks from triangle to triangle over ever longer edges to one that is the longest of both its
  /// triangles, and cuts it.
  void cut_path(int t) {
    for (;;) {
      const int side = longest_side(t);
      const int other = across(t)[static_cast<std::size_t>(side)];
      const auto [a, b] = ends(t, side);
      if (other == kCrowded) {
        throw Error(ExitCode::geometry,
                    "refining the wall would cut an edge of three triangles at " +
                        place(0.5 * (point(a) + point(b))) + " mm");
      }
      if (other == kRim) return cut(t, side, -1, -1);
      const int back = side_towards(other, std::min(a, b), std::max(a, b));
      if (longest_side(other) == back) return cut(t, side, other, back);
      t = other;
    }
  }

  void cut(int t, int side, int other, int back) {
    std::vector<Vec3>& points = result_.mesh.points;
    if (points.size() >= vertex_limit_) {
      throw Error(ExitCode::resources, "refining the wall needs more than " +
                                           std::to_string(vertex_limit_) +
                                           " vertices; take longer edges");
    }
    const auto [a, b] = ends(t, side);
    const int middle = static_cast<int>(points.size());
    points.push_back(0.5 * (point(a) + point(b)));
    result_.parents.push_back({a, b});
    const int t_far = halve(t, side, middle);
    if (other < 0) return;
    const int other_far = halve(other, back, middle);
    for (const int end : {a, b}) {
      const int piece = has_corner(t, end) ? t : t_far;
      const int other_piece = has_corner(other, end) ? other : other_far;
      link(piece, end, middle, other_piece);
      link(other_piece, end, middle, piece);
    }
  }

  bool has_corner(int t, int v) {
    const Triangle& corners = triangle(t);
    return std::find(corners.begin(), corners.end(), v) != corners.end();
  }

  void link(int t, int a, int b, int to) {
    across(t)[static_cast<std::size_t>(side_towards(t, std::min(a, b), std::max(a, b)))] = to;
  }

  /// t keeps the half at its side's first end; the new triangle takes the other. Links across the
  /// cut side are left to the caller.
  int halve(int t, int side, int middle) {
    const auto k = static_cast<std::size_t>(side);
    const std::size_t next = (k + 1) % 3, apex = (k + 2) % 3;
    const int far = static_cast<int>(result_.mesh.triangles.size());
    const Triangle whole = triangle(t);
    const std::array<int, 3> around = across(t);
    Triangle far_half = whole;
    far_half[k] = middle;
    triangle(t)[next] = middle;
    result_.mesh.triangles.push_back(far_half);
    result_.origin.push_back(result_.origin[static_cast<std::size_t>(t)]);
    std::array<int, 3> far_across = around;
    far_across[k] = kRim;
    far_across[apex] = t;
    neighbours_.push_back(far_across);
    across(t)[k] = kRim;
    across(t)[next] = far;
    // The side from `next` to the apex went to the far half.
    if (const int outer = around[next]; outer >= 0) {
      for (int& link : across(outer)) {
        if (link == t && side_of_link(outer, link, whole[next], whole[apex])) link = far;
      }
    }
    return far;
  }

  /// Whether `link`, an entry of across(t), stands at the side between a and b.
  bool side_of_link(int t, const int& link, int a, int b) {
    const auto side = static_cast<int>(&link - across(t).data());
    const auto [from, to] = ends(t, side);
    return (from == a && to == b) || (from == b && to == a);
  }

  RefinedMesh result_;
  std::vector<std::array<int, 3>>
      neighbours_;  // per triangle, across side k from corner k to k + 1
  std::size_t vertex_limit_;
};

}  // namespace

RefinedMesh refine(const TriangleMesh& mesh, const EdgeLimit& longest_edge,
                   std::size_t vertex_limit) {
  return Bisection(mesh, vertex_limit)(longest_edge);
}

}  // namespace vstent::vessels
