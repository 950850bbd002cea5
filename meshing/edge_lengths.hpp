// How long should edges be, place by place?
#pragma once

#include <optional>
#include <span>

#include "sdf/box_tree.hpp"
#include "sdf/geometry.hpp"

namespace vstent::meshing {

/// Shorter edges where the surface is more curved: sqrt(6 e / k - 3 e^2) for the larger principal
/// curvature k keeps triangles within e of it (Dunyach et al. 2013).
struct Adaptive {
  double shortest = 0.1, longest = 1.0;  ///< mm
  double deviation = 0.01;               ///< e, mm
};

struct EdgeLengths {
  double everywhere = 0.5;  ///< mm, where not adaptive
  std::optional<Adaptive> adaptive = {};
  double grading = 0.3;  ///< by how much the length may change per mm along the surface
};

/// The wanted length at any place of a surface. Where edges between faces, or of the border, stay
/// as they are, it starts from theirs and approaches what is wanted by the grading.
class LengthField {
 public:
  /// `kept` marks the points of edges that stay.
  LengthField(const TriangleMesh& mesh, std::span<const int> face_of_triangle,
              std::span<const char> kept, const EdgeLengths& wanted);

  /// `wish`: what would be wanted at x but for the edges that stay, from of_point.
  double at(const Vec3& x, double wish) const;
  bool uniform() const { return uniform_; }  ///< the same everywhere
  double of_point(int point) const { return wish_[static_cast<std::size_t>(point)]; }

 private:
  struct Kept {
    Vec3 point;
    double length = 0;
  };
  std::vector<double> wish_;
  std::vector<Kept> kept_;
  double longest_kept_ = 0;
  double grading_ = 0;
  bool uniform_ = false;
  sdf::BoxTree tree_;
};

/// The larger absolute principal curvature (1/mm) at each point: eigenvalues of the edges' bends
/// (Cohen-Steiner and Morvan 2003), averaged over three rings; edges between faces do not count.
std::vector<double> curvatures(const TriangleMesh& mesh, std::span<const int> face_of_triangle);

}  // namespace vstent::meshing
