#include "meshing/tetrahedra.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <numeric>

#include "vessels/predicates.hpp"
#include "vessels/text.hpp"

namespace vstent::meshing {
namespace {

constexpr std::array<std::array<int, 3>, 4> kFacets = {
    {{0, 2, 1}, {0, 1, 3}, {1, 2, 3}, {2, 0, 3}}};
constexpr std::array<std::array<int, 2>, 6> kEdges = {
    {{0, 1}, {0, 2}, {0, 3}, {1, 2}, {1, 3}, {2, 3}}};

const Vec3& at(const std::vector<Vec3>& points, int i) {
  return points[static_cast<std::size_t>(i)];
}

/// A facet of a tetrahedron or a triangle of the surface, corners sorted but its turn remembered.
struct Side {
  int middle = 0, high = 0;
  int owner = 0;      // tetrahedron, or -1 - triangle
  bool even = false;  // the sorted corners are an even permutation of the outward ones
};

/// All sides, those with the same lowest corner together.
class Sides {
 public:
  Sides(const TetMesh& mesh, const std::vector<Triangle>& surface)
      : start_(mesh.points.size() + 1) {
    const auto for_each = [&](auto&& visit) {
      for (std::size_t t = 0; t < mesh.tetrahedra.size(); ++t) {
        for (int k = 0; k < 4; ++k) visit(facet(mesh.tetrahedra[t], k), static_cast<int>(t));
      }
      for (std::size_t t = 0; t < surface.size(); ++t) visit(surface[t], -1 - static_cast<int>(t));
    };
    for_each([&](const Triangle& corners, int) { ++start_[1 + lowest(corners)]; });
    std::partial_sum(start_.begin(), start_.end(), start_.begin());
    sides_.resize(start_.back());
    std::vector<std::size_t> next(start_.begin(), start_.end() - 1);
    for_each([&](const Triangle& corners, int owner) {
      Triangle turned = corners;  // rotated so that the lowest comes first: an even permutation
      std::rotate(turned.begin(), std::min_element(turned.begin(), turned.end()), turned.end());
      sides_[next[lowest(corners)]++] = {std::min(turned[1], turned[2]),
                                         std::max(turned[1], turned[2]), owner,
                                         turned[1] < turned[2]};
    });
    for (std::size_t v = 0; v + 1 < start_.size(); ++v) {
      std::sort(sides_.begin() + static_cast<std::ptrdiff_t>(start_[v]),
                sides_.begin() + static_cast<std::ptrdiff_t>(start_[v + 1]),
                [](const Side& a, const Side& b) {
                  return std::tie(a.middle, a.high, a.owner) < std::tie(b.middle, b.high, b.owner);
                });
    }
  }

  /// Calls visit(begin, end) for the sides on the same three corners.
  template <class Visit>
  void for_each_group(Visit&& visit) const {
    for (std::size_t v = 0; v + 1 < start_.size(); ++v) {
      for (std::size_t begin = start_[v], end = begin; begin < start_[v + 1]; begin = end) {
        while (end < start_[v + 1] && sides_[end].middle == sides_[begin].middle &&
               sides_[end].high == sides_[begin].high)
          ++end;
        visit(&sides_[begin], &sides_[begin] + (end - begin));
      }
    }
  }

