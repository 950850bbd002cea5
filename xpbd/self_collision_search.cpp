// What is near: the lists that hold until particles leave their balls.
#include <algorithm>
#include <cmath>

#include "xpbd/parallel.hpp"
#include "xpbd/proximity.hpp"
#include "xpbd/self_collision.hpp"

namespace vstent::xpbd {
namespace {

// Of the reach: what a push from outside leaves of the way to others. The pressure is then 7.5 E.
constexpr double kRoom = 0.25;

}  // namespace

struct SelfCollision::Found {
  Near near;  // ranges of this cell's own lists
  std::vector<EdgePair> edge_pairs;
};

bool SelfCollision::joined(int of_vertex_or_edge, int other, bool of_edges) const {
  return !joined_.empty() && std::binary_search(joined_.begin(), joined_.end(),
                                                std::array{of_vertex_or_edge, other, +of_edges});
}

bool SelfCollision::any_free(std::span<const int> particles) const {
  return std::any_of(particles.begin(), particles.end(), [&](int k) { return free_[at(k)]; });
}

/// What the vertices and edges of a cell may meet in others; every pair of edges once.
void SelfCollision::search(int cell, std::span<const int> partners, std::span<const Slot> particles,
                           Found& found) const {
  const auto x = [&](int k) { return place(particles[at(k)]); };
  struct Ball {
    int item;
    Vec3 centre;
    double radius;
  };
  std::vector<Ball> near_triangles, near_edges;
  const auto ball_of_edge = [&](int e) {
    const auto [i, j] = cells_.edges()[at(e)];
    return Ball{e, 0.5 * (x(i) + x(j)), 0.5 * (x(i) - x(j)).norm()};
  };
  for (const int partner : partners) {
    for (const int t : cells_.triangles(partner)) {
      const auto [a, b, c] = triangles_[at(t)];
      const Vec3 centre = (x(a) + x(b) + x(c)) / 3;
      near_triangles.push_back(
          {t, centre,
           std::sqrt(std::max({(x(a) - centre).squaredNorm(), (x(b) - centre).squaredNorm(),
                               (x(c) - centre).squaredNorm()}))});
    }
    if (partner > cell)
      for (const int e : cells_.edges(partner)) near_edges.push_back(ball_of_edge(e));
  }
  const auto may_be_near = [](const Vec3& centre, double radius, const Ball& ball, double reach) {
    const double limit = reach + radius + ball.radius;
    return (centre - ball.centre).squaredNorm() <= limit * limit;
  };
  std::vector<NearTriangle> near;
  for (const int v : cells_.vertices(cell)) {
    // What may push or be met before both have moved as far as they may.
    const double reach = std::max(reach_[at(v)] + 2 * step_, step_ / kSafe);
    near.clear();
    for (const Ball& ball : near_triangles) {
      if (!may_be_near(x(v), 0, ball, reach)) continue;
      const auto [a, b, c] = triangles_[at(ball.item)];
      if (!any_free(std::array{v, a, b, c}) || joined(v, ball.item, false)) continue;
      const double distance = point_triangle(x(v), x(a), x(b), x(c)).distance;
      if (distance <= reach) near.push_back({ball.item, distance, {}});
    }
    if (!near.empty()) watch(v, near, particles, found.near);
  }
  for (const int e : cells_.edges(cell)) {
    const Ball own = ball_of_edge(e);
    const auto [i, j] = cells_.edges()[at(e)];
    for (const Ball& ball : near_edges) {
      if (!may_be_near(own.centre, own.radius, ball, edge_search_)) continue;
      const auto [k, l] = cells_.edges()[at(ball.item)];
      if (!any_free(std::array{i, j, k, l}) || joined(e, ball.item, true)) continue;
      const double distance = segment_segment(x(i), x(j), x(k), x(l)).distance;
      if (distance <= edge_search_) found.edge_pairs.push_back({e, ball.item, distance});
    }
  }
}

/// Lists the triangles, the edges between them and their corners.
void SelfCollision::watch(int vertex, std::vector<NearTriangle>& triangles,
                          std::span<const Slot> particles, Near& near) const {
  std::sort(triangles.begin(), triangles.end(),
            [](const NearTriangle& a, const NearTriangle& b) { return a.triangle < b.triangle; });
  const auto listed = [&](int triangle) {
    const auto found =
        std::lower_bound(triangles.begin(), triangles.end(), triangle,
                         [](const NearTriangle& one, int sought) { return one.triangle < sought; });
    return found != triangles.end() && found->triangle == triangle;
  };
  std::vector<int> corners;
  for (const NearTriangle& t : triangles)
    corners.insert(corners.end(), triangles_[at(t.triangle)].begin(),
                   triangles_[at(t.triangle)].end());
  std::sort(corners.begin(), corners.end());
  Watched watched;
  watched.vertex = vertex;
  watched.first_triangle = near.triangles.size();
  watched.first_edge = near.edges.size();
  watched.first_corner = near.corners.size();
  for (auto corner = corners.begin(); corner != corners.end();) {
    const auto next = std::upper_bound(corner, corners.end(), *corner);
    near.corners.push_back({*corner, next - corner == around_[at(*corner)]});
    corner = next;
  }
  const auto first_corner =
      near.corners.begin() + static_cast<std::ptrdiff_t>(watched.first_corner);
  const auto local = [&](int particle) {
    return static_cast<int>(std::lower_bound(first_corner, near.corners.end(), particle,
                                             [](const NearCorner& corner, int sought) {
                                               return corner.particle < sought;
                                             }) -
                            first_corner);
  };
  const auto x = [&](int k) { return place(particles[at(k)]); };
  for (NearTriangle& t : triangles) {
    const Triangle& corner = triangles_[at(t.triangle)];
    for (std::size_t k = 0; k < 3; ++k) {
      t.corners[k] = local(corner[k]);
      const int a = corner[k], b = corner[(k + 1) % 3], other = beyond_[at(t.triangle)][k];
      if (other < t.triangle || !listed(other)) continue;
      near.edges.push_back({point_segment(x(vertex), x(a), x(b)).distance, {local(a), local(b)}});
    }
  }
  std::sort(triangles.begin(), triangles.end(), [](const NearTriangle& a, const NearTriangle& b) {
    return std::pair(a.distance, a.triangle) < std::pair(b.distance, b.triangle);
  });
  std::sort(near.edges.begin() + static_cast<std::ptrdiff_t>(watched.first_edge), near.edges.end(),
            [](const NearEdge& a, const NearEdge& b) {
              return std::pair(a.distance, a.corners) < std::pair(b.distance, b.corners);
            });
  near.triangles.insert(near.triangles.end(), triangles.begin(), triangles.end());
  watched.last_triangle = near.triangles.size();
  watched.last_edge = near.edges.size();
  watched.last_corner = near.corners.size();
  near.vertices.push_back(watched);
}

void SelfCollision::look(std::span<const Slot> particles) {
  for_each_particle(particles.size(), [&](std::size_t k, std::size_t) {
    reference_[k] = place(particles[k]);
    balls_[k] = wide_;
  });
  near_ = {};
  edge_pairs_.clear();
  alert_.clear();
  cells_.place_at(particles);
  std::vector<std::vector<int>> partners(cells_.size());
  std::vector<double> ball(cells_.size(), wide_);
  for (const auto& [a, b] : cells_.meetings(search_ + 2 * wide_)) {
    if (cells_.back_to_back(a, b)) continue;
    // Cells that are not searched come no nearer to each other than they would be searched.
    const double gap = cells_.gap(a, b);
    for (const int c : {a, b}) ball[at(c)] = std::clamp(0.5 * (gap - search_), step_, ball[at(c)]);
    if (gap > search_) continue;
    partners[at(a)].push_back(b);
    partners[at(b)].push_back(a);
  }
  std::vector<int> cells;
  for (std::size_t c = 0; c < cells_.size(); ++c) {
    if (!(ball[c] < wide_)) continue;
    for (const int k : cells_.reached(static_cast<int>(c))) {
      if (balls_[at(k)] == wide_) alert_.push_back(k);
      balls_[at(k)] = std::min(balls_[at(k)], ball[c]);
    }
    if (!partners[c].empty()) cells.push_back(static_cast<int>(c));
  }
  std::vector<Found> found(cells.size());
  side_by_side(cells.size(), [&](std::size_t n) {
    search(cells[n], partners[at(cells[n])], particles, found[n]);
  });
  std::vector<double> clearance(particles.size(), std::numeric_limits<double>::infinity());
  const auto clear = [&](int k, double distance) {
    clearance[at(k)] = std::min(clearance[at(k)], distance);
  };
  const auto append = [](auto& to, const auto& from) {
    to.insert(to.end(), from.begin(), from.end());
  };
  for (const Found& of_cell : found) {
    for (Watched w : of_cell.near.vertices) {
      w.first_triangle += near_.triangles.size();
      w.last_triangle += near_.triangles.size();
      w.first_edge += near_.edges.size();
      w.last_edge += near_.edges.size();
      w.first_corner += near_.corners.size();
      w.last_corner += near_.corners.size();
      near_.vertices.push_back(w);
    }
    append(near_.triangles, of_cell.near.triangles);
    append(near_.edges, of_cell.near.edges);
    append(near_.corners, of_cell.near.corners);
    append(edge_pairs_, of_cell.edge_pairs);
  }
  for (const Watched& w : near_.vertices)
    for (std::size_t n = w.first_triangle; n < w.last_triangle; ++n) {
      const NearTriangle& near = near_.triangles[n];
      clear(w.vertex, near.distance);
      for (const int k : triangles_[at(near.triangle)]) clear(k, near.distance);
    }
  for (const EdgePair& pair : edge_pairs_)
    for (const int e : {pair.a, pair.b})
      for (const int k : cells_.edges()[at(e)]) clear(k, pair.distance);
  for (const int k : alert_) balls_[at(k)] = std::min(balls_[at(k)], kSafe * clearance[at(k)]);
  pushed_balls_ = balls_;
  for (const int k : alert_)
    pushed_balls_[at(k)] =
        std::clamp(kSafe * (clearance[at(k)] - kRoom * reach_[at(k)]), 0.0, pushed_balls_[at(k)]);
  kept_edges_.assign(edge_pairs_.size(), 0.0);
}

}  // namespace vstent::xpbd
