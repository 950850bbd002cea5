// The surface that is being remeshed: the nearest place on one of its faces, or on a curve between
// two.
#pragma once

#include <map>
#include <span>

#include "meshing/edge_lengths.hpp"
#include "sdf/box_tree.hpp"
#include "sdf/geometry.hpp"

namespace vstent::meshing {

/// Immutable after construction: any number of threads may ask.
class Reference {
 public:
  struct Place {
    Vec3 point = Vec3::Zero();
    double size = 0;    ///< edge length wanted there, mm
    int triangle = -1;  ///< of the surface; -1 on a curve
  };

  Reference(TriangleMesh mesh, std::span<const int> face_of_triangle, LengthField lengths);

  /// Nearest place on a face; `near`, a triangle of it close by or -1, shortens the search.
  Place on_face(int face, const Vec3& x, int near = -1) const;
  /// Nearest place on the edges between two faces.
  Place on_curve(int face, int other_face, const Vec3& x) const;

 private:
  Vec3 closest(int triangle, const Vec3& x) const;
  double size_at(int triangle, const Vec3& x) const;

  struct Items {
    std::vector<int> triangles;
    std::vector<std::array<int, 2>> edges;
    sdf::BoxTree tree;
  };
  TriangleMesh mesh_;
  LengthField lengths_;
  std::map<int, Items> faces_;
  std::map<std::array<int, 2>, Items> curves_;
};

}  // namespace vstent::meshing
