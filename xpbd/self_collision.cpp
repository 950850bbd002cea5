#include "xpbd/self_collision.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "xpbd/parallel.hpp"
#include "xpbd/proximity.hpp"

namespace vstent::xpbd {
namespace {

// Of two layers of wall: places nearer than that at rest are as good as one.
constexpr double kJoined = 0.02;
// Of the distance at rest, so that rounding does not push.
constexpr double kAtRest = 1 - 1e-9;
// Of two layers, or of an edge: how far what is near others moves between looks. Less makes for
// more looks, more for longer lists.
constexpr double kStepOfReach = 0.2, kStepOfEdge = 0.25;
// Of the reach: where edges begin to push. In between vertices alone do.
constexpr double kEdgeReach = 0.5;

std::vector<Triangle> numbered(std::span<const Triangle> triangles, const Layout& layout) {
  std::vector<Triangle> result;
  for (const Triangle& t : triangles)
    result.push_back({layout.number[at(t[0])], layout.number[at(t[1])], layout.number[at(t[2])]});
  return result;
}

double largest(std::span<const double> values) {
  return values.empty() ? 0 : *std::max_element(values.begin(), values.end());
}

struct Law {
  double energy = 0, force = 0, stiffness = 0;
};

Law law(double stiffness, double d, double gap) {
  if (!(gap < d)) return {};
  const double g = std::max(gap, 1e-9 * d);
  return {0.5 * stiffness * d * (d - g) * (d - g) / g, 0.5 * stiffness * d * (d * d / (g * g) - 1),
          stiffness * (d / g) * (d / g) * (d / g)};
}

void fill_in_law(Push& push, double stiffness) {
  const Law at_gap = law(stiffness, push.reach, push.gap);
  push.energy = at_gap.energy;
  push.force = at_gap.force;
  push.stiffness = at_gap.stiffness;
}

Vec3 direction_of(const Nearest& nearest) {
  return nearest.distance > 0 ? Vec3(nearest.offset / nearest.distance) : Vec3::Zero();
}

}  // namespace

double cell_spacing(const SurfaceOfWall& surface) { return 2 * largest(surface.thickness); }

SelfCollision::SelfCollision(const Sheet& sheet, const ElasticSheet& elastic,
                             std::span<const Slot> rest)
    : triangles_(numbered(sheet.surface->triangles, elastic.layout)),
      cells_(rest, triangles_, cell_spacing(*sheet.surface)),
      free_(elastic.free),
      reach_(rest.size(), 0.0),
      stiffness_(rest.size(), 0.0),
      reference_(rest.size(), Vec3::Zero()),
      balls_(rest.size(), 0.0),
      kept_(rest.size(), 0.0) {
  const auto x = [&](int k) { return place(rest[at(k)]); };
  const SurfaceOfWall& surface = *sheet.surface;
  std::vector<double> per_area(rest.size());  // N/mm3
  for (std::size_t k = 0; k < rest.size(); ++k) {
    const std::size_t vertex = at(elastic.layout.original[k]);
    reach_[k] = 2 * surface.thickness[vertex];
    per_area[k] = surface.youngs_modulus[vertex] / reach_[k];
  }
  const auto& edges = cells_.edges();
  std::vector<double> edge_area(edges.size(), 0.0);
  for (const Triangle& t : triangles_) {
    const double third = (x(t[1]) - x(t[0])).cross(x(t[2]) - x(t[0])).norm() / 6;
    for (std::size_t k = 0; k < 3; ++k) {
      // Half, for the other side pushes as well.
      stiffness_[at(t[k])] += 0.5 * third * per_area[at(t[k])];
      const auto [i, j] = std::minmax(t[k], t[(k + 1) % 3]);
      const auto edge =
          std::lower_bound(edges.begin(), edges.end(), SurfaceCells::Edge{i, j}) - edges.begin();
      edge_area[static_cast<std::size_t>(edge)] += third;
    }
  }
  for (std::size_t e = 0; e < edges.size(); ++e) {
    const auto [i, j] = edges[e];
    const double length = (x(i) - x(j)).norm();
    edge_reach_.push_back(kEdgeReach * 0.5 * (reach_[at(i)] + reach_[at(j)]));
    // Per area of sheets laid on each other at random, edges of length L per area cross 2 L^2 / pi
    // times (Buffon): so crossings, each with area over length of both edges, add up to the area.
    const double stiffness = 0.5 * (per_area[at(i)] + per_area[at(j)]);
    edge_stiffness_.push_back(
        length > 0 ? std::sqrt(0.5 * std::numbers::pi * stiffness) * edge_area[e] / length : 0);
  }
  const double reach = largest(reach_);
  step_ = std::max(kStepOfReach * reach, kStepOfEdge * cells_.mean_edge());
  wide_ = 0.5 * std::max(reach, cells_.mean_edge());
  search_ = std::max(reach + 2 * step_, step_ / kSafe);
  edge_search_ = std::max(kEdgeReach * reach + 2 * step_, step_ / kSafe);
  find_neighbours();
  look(rest);
  limit_reach_to_rest();
  look(rest);
}

void SelfCollision::find_neighbours() {
  const auto& edges = cells_.edges();
  const auto number = [&](const Triangle& t, std::size_t k) {
    const auto [i, j] = std::minmax(t[k], t[(k + 1) % 3]);
    return static_cast<std::size_t>(
        std::lower_bound(edges.begin(), edges.end(), SurfaceCells::Edge{i, j}) - edges.begin());
  };
  std::vector<std::array<int, 2>> sides(edges.size(), {-1, -1});
  std::vector<int> uses(edges.size(), 0);
  for (std::size_t t = 0; t < triangles_.size(); ++t)
    for (std::size_t k = 0; k < 3; ++k)
      if (const std::size_t e = number(triangles_[t], k); uses[e]++ < 2)
        sides[e][at(uses[e] - 1)] = static_cast<int>(t);
  around_.assign(reach_.size(), 0);
  for (const Triangle& t : triangles_)
    for (const int v : t) ++around_[at(v)];
  for (std::size_t t = 0; t < triangles_.size(); ++t) {
    beyond_.push_back({-1, -1, -1});
    for (std::size_t k = 0; k < 3; ++k) {
      const std::size_t e = number(triangles_[t], k);
      if (uses[e] == 2)
        beyond_.back()[k] = sides[e][0] + sides[e][1] - static_cast<int>(t);
      else
        for (const int v : edges[e]) around_[at(v)] = -1;
    }
  }
}

/// At rest nothing pushes.
void SelfCollision::limit_reach_to_rest() {
  for (const Watched& w : near_.vertices)
    for (std::size_t n = w.first_triangle; n < w.last_triangle; ++n) {
      const NearTriangle& near = near_.triangles[n];
      double& reach = reach_[at(w.vertex)];
      if (near.distance < kJoined * reach)
        joined_.push_back({w.vertex, near.triangle, 0});
      else
        reach = std::min(reach, kAtRest * near.distance);
    }
  for (const EdgePair& pair : edge_pairs_) {
    double &of_a = edge_reach_[at(pair.a)], &of_b = edge_reach_[at(pair.b)];
    if (pair.distance < kJoined * std::min(of_a, of_b)) {
      joined_.push_back({pair.a, pair.b, 1});
    } else {
      of_a = std::min(of_a, kAtRest * pair.distance);
      of_b = std::min(of_b, kAtRest * pair.distance);
    }
  }
  std::sort(joined_.begin(), joined_.end());
}

double SelfCollision::used(std::span<const Slot> particles) const {
  std::vector<double> partial(chunks_of(particles.size()), 0.0);
  for_each_particle(particles.size(), [&](std::size_t k, std::size_t chunk) {
    if (!free_[k]) return;
    const double distance = (place(particles[k]) - reference_[k]).norm();
    if (distance > partial[chunk] * balls_[k])
      partial[chunk] = balls_[k] > 0 ? distance / balls_[k] : 1;
  });
  return largest(partial);
}

double SelfCollision::allowed(std::span<const Slot> particles, std::span<const Vec3> moves,
                              double most) const {
  std::vector<double> partial(chunks_of(particles.size()), most);
  for_each_particle(particles.size(), [&](std::size_t k, std::size_t chunk) {
    if (!free_[k]) return;
    const double left = balls_[k] - (place(particles[k]) - reference_[k]).norm();
    const double move = moves[k].norm();
    if (move * partial[chunk] > left) partial[chunk] = std::max(0.0, left) / move;
  });
  return partial.empty() ? most : *std::min_element(partial.begin(), partial.end());
}

bool SelfCollision::keep(std::size_t k, Vec3& place, double ball) const {
  const Vec3 move = place - reference_[k];
  const double distance = move.norm();
  if (!(distance > ball)) return false;
  place = reference_[k] + ball / distance * move;
  return true;
}

double SelfCollision::moved(std::span<const Slot> particles) const {
  double squared = 0;
  for (const int k : alert_)
    squared = std::max(squared, (place(particles[at(k)]) - reference_[at(k)]).squaredNorm());
  return std::sqrt(squared);
}

Push SelfCollision::at_vertex(const Watched& watched, std::span<const Slot> particles,
                              double moved) const {
  const auto x = [&](int k) { return place(particles[at(k)]); };
  Push push;
  push.gap = std::numeric_limits<double>::infinity();
  push.reach = reach_[at(watched.vertex)];
  for (std::size_t n = watched.first_triangle; n < watched.last_triangle; ++n) {
    const NearTriangle& near = near_.triangles[n];
    if (near.distance - 2 * moved > std::min(push.gap, push.reach)) break;
    const auto [a, b, c] = triangles_[at(near.triangle)];
    const Nearest nearest = point_triangle(x(watched.vertex), x(a), x(b), x(c));
    if (!(nearest.distance < push.gap)) continue;
    push.gap = nearest.distance;
    push.particles = {watched.vertex, a, b, c};
    push.weights = nearest.weights;
    push.normal = direction_of(nearest);
  }
  fill_in_law(push, stiffness_[at(watched.vertex)]);
  return push;
}

/// The energy of a vertex, and what it gets and what the corners near it get.
double SelfCollision::push_vertex(const Watched& watched, std::span<const Slot> particles,
                                  double moved, Vec3& on_vertex, std::span<Vec3> on_corners) const {
  const double reach = reach_[at(watched.vertex)], stiffness = stiffness_[at(watched.vertex)];
  const double far = reach + 2 * moved;
  const Vec3 x = place(particles[at(watched.vertex)]);
  const auto corner = [&](int k) {
    return place(particles[at(near_.corners[watched.first_corner + at(k)].particle)]);
  };
  double energy = 0;
  on_vertex.setZero();
  const auto add = [&](const Nearest& nearest, double sign, std::span<const int> corners) {
    if (!(nearest.distance < reach)) return;
    const Law at_gap = law(stiffness, reach, nearest.distance);
    energy += sign * at_gap.energy;
    const Vec3 force = sign * at_gap.force * direction_of(nearest);
    on_vertex += force;
    for (std::size_t k = 0; k < corners.size(); ++k)
      on_corners[at(corners[k])] += nearest.weights[k + 1] * force;
  };
  for (std::size_t n = watched.first_triangle; n < watched.last_triangle; ++n) {
    const NearTriangle& t = near_.triangles[n];
    if (t.distance > far) break;
    add(point_triangle(x, corner(t.corners[0]), corner(t.corners[1]), corner(t.corners[2])), 1,
        t.corners);
  }
  for (std::size_t n = watched.first_edge; n < watched.last_edge; ++n) {
    const NearEdge& e = near_.edges[n];
    if (e.distance > far) break;
    add(point_segment(x, corner(e.corners[0]), corner(e.corners[1])), -1, e.corners);
  }
  for (int k = 0; k < static_cast<int>(on_corners.size()); ++k) {
    if (!near_.corners[watched.first_corner + at(k)].inner) continue;
    const Vec3 offset = x - corner(k);
    add({offset, offset.norm(), {1, -1, 0, 0}}, 1, std::array{k});
  }
  return energy;
}

Push SelfCollision::at_edges(const EdgePair& pair, std::span<const Slot> particles) const {
  const auto [i, j] = cells_.edges()[at(pair.a)];
  const auto [k, l] = cells_.edges()[at(pair.b)];
  const auto x = [&](int p) { return place(particles[at(p)]); };
  const Nearest nearest = segment_segment(x(i), x(j), x(k), x(l));
  Push push;
  push.of_edges = true;
  push.gap = nearest.distance;
  push.reach = std::min(edge_reach_[at(pair.a)], edge_reach_[at(pair.b)]);
  push.particles = {i, j, k, l};
  push.weights = nearest.weights;
  push.normal = direction_of(nearest);
  fill_in_law(push, edge_stiffness_[at(pair.a)] * edge_stiffness_[at(pair.b)]);
  return push;
}

std::vector<Push> SelfCollision::pushes_of_edges(std::span<const Slot> particles,
                                                 double moved) const {
  std::vector<Push> all;
  for (const EdgePair& pair : edge_pairs_)
    if (pair.distance - 2 * moved < std::min(edge_reach_[at(pair.a)], edge_reach_[at(pair.b)]))
      if (const Push push = at_edges(pair, particles); push.force > 0) all.push_back(push);
  return all;
}

std::vector<Push> SelfCollision::pushes(std::span<const Slot> particles) const {
  if (watched() == 0) return {};
  const double far = moved(particles);
  std::vector<Push> all(near_.vertices.size());
  for_each_particle(all.size(), [&](std::size_t n, std::size_t) {
    all[n] = at_vertex(near_.vertices[n], particles, far);
  });
  std::erase_if(all, [](const Push& push) { return !(push.force > 0); });
  const std::vector<Push> of_edges = pushes_of_edges(particles, far);
  all.insert(all.end(), of_edges.begin(), of_edges.end());
  return all;
}

Tally SelfCollision::add_forces(std::span<const Slot> particles, std::vector<Slot>& forces) const {
  if (watched() == 0) return {};
  const double far = moved(particles);
  const std::size_t vertices = near_.vertices.size();
  std::vector<double> energies(vertices);
  std::vector<Vec3> on_vertices(vertices), on_corners(near_.corners.size(), Vec3::Zero());
  side_by_side(vertices, [&](std::size_t n) {
    const Watched& w = near_.vertices[n];
    const auto of_this =
        std::span(on_corners).subspan(w.first_corner, w.last_corner - w.first_corner);
    energies[n] = push_vertex(w, particles, far, on_vertices[n], of_this);
  });
  const auto add = [&](int particle, const Vec3& force) {
    put(forces[at(particle)], place(forces[at(particle)]) + force);
  };
  Tally tally;
  for (std::size_t n = 0; n < vertices; ++n) {
    if (energies[n] == 0) continue;
    const Watched& w = near_.vertices[n];
    tally.energy += energies[n];
    tally.carried_squares += on_vertices[n].squaredNorm();
    ++tally.carried;
    add(w.vertex, on_vertices[n]);
    for (std::size_t k = w.first_corner; k < w.last_corner; ++k)
      add(near_.corners[k].particle, on_corners[k]);
  }
  for (const Push& push : pushes_of_edges(particles, far)) {
    tally.energy += push.energy;
    tally.carried_squares += push.force * push.force;
    ++tally.carried;
    for (std::size_t k = 0; k < 4; ++k)
      add(push.particles[k], push.weights[k] * push.force * push.normal);
  }
  return tally;
}

std::vector<Link> SelfCollision::links(std::span<const Slot> particles) const {
  std::vector<Link> result;
  for (const Push& push : pushes(particles))
    result.push_back({push.particles, push.weights, push.normal, push.stiffness});
  return result;
}

void SelfCollision::project(std::span<Slot> particles) {
  const double far = moved(particles);
  const auto one = [&](const Push& push, double& force) {
    if (!(push.gap < push.reach) && !(force > 0)) return;
    double mobility = 0;
    for (std::size_t k = 0; k < 4; ++k)
      mobility += push.weights[k] * push.weights[k] * particles[at(push.particles[k])].mobility;
    if (!(mobility > 0)) return;
    const double change = std::max(-force, (push.reach - push.gap) / mobility);
    force += change;
    for (std::size_t k = 0; k < 4; ++k) {
      Slot& slot = particles[at(push.particles[k])];
      put(slot, place(slot) + slot.mobility * push.weights[k] * change * push.normal);
    }
  };
  for (const Watched& w : near_.vertices) {
    double& force = kept_[at(w.vertex)];
    const Push push = at_vertex(w, particles, far);
    if (push.gap < std::numeric_limits<double>::infinity())
      one(push, force);
    else
      force = 0;
  }
  for (std::size_t n = 0; n < edge_pairs_.size(); ++n)
    one(at_edges(edge_pairs_[n], particles), kept_edges_[n]);
}

void SelfCollision::add_kept_forces(std::span<const Slot> particles,
                                    std::vector<Slot>& forces) const {
  const double far = moved(particles);
  const auto add = [&](const Push& push, double force) {
    for (std::size_t k = 0; k < 4; ++k) {
      Slot& slot = forces[at(push.particles[k])];
      put(slot, place(slot) + push.weights[k] * force * push.normal);
    }
  };
  for (const Watched& w : near_.vertices)
    if (const double force = kept_[at(w.vertex)]; force > 0)
      add(at_vertex(w, particles, far), force);
  for (std::size_t n = 0; n < edge_pairs_.size(); ++n)
    if (kept_edges_[n] > 0) add(at_edges(edge_pairs_[n], particles), kept_edges_[n]);
}

void SelfCollision::forget() {
  std::fill(kept_.begin(), kept_.end(), 0.0);
  std::fill(kept_edges_.begin(), kept_edges_.end(), 0.0);
}

std::vector<Push> by_vertex(std::vector<Push> pushes, const ElasticSheet& elastic) {
  for (Push& push : pushes)
    for (int& particle : push.particles) particle = elastic.layout.original[at(particle)];
  return pushes;
}

}  // namespace vstent::xpbd
