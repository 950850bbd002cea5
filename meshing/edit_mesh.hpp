// A patch of triangles whose edges can be split, collapsed and flipped: a corner table.
#pragma once

#include <span>
#include <vector>

#include "sdf/geometry.hpp"

namespace vstent::meshing {

/// Half-edge h = 3 t + k runs from corner k of triangle t to its next corner. A patch is manifold
/// and oriented, with or without border; each vertex is in one disc of triangles.
class EditMesh {
 public:
  /// \pre every vertex is used by one fan or disc of triangles
  EditMesh(std::vector<Vec3> points, std::vector<Triangle> triangles, std::vector<int> face);

  std::vector<Vec3> points;
  std::vector<Triangle> triangles;
  std::vector<int> face;  ///< per triangle
  std::vector<char> triangle_lives, vertex_lives;

  static int next(int h) { return h % 3 == 2 ? h - 2 : h + 1; }
  static int previous(int h) { return h % 3 == 0 ? h + 2 : h - 1; }
  int twin(int h) const { return twin_[static_cast<std::size_t>(h)]; }  ///< -1: border
  int from(int h) const {
    return triangles[static_cast<std::size_t>(h / 3)][static_cast<std::size_t>(h % 3)];
  }
  int to(int h) const { return from(next(h)); }
  int apex(int h) const { return from(previous(h)); }
  int half_edges() const { return static_cast<int>(twin_.size()); }
  bool lives(int h) const { return triangle_lives[static_cast<std::size_t>(h / 3)] != 0; }
  const Vec3& at(int v) const { return points[static_cast<std::size_t>(v)]; }
  Vec3 edge(int h) const { return at(to(h)) - at(from(h)); }
  Vec3 doubled_area(int t) const;  ///< vector

  /// The half-edges that leave v, one per triangle around it; `ring` is overwritten.
  void leaving(int v, std::vector<int>& ring) const;
  int any_leaving(int v) const { return leaving_[static_cast<std::size_t>(v)]; }
  bool on_border(int v) const { return twin(any_leaving(v)) < 0; }
  /// Whether a and b are joined by an edge of the patch.
  bool joined(int a, int b, std::vector<int>& ring) const;

  /// Puts a vertex at `place` on the edge; returns it.
  int split(int h, const Vec3& place);
  /// Turns the edge between two triangles to join their apices; h keeps its triangle.
  void flip(int h);
  /// Joins the vertex h leaves to the one it runs to, which stays where it is.
  /// \pre the link condition holds; the vertex that goes is not on the border
  void collapse(int h);

 private:
  void pair(int h, int g);

  std::vector<int> twin_;
  std::vector<int> leaving_;  ///< per vertex: a half-edge that leaves it; on the border the first
};

}  // namespace vstent::meshing
