#include <oneapi/tbb/blocked_range.h>
#include <oneapi/tbb/parallel_for.h>

#include <Eigen/Geometry>
#include <algorithm>

#include "sdf/box_tree.hpp"
#include "vessels/check.hpp"
#include "vessels/predicates.hpp"

namespace vstent::vessels {
namespace {

using Corners = std::array<Vec3, 3>;
using Sides = std::array<int, 3>;

// Drops the coordinate along which the plane of `t` is steepest, so that its projection keeps an
// area.
class Projection {
 public:
  explicit Projection(const Corners& t) {
    const Vec3 normal = (t[1] - t[0]).cross(t[2] - t[0]).cwiseAbs();
    std::array<int, 3> axes = {0, 1, 2};
    std::sort(axes.begin(), axes.end(), [&](int a, int b) { return normal[a] > normal[b]; });
    for (const int axis : axes) {
      x_ = (axis + 1) % 3;
      y_ = (axis + 2) % 3;
      if (orient2d((*this)(t[0]), (*this)(t[1]), (*this)(t[2])) != 0) return;
    }
  }
  Vec2 operator()(const Vec3& x) const { return {x[x_], x[y_]}; }

 private:
  int x_ = 0, y_ = 1;
};

bool inside(const Vec2& x, const std::array<Vec2, 3>& t) {
  const Sides s = {orient2d(t[0], t[1], x), orient2d(t[1], t[2], x), orient2d(t[2], t[0], x)};
  return (s[0] >= 0 && s[1] >= 0 && s[2] >= 0) || (s[0] <= 0 && s[1] <= 0 && s[2] <= 0);
}

bool coplanar_segment_meets(const Vec3& p, const Vec3& q, const Corners& t) {
  const Projection flat(t);
  const std::array<Vec2, 3> corners = {flat(t[0]), flat(t[1]), flat(t[2])};
  const Vec2 a = flat(p), b = flat(q);
  if (inside(a, corners) || inside(b, corners)) return true;
  for (std::size_t k = 0; k < 3; ++k) {
    if (segments_meet(a, b, corners[k], corners[(k + 1) % 3])) return true;
  }
  return false;
}

bool segment_meets(const Vec3& p, int p_side, const Vec3& q, int q_side, const Corners& t) {
  if (p_side * q_side > 0) return false;
  if (p_side == 0 && q_side == 0) return coplanar_segment_meets(p, q, t);
  const Sides s = {orient3d(p, q, t[0], t[1]), orient3d(p, q, t[1], t[2]),
                   orient3d(p, q, t[2], t[0])};
  return (s[0] >= 0 && s[1] >= 0 && s[2] >= 0) || (s[0] <= 0 && s[1] <= 0 && s[2] <= 0);
}

Sides sides(const Corners& plane, const Corners& of) {
  return {orient3d(plane[0], plane[1], plane[2], of[0]),
          orient3d(plane[0], plane[1], plane[2], of[1]),
          orient3d(plane[0], plane[1], plane[2], of[2])};
}

bool apart(const Sides& s) {
  return (s[0] > 0 && s[1] > 0 && s[2] > 0) || (s[0] < 0 && s[1] < 0 && s[2] < 0);
}

bool disjoint_pair_meets(const Corners& a, const Corners& b) {
  const Sides of_b = sides(a, b);
  if (apart(of_b)) return false;
  const Sides of_a = sides(b, a);
  if (apart(of_a)) return false;
  for (std::size_t k = 0; k < 3; ++k) {
    const std::size_t next = (k + 1) % 3;
    if (segment_meets(b[k], of_b[k], b[next], of_b[next], a)) return true;
    if (segment_meets(a[k], of_a[k], a[next], of_a[next], b)) return true;
  }
  return false;
}

// Triangles that share corner a[0] == b[0] meet elsewhere only if the edge opposite to it of one
// meets the other.
bool corner_pair_meets(const Corners& a, const Corners& b) {
  const int b1 = orient3d(a[0], a[1], a[2], b[1]), b2 = orient3d(a[0], a[1], a[2], b[2]);
  if (segment_meets(b[1], b1, b[2], b2, a)) return true;
  const int a1 = orient3d(b[0], b[1], b[2], a[1]), a2 = orient3d(b[0], b[1], b[2], a[2]);
  return segment_meets(a[1], a1, a[2], a2, b);
}

// Triangles that share edge (a[0], a[1]) overlap only if folded flat onto each other.
bool edge_pair_meets(const Corners& a, const Vec3& other) {
  if (orient3d(a[0], a[1], a[2], other) != 0) return false;
  const Projection flat(a);
  return orient2d(flat(a[0]), flat(a[1]), flat(a[2])) ==
         orient2d(flat(a[0]), flat(a[1]), flat(other));
}

class PairTest {
 public:
  explicit PairTest(const TriangleMesh& mesh) : mesh_(mesh) {}

