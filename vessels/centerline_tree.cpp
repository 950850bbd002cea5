#include "vessels/centerline_tree.hpp"

#include <tbb/parallel_for.h>

#include <Eigen/Geometry>
#include <Eigen/Sparse>
#include <algorithm>
#include <cmath>
#include <numeric>

#include "sdf/polyline.hpp"

namespace vstent::vessels {
namespace {

std::size_t at(int index) { return static_cast<std::size_t>(index); }

/// Weights of the divided difference of order 3, times 3!: the third derivative of the cubic
/// through four places.
std::array<double, 4> third_derivative_weights(const std::array<double, 4>& s) {
  std::array<double, 4> weights{};
  for (std::size_t i = 0; i < 4; ++i) {
    double product = 6.0;
    for (std::size_t j = 0; j < 4; ++j) {
      if (j != i) product /= s[i] - s[j];
    }
    weights[i] = product;
  }
  return weights;
}

/// First derivative at places[k] of the parabola, or cubic and so on, through all the places
/// (Lagrange).
Vec3 derivative_at(const std::vector<double>& s, const Polyline& p, std::size_t k) {
  Vec3 derivative = Vec3::Zero();
  for (std::size_t i = 0; i < s.size(); ++i) {
    double weight = 0;
    if (i == k) {
      for (std::size_t j = 0; j < s.size(); ++j) {
        if (j != k) weight += 1.0 / (s[k] - s[j]);
      }
    } else {
      weight = 1.0 / (s[i] - s[k]);
      for (std::size_t j = 0; j < s.size(); ++j) {
        if (j != i && j != k) weight *= (s[k] - s[j]) / (s[i] - s[j]);
      }
    }
    derivative += weight * p[i];
  }
  return derivative;
}

/// Derivative by arc length where `before` meets `after` (before.back() == after.front()), from two
/// points either side.
Vec3 derivative_at_joint(const Polyline& before, const Polyline& after) {
  Polyline points;
  const std::size_t behind = std::min<std::size_t>(2, before.empty() ? 0 : before.size() - 1);
  for (std::size_t i = 0; i < behind; ++i) points.push_back(before[before.size() - 1 - behind + i]);
  const std::size_t ahead = std::min<std::size_t>(3, after.size());
  points.insert(points.end(), after.begin(), after.begin() + static_cast<std::ptrdiff_t>(ahead));
  return derivative_at(arc_lengths(points), points, behind);
}

/// The cubic spline through the points, by arc length of their chords, with the given end
/// derivatives.
class ClampedSpline {
 public:
  ClampedSpline(const Polyline& points, const Vec3& first, const Vec3& last)
      : points_(points), s_(arc_lengths(points)), slopes_(points.size()) {
    const std::size_t n = points.size();
    slopes_.front() = first;
    slopes_.back() = last;
    if (n < 3) return;
    // Continuity of the second derivative at inner points; tridiagonal, solved by elimination.
    std::vector<double> upper(n, 0.0);
    for (std::size_t i = 1; i + 1 < n; ++i) {
      const double a = 1.0 / (s_[i] - s_[i - 1]);
      const double b = 1.0 / (s_[i + 1] - s_[i]);
      Vec3 right =
          3.0 * (a * a * (points[i] - points[i - 1]) + b * b * (points[i + 1] - points[i]));
      right -= a * slopes_[i - 1];
      const double pivot = 2.0 * (a + b) - a * upper[i - 1];
      upper[i] = b / pivot;
      slopes_[i] = right / pivot;
    }
    for (std::size_t i = n - 2; i >= 1; --i) slopes_[i] -= upper[i] * slopes_[i + 1];
  }

  Vec3 operator()(double s) const {
    auto next = std::upper_bound(s_.begin() + 1, s_.end() - 1, s);
    const auto i = static_cast<std::size_t>(next - s_.begin()) - 1;
    const double width = s_[i + 1] - s_[i];
    const double t = std::clamp((s - s_[i]) / width, 0.0, 1.0);
    const double u = 1.0 - t;
    return u * u * (1.0 + 2.0 * t) * points_[i] + t * t * (1.0 + 2.0 * u) * points_[i + 1] +
           width * t * u * (u * slopes_[i] - t * slopes_[i + 1]);
  }