 private:
  static std::size_t lowest(const Triangle& corners) {
    return static_cast<std::size_t>(*std::min_element(corners.begin(), corners.end()));
  }
  std::vector<std::size_t> start_;
  std::vector<Side> sides_;
};

int root(std::vector<int>& parent, int i) {
  while (parent[static_cast<std::size_t>(i)] != i) {
    int& above = parent[static_cast<std::size_t>(i)];
    above = parent[static_cast<std::size_t>(above)];
    i = above;
  }
  return i;
}

/// Empty, or the first reason why the numbers cannot be looked at.
std::string index_fault(const TetMesh& mesh) {
  const int points = static_cast<int>(mesh.points.size());
  for (std::size_t i = 0; i < mesh.points.size(); ++i) {
    if (!mesh.points[i].allFinite()) return "point " + std::to_string(i) + " is not finite";
  }
  std::vector<char> used(mesh.points.size(), 0);
  for (std::size_t t = 0; t < mesh.tetrahedra.size(); ++t) {
    for (const int v : mesh.tetrahedra[t]) {
      if (v < 0 || v >= points)
        return "tetrahedron " + std::to_string(t) + " names point " + std::to_string(v) + " of " +
               std::to_string(points);
      used[static_cast<std::size_t>(v)] = 1;
    }
  }
  const auto unused = std::count(used.begin(), used.end(), 0);
  return unused == 0 ? std::string()
                     : vessels::counted(static_cast<std::size_t>(unused), "point") +
                           " belong to no tetrahedron";
}

}  // namespace

Triangle facet(const Tetrahedron& tetrahedron, int k) {
  const auto& corners = kFacets[static_cast<std::size_t>(k)];
  const auto corner = [&](std::size_t i) {
    return tetrahedron[static_cast<std::size_t>(corners[i])];
  };
  return {corner(0), corner(1), corner(2)};
}

double signed_volume(const TetMesh& mesh, const Tetrahedron& t) {
  const Vec3& a = at(mesh.points, t[0]);
  return (at(mesh.points, t[1]) - a)
             .cross(at(mesh.points, t[2]) - a)
             .dot(at(mesh.points, t[3]) - a) /
         6;
}

Partition check_partition(const TetMesh& mesh, const std::vector<Triangle>& surface) {
  Partition result;
  if (mesh.tetrahedra.empty()) {
    result.fault = "it has no tetrahedra";
    return result;
  }
  if (result.fault = index_fault(mesh); !result.fault.empty()) return result;
  std::size_t inverted = 0, flat = 0;
  for (const Tetrahedron& t : mesh.tetrahedra) {
    const int turn = vessels::orient3d(at(mesh.points, t[0]), at(mesh.points, t[1]),
                                       at(mesh.points, t[2]), at(mesh.points, t[3]));
    inverted += turn < 0;
    flat += turn == 0;
  }
  if (inverted + flat > 0) {
    result.fault = vessels::counted(inverted, "inverted tetrahedron") + " and " +
                   vessels::counted(flat, "flat tetrahedron");
    return result;
  }

  result.behind.assign(surface.size(), -1);
  std::vector<int> parent(mesh.tetrahedra.size());
  std::iota(parent.begin(), parent.end(), 0);
  std::size_t pieces = mesh.tetrahedra.size();
  std::size_t missing = 0, open = 0, turned = 0, crowded = 0;
  Sides(mesh, surface).for_each_group([&](const Side* begin, const Side* end) {
    const auto triangles = std::count_if(begin, end, [](const Side& s) { return s.owner < 0; });
    const auto facets = (end - begin) - triangles;
    if (triangles > 1 || facets > 2 || (triangles == 1 && facets == 2)) {
      ++crowded;
    } else if (facets == 0) {
      ++missing;
    } else if (facets == 1 && triangles == 0) {
      ++open;
    } else if (triangles == 1) {  // owners are sorted: the triangle comes first
      result.behind[static_cast<std::size_t>(-1 - begin[0].owner)] = begin[1].owner;
      turned += begin[0].even != begin[1].even;
    } else {
      turned += begin[0].even == begin[1].even;
      const int a = root(parent, begin[0].owner), b = root(parent, begin[1].owner);
      pieces -= a != b;
      parent[static_cast<std::size_t>(std::max(a, b))] = std::min(a, b);
    }
  });
  const std::pair<std::size_t, const char*> faults[] = {
      {missing, "of the surface's triangles are missing"},
      {open, "facets lie open that the surface does not have"},
      {turned, "facets are turned against their neighbour"},
      {crowded, "facets belong to more than two sides"}};
  for (const auto& [count, what] : faults) {
    if (count == 0) continue;
    result.fault += (result.fault.empty() ? "" : ", ") + std::to_string(count) + " " + what;
  }
  if (result.fault.empty() && pieces > 1)
    result.fault = "it falls into " + std::to_string(pieces) + " pieces";
  return result;
}

std::array<double, 2> dihedral_range(const Vec3& a, const Vec3& b, const Vec3& c, const Vec3& d) {
  // Inward normals of the facets opposite a, b, c, d, as long as twice the facet.
  const std::array<Vec3, 4> normal = {(d - b).cross(c - b), (c - a).cross(d - a),
                                      (d - a).cross(b - a), (b - a).cross(c - a)};
  std::array<double, 4> length{};
  for (std::size_t k = 0; k < 4; ++k) length[k] = normal[k].norm();
  double smallest = std::numbers::pi, largest = 0;
  for (std::size_t i = 0; i < 4; ++i) {
    for (std::size_t k = i + 1; k < 4; ++k) {
      if (length[i] == 0 || length[k] == 0) return {0, 180};
      const double cosine =
          std::clamp(-normal[i].dot(normal[k]) / (length[i] * length[k]), -1.0, 1.0);
      const double angle = std::acos(cosine);
      smallest = std::min(smallest, angle);
      largest = std::max(largest, angle);
    }
  }
  constexpr double kDegrees = 180 / std::numbers::pi;
  return {smallest * kDegrees, largest * kDegrees};
}

TetQuality quality(const TetMesh& mesh) {
  TetQuality q;
  if (mesh.tetrahedra.empty()) return q;
  std::vector<double> smallest(mesh.tetrahedra.size());
  q.smallest_edge = std::numeric_limits<double>::infinity();
  double edges = 0;
  for (std::size_t t = 0; t < mesh.tetrahedra.size(); ++t) {
    const Tetrahedron& corners = mesh.tetrahedra[t];
    const auto [low, high] =
        dihedral_range(at(mesh.points, corners[0]), at(mesh.points, corners[1]),
                       at(mesh.points, corners[2]), at(mesh.points, corners[3]));
    smallest[t] = low;
    q.largest_dihedral = std::max(q.largest_dihedral, high);
    q.below_10 += low < 10;
    if (low < q.smallest_dihedral) {
      q.smallest_dihedral = low;
      q.worst = static_cast<int>(t);
    }
    q.volume += signed_volume(mesh, corners);
    for (const auto& [i, k] : kEdges) {
      const double length = (at(mesh.points, corners[static_cast<std::size_t>(i)]) -
                             at(mesh.points, corners[static_cast<std::size_t>(k)]))
                                .norm();
      q.smallest_edge = std::min(q.smallest_edge, length);
      q.largest_edge = std::max(q.largest_edge, length);
      edges += length;
    }
  }
  q.mean_edge = edges / (6.0 * static_cast<double>(mesh.tetrahedra.size()));
  const auto quantile = [&](double share) {
    const auto rank = static_cast<std::ptrdiff_t>(share * static_cast<double>(smallest.size() - 1));
    std::nth_element(smallest.begin(), smallest.begin() + rank, smallest.end());
    return smallest[static_cast<std::size_t>(rank)];
  };
  q.dihedral_p1 = quantile(0.01);
  q.dihedral_median = quantile(0.5);
  return q;
}

}  // namespace vstent::meshing
