// A surface that does not pass through itself: walls that come near push each other away.
#pragma once

#include <vector>

#include "xpbd/elastic_sheet.hpp"
#include "xpbd/link.hpp"
#include "xpbd/surface_cells.hpp"

namespace vstent::xpbd {

/// Of SurfaceCells, mm: about as wide as two layers of wall are thick. What is beside a place on
/// the surface comes nearer to it than that only where the wall is crushed.
double cell_spacing(const SurfaceOfWall& surface);

/// What two places of a surface do to each other, by particle.
struct Push {
  std::array<int, 4> particles{};   ///< vertex, then triangle; or edge, edge
  std::array<double, 4> weights{};  ///< of the places that touch: their sum is the way between them
  Vec3 normal = Vec3::Zero();       ///< from the second place to the first
  double gap = 0;                   ///< mm
  double reach = 0;                 ///< mm, below which they push
  double force = 0;                 ///< N
  double stiffness = 0;             ///< N/mm
  double energy = 0;                ///< N mm
  bool of_edges = false;
};

/// Places of the surface (as far as they are not beside each other on it) are kept apart by two
/// layers of wall, thickness t each, that are pressed together: pressure k d/2 (d^2/g^2 - 1) at
/// the distance g < d = 2 t, with k = E/d, which is linear at first and without bound as g goes to
/// 0. Where the surface lies nearer to itself at rest, d is that distance and k stays, so that
/// rest is free of stress. Half of the pressure comes from the vertices of either side, each with
/// its share of the area: so it does not depend on the mesh. A vertex is pushed by the triangles
/// it is near, less their edges, plus their corners (as Li, Kaufman & Jiang 2023 count them in
/// "Convergent incremental potential contact"): what several share counts once, and, unlike for the
/// nearest triangle alone, forces change without jumps. Edges push each other only from half of d
/// on, where surfaces are too coarse for vertices to tell. Walls that face each other from within
/// the vessel have no layers between them, and are not kept apart.
///
/// After a look every particle may move within a ball, of less than half its distance to what it
/// must not meet: so nothing can cross between two looks. Results are the same bits for any number
/// of threads.
class SelfCollision {
 public:
  /// `rest`: by particle. The sheet's surface must be there.
  SelfCollision(const Sheet& sheet, const ElasticSheet& elastic, std::span<const Slot> rest);

  /// Finds what is near, and how far everything may move from here.
  void look(std::span<const Slot> particles);
  /// The largest share of its ball's radius that a particle has moved since the look.
  double used(std::span<const Slot> particles) const;
  /// The largest multiple of these moves, at most `most`, that leaves everything within its ball.
  double allowed(std::span<const Slot> particles, std::span<const Vec3> moves, double most) const;
  /// Puts particle k back into its ball; true where it was outside.
  bool keep(std::size_t k, Vec3& place) const { return keep(k, place, balls_[k]); }
  /// The same for what is pushed by force: it leaves others room to give way.
  bool keep_pushed(std::size_t k, Vec3& place) const { return keep(k, place, pushed_balls_[k]); }

  /// What pushes at these places, between looks: at vertices by the nearest triangle.
  std::vector<Push> pushes(std::span<const Slot> particles) const;
  /// Adds their forces, and gives their energy.
  Tally add_forces(std::span<const Slot> particles, std::vector<Slot>& forces) const;
  std::vector<Link> links(std::span<const Slot> particles) const;

  /// One pass in the manner of extended position-based dynamics, with mobilities as of the slots:
  /// what is nearer than its reach is put there, as if the wall were rigid. Forces are kept from
  /// pass to pass, those at vertices over looks as well.
  void project(std::span<Slot> particles);
  void add_kept_forces(std::span<const Slot> particles, std::vector<Slot>& forces) const;
  void forget();

  std::size_t watched() const { return near_.vertices.size() + edge_pairs_.size(); }

 private:
  // Of the distance to what must not be met: less than half, for both may move.
  static constexpr double kSafe = 0.45;

  // Distances are those at the look; `corners` count from Watched::first_corner.
  struct NearTriangle {
    int triangle = 0;
    double distance = 0;
    std::array<int, 3> corners{};
  };
  struct NearEdge {  // between two near triangles
    double distance = 0;
    std::array<int, 2> corners{};
  };
  struct NearCorner {
    int particle = 0;
    bool inner = false;  // all triangles around it are near
  };
  struct Watched {  // a vertex and what is near it, nearest first
    int vertex = 0;
    std::size_t first_triangle = 0, last_triangle = 0;
    std::size_t first_edge = 0, last_edge = 0;
    std::size_t first_corner = 0, last_corner = 0;
  };
  struct Near {
    std::vector<Watched> vertices;
    std::vector<NearTriangle> triangles;
    std::vector<NearEdge> edges;
    std::vector<NearCorner> corners;
  };
  struct EdgePair {
    int a = 0, b = 0;
    double distance = 0;  // at the look
  };
  struct Found;

  void search(int cell, std::span<const int> partners, std::span<const Slot> particles,
              Found& found) const;
  void watch(int vertex, std::vector<NearTriangle>& triangles, std::span<const Slot> particles,
             Near& near) const;
  void find_neighbours();
  void limit_reach_to_rest();
  bool joined(int of_vertex_or_edge, int other, bool of_edges) const;
  bool keep(std::size_t k, Vec3& place, double ball) const;
  bool any_free(std::span<const int> particles) const;
  double moved(std::span<const Slot> particles) const;
  Push at_vertex(const Watched& watched, std::span<const Slot> particles, double moved) const;
  double push_vertex(const Watched& watched, std::span<const Slot> particles, double moved,
                     Vec3& on_vertex, std::span<Vec3> on_corners) const;
  std::vector<Push> pushes_of_edges(std::span<const Slot> particles, double moved) const;
  Push at_edges(const EdgePair& pair, std::span<const Slot> particles) const;

  std::vector<Triangle> triangles_;
  std::vector<std::array<int, 3>> beyond_;  // by triangle: the others at its edges, -1: none
  std::vector<int> around_;                 // by particle: triangles; -1 on a rim
  SurfaceCells cells_;
  std::vector<char> free_;
  std::vector<double> reach_, stiffness_;            // by vertex: d in mm, k times area in N/mm
  std::vector<double> edge_reach_, edge_stiffness_;  // by edge: mm; root of k times width
  double step_ = 0, wide_ = 0;                       // mm: balls of what is and is not near others
  double search_ = 0, edge_search_ = 0;              // mm
  // Vertex or edge, other, of edges; sorted: as good as grown together at rest, not kept apart.
  std::vector<std::array<int, 3>> joined_;

  std::vector<Vec3> reference_;               // places at the look
  std::vector<double> balls_, pushed_balls_;  // mm
  std::vector<int> alert_;                    // particles near others
  Near near_;
  std::vector<EdgePair> edge_pairs_;
  std::vector<double> kept_, kept_edges_;  // N, by particle and by pair of edges
};

/// The same, counting the sheet's vertices.
std::vector<Push> by_vertex(std::vector<Push> pushes, const ElasticSheet& elastic);

}  // namespace vstent::xpbd