 private:
  Polyline points_;
  std::vector<double> s_;
  std::vector<Vec3> slopes_;
};

}  // namespace

Centerline branches_of(const AxisTree& tree) {
  const std::size_t count = tree.points.size();
  std::vector<std::vector<int>> children(count);
  for (std::size_t n = 0; n < count; ++n) {
    if (tree.parent[n] >= 0) children[at(tree.parent[n])].push_back(static_cast<int>(n));
  }
  const auto chain_from = [&](int start, int first) {
    std::vector<int> chain{start};
    for (int node = first;; node = children[at(node)].front()) {
      chain.push_back(node);
      if (children[at(node)].size() != 1) return chain;
    }
  };
  const auto mean_radius = [&](const std::vector<int>& chain) {
    double sum = 0;
    for (std::size_t i = 1; i < chain.size(); ++i) sum += tree.radii[at(chain[i])];
    return sum / static_cast<double>(chain.size() - 1);
  };

  Centerline result;
  struct Waiting {
    std::vector<int> chain;
    int parent_branch;
  };
  std::vector<Waiting> queue;
  const auto enqueue_children = [&](int node, int branch) {
    std::vector<std::pair<double, std::vector<int>>> chains;
    for (const int child : children[at(node)]) {
      auto chain = chain_from(node, child);
      chains.emplace_back(mean_radius(chain), std::move(chain));
    }
    std::stable_sort(chains.begin(), chains.end(),
                     [](const auto& a, const auto& b) { return a.first > b.first; });
    for (auto& [radius, chain] : chains) queue.push_back({std::move(chain), branch});
  };
  if (count > 0) enqueue_children(0, -1);
  for (std::size_t q = 0; q < queue.size(); ++q) {
    CenterlineBranch branch;
    branch.id = static_cast<int>(q);
    branch.parent = queue[q].parent_branch;
    for (const int node : queue[q].chain) {
      branch.points.push_back(tree.points[at(node)]);
      branch.radii.push_back(tree.radii[at(node)]);
    }
    const int last = queue[q].chain.back();
    result.branches.push_back(std::move(branch));
    enqueue_children(last, static_cast<int>(q));
  }
  return result;
}

Polyline adaptive_stations(const Polyline& line, const sdf::MeshDistance& wall, double fraction,
                           double from) {
  const std::vector<double> s = arc_lengths(line);
  const double total = s.back();
  std::vector<double> places{from};
  const double longest = total - from;
  if (!(longest > 0)) return {line.back(), line.back()};
  while (places.back() < total) {
    const Vec3 x = point_at(line, s, places.back());
    const double step =
        std::clamp(fraction * wall.closest(x).distance, 1e-3 * longest, 0.25 * longest);
    places.push_back(places.back() + step);
  }
  // Spread the overshoot over all the steps, so that the last one is no sliver.
  const double scale = longest / (places.back() - from);
  Polyline stations;
  for (const double place : places)
    stations.push_back(point_at(line, s, from + (place - from) * scale));
  stations.back() = line.back();
  return stations;
}

Polyline centre(const Polyline& guess, const sdf::MeshDistance& wall) {
  // Discs of these radii, in distances to the wall: every candidate lies inside the ball of its
  // station. The spacing of candidates is half of it, each level reaches one and a half spacings of
  // the level before.
  static constexpr std::array<double, 5> kDiscs{0.7, 0.4, 0.2, 0.1, 0.05};
  std::vector<std::array<double, 2>> offsets;
  for (int i = -2; i <= 2; ++i) {
    for (int j = -2; j <= 2; ++j) {
      if (i * i + j * j <= 5) offsets.push_back({0.5 * i, 0.5 * j});
    }
  }

  Polyline line = guess;
  for (const double disc : kDiscs) {
    line = adaptive_stations(line, wall, 1.0 / 3.0);
    const std::size_t count = line.size();
    const std::vector<Vec3> directions = tangents(line);
    struct Candidate {
      Vec3 point;
      double slowness;  // 1 / distance to the wall
      double cost = 0;
      int previous = -1;
    };
    std::vector<std::vector<Candidate>> layers(count);
    tbb::parallel_for(std::size_t{0}, count, [&](std::size_t i) {
      const double depth = wall.closest(line[i]).distance;
      const Vec3 u = directions[i].unitOrthogonal();
      const Vec3 v = directions[i].cross(u);
      const bool end = i == 0 || i + 1 == count;
      for (const auto& [a, b] : offsets) {
        if (end && (a != 0 || b != 0)) continue;
        const double reach = disc * depth;
        const Vec3 x = line[i] + reach * (a * u + b * v);
        const double bound = depth * (1.0 + 1.2 * disc) + 1e-12;
        const double distance = wall.closest(x, bound).distance;
        layers[i].push_back({x, 1.0 / std::max(distance, 1e-9 * depth + 1e-300)});
      }
    });
    for (std::size_t i = 1; i < count; ++i) {
      for (Candidate& candidate : layers[i]) {
        candidate.cost = std::numeric_limits<double>::infinity();
        for (std::size_t k = 0; k < layers[i - 1].size(); ++k) {
          const Candidate& before = layers[i - 1][k];
          const double cost = before.cost + 0.5 * (before.slowness + candidate.slowness) *
                                                (candidate.point - before.point).norm();
          if (cost >= candidate.cost) continue;
          candidate.cost = cost;
          candidate.previous = static_cast<int>(k);
        }
      }
    }
    int chosen = 0;
    for (std::size_t i = count; i-- > 0;) {
      line[i] = layers[i][at(chosen)].point;
      chosen = layers[i][at(chosen)].previous;
    }
  }
  return line;
}

void smooth(AxisTree& tree, double width) {
  const auto count = static_cast<Eigen::Index>(tree.points.size());
  std::vector<Eigen::Triplet<double>> entries;
  Eigen::MatrixX3d right(count, 3);
  std::vector<double> weight(tree.points.size(), 0.0);
  std::vector<int> degree(tree.points.size(), 0);
  for (std::size_t n = 1; n < tree.points.size(); ++n) {
    const std::size_t p = at(tree.parent[n]);
    const double half = 0.5 * (tree.points[n] - tree.points[p]).norm();
    weight[n] += half;
    weight[p] += half;
    ++degree[n];
    ++degree[p];
  }
  for (std::size_t n = 0; n < tree.points.size(); ++n) {
    constexpr double kFixed = 1e6;  // an end's weight against an inner point's
    const double w = degree[n] == 1 ? kFixed * weight[n] : weight[n];
    entries.emplace_back(n, n, w);
    right.row(static_cast<Eigen::Index>(n)) = w * tree.points[n].transpose();
  }
  for (int n = 0; n < static_cast<int>(count); ++n) {
    std::array<int, 4> nodes{n, -1, -1, -1};
    for (std::size_t k = 1; k < 4 && nodes[k - 1] >= 0; ++k)
      nodes[k] = tree.parent[at(nodes[k - 1])];
    if (nodes[3] < 0) continue;
    std::array<double, 4> s{};
    double radius = tree.radii[at(n)];
    for (std::size_t k = 1; k < 4; ++k) {
      s[k] = s[k - 1] + (tree.points[at(nodes[k])] - tree.points[at(nodes[k - 1])]).norm();
      radius = std::min(radius, tree.radii[at(nodes[k])]);
    }
    const auto weights = third_derivative_weights(s);
    const double stiffness = std::pow(width * radius, 6) * s[3] / 3.0;
    for (std::size_t i = 0; i < 4; ++i) {
      for (std::size_t j = 0; j < 4; ++j) {
        entries.emplace_back(nodes[i], nodes[j], stiffness * weights[i] * weights[j]);
      }
    }
  }
  Eigen::SparseMatrix<double> matrix(count, count);
  matrix.setFromTriplets(entries.begin(), entries.end());
  const Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>> factor(matrix);
  const Eigen::MatrixX3d smoothed = factor.solve(right);
  for (std::size_t n = 0; n < tree.points.size(); ++n) {
    if (degree[n] != 1) tree.points[n] = smoothed.row(static_cast<Eigen::Index>(n)).transpose();
  }
}

Centerline evenly_spaced(const Centerline& centerline, double spacing) {
  Centerline result = centerline;
  std::vector<int> first_child(centerline.branches.size(), -1);
  for (const CenterlineBranch& branch : centerline.branches) {
    if (branch.parent >= 0 && first_child[at(branch.parent)] < 0) {
      first_child[at(branch.parent)] = branch.id;
    }
  }
  for (CenterlineBranch& branch : result.branches) {
    const Polyline& points = centerline.branches[at(branch.id)].points;
    const Polyline none;
    const Polyline& before =
        branch.parent < 0 ? none : centerline.branches[at(branch.parent)].points;
    const int child = first_child[at(branch.id)];
    const Vec3 first = derivative_at_joint(before, points);
    const Vec3 last = derivative_at_joint(
        points, child < 0 ? Polyline{points.back()} : centerline.branches[at(child)].points);
    const ClampedSpline spline(points, first, last);
    const std::vector<double> s = arc_lengths(points);
    const auto steps =
        std::max<std::size_t>(1, static_cast<std::size_t>(std::ceil(s.back() / spacing)));
    Polyline even;
    std::vector<double> radii;
    for (std::size_t i = 0; i <= steps; ++i) {
      const double place = s.back() * static_cast<double>(i) / static_cast<double>(steps);
      even.push_back(i == 0 ? points.front() : i == steps ? points.back() : spline(place));
      radii.push_back(value_at(branch.radii, s, place));
    }
    branch.points = std::move(even);
    branch.radii = std::move(radii);
  }
  return result;
}

}  // namespace vstent::vessels