  bool meets(int first, int second) const {
    Triangle a = mesh_.triangles[static_cast<std::size_t>(first)];
    Triangle b = mesh_.triangles[static_cast<std::size_t>(second)];
    std::size_t shared = 0;  // moves shared corners to the front of both
    for (std::size_t i = 0; i < 3; ++i) {
      const auto found = std::find(b.begin() + static_cast<std::ptrdiff_t>(shared), b.end(), a[i]);
      if (found == b.end()) continue;
      std::swap(a[shared], a[i]);
      std::iter_swap(b.begin() + static_cast<std::ptrdiff_t>(shared), found);
      ++shared;
    }
    const Corners p = corners(a), q = corners(b);
    if (shared == 0) return disjoint_pair_meets(p, q);
    if (shared == 1) return corner_pair_meets(p, q);
    return shared == 3 || edge_pair_meets(p, q[2]);
  }

  Corners corners(const Triangle& t) const {
    return {mesh_.points[static_cast<std::size_t>(t[0])],
            mesh_.points[static_cast<std::size_t>(t[1])],
            mesh_.points[static_cast<std::size_t>(t[2])]};
  }

 private:
  const TriangleMesh& mesh_;
};

}  // namespace

std::vector<std::pair<int, int>> self_intersections(const TriangleMesh& mesh,
                                                    std::span<const char> consider) {
  const std::size_t count = mesh.triangles.size();
  const PairTest test(mesh);
  std::vector<Box> boxes(count);
  std::vector<char> flat(
      count, 0);  // without area: a defect of its own, not a surface that could be crossed
  tbb::parallel_for(tbb::blocked_range<std::size_t>(0, count), [&](const auto& range) {
    for (std::size_t t = range.begin(); t < range.end(); ++t) {
      const Corners x = test.corners(mesh.triangles[t]);
      for (const Vec3& corner : x) boxes[t].include(corner);
      flat[t] = collinear(x[0], x[1], x[2]) ? 1 : 0;
    }
  });
  const sdf::BoxTree tree(boxes);
  const auto marked = [&](std::size_t t) { return consider.empty() || consider[t] != 0; };
  std::vector<std::vector<int>> partners(count);
  tbb::parallel_for(tbb::blocked_range<std::size_t>(0, count, 64), [&](const auto& range) {
    for (std::size_t t = range.begin(); t < range.end(); ++t) {
      if (!marked(t) || flat[t] != 0) continue;
      tree.overlapping(boxes[t], [&](int item) {
        const auto other = static_cast<std::size_t>(item);
        if (other == t || flat[other] != 0 || (other < t && marked(other))) return;
        if (test.meets(static_cast<int>(std::min(t, other)),
                       static_cast<int>(std::max(t, other)))) {
          partners[t].push_back(item);
        }
      });
    }
  });
  std::vector<std::pair<int, int>> pairs;
  for (std::size_t t = 0; t < count; ++t) {
    for (const int other : partners[t]) {
      pairs.emplace_back(std::min(static_cast<int>(t), other),
                         std::max(static_cast<int>(t), other));
    }
  }
  std::sort(pairs.begin(), pairs.end());
  return pairs;
}

}  // namespace vstent::vessels
