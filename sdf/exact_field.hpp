// The solid's exact distance through a tree of its pieces: no voxels, no interpolation error.
#pragma once

#include <span>

#include "sdf/box_tree.hpp"
#include "sdf/prepared_solid.hpp"

namespace vstent::sdf {

/// Same values as distance_brute_force, in logarithmic time. Immutable: any number of threads may
/// read it.
class ExactField {
 public:
  /// \throws std::invalid_argument an empty solid, or one with an impossible piece
  explicit ExactField(Solid solid);
  Sample sample(const Vec3& x) const;
  void sample(std::span<const Vec3> points, std::span<Sample> samples) const;  ///< in parallel
  const Solid& solid() const { return solid_; }

 private:
  /// The same, faster where `piece`, a guess (-1: none), is the nearest already; it is then.
  Sample sample(const Vec3& x, int& piece) const;

  Solid solid_;
  PreparedSolid pieces_;
  BoxTree tree_;
  double reach_ = 0;  // the largest outer radius
};

}  // namespace vstent::sdf
