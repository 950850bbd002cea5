// One thread's work: which pieces matter to each leaf of a block, and the leaf's values from them.
#pragma once

#include "sdf/rasteriser.hpp"

namespace vstent::sdf {

/// A piece as a cube of nodes sees it from its middle.
struct Candidate {
  int piece = -1;
  Sample sample;
};

/// How far a cube's nodes lie from its middle (mm), along each axis and at most.
struct CubeReach {
  double half = 0, corner = 0;
  CubeReach(int nodes, double voxel_size);
  /// The least that a convex distance can be at any node of the cube.
  double least(const Sample& middle) const;
  /// The same of (x - origin) . direction.
  double least(const Vec3& from_origin, const Vec3& direction) const {
    return from_origin.dot(direction) - half * direction.cwiseAbs().sum();
  }
};

/// Visits the cells of `side` mm that may lie within `margin` of the segment from a to b, in a
/// fixed order; cell (i, j, k) begins at (i, j, k) * side. Cells outside [lower, upper] are left
/// out.
template <class Visit>
void visit_cells(const Vec3& a, const Vec3& b, double margin, double side, const Index3& lower,
                 const Index3& upper, Visit&& visit) {
  const Vec3 from = a / side, step = (b - a) / side;
  const double pad = margin / side * (1 + 1e-9) + 1e-9;
  int main = 0;
  step.cwiseAbs().maxCoeff(&main);
  const auto range = [&](int axis, double p, double q) {
    const auto i = static_cast<std::size_t>(axis);
    return std::pair(std::max(lower[i], static_cast<int>(std::floor(std::min(p, q) - pad))),
                     std::min(upper[i], static_cast<int>(std::floor(std::max(p, q) + pad))));
  };
  const auto [first, last] = range(main, from[main], from[main] + step[main]);
  const int next = (main + 1) % 3, other = (main + 2) % 3;
  Index3 cell;
  for (int slab = first; slab <= last; ++slab) {
    double enter = 0, leave = 1;  // of the part of the segment that can matter to this slab
    if (last - first > 1 && step[main] != 0) {
      const double p = (slab - pad - from[main]) / step[main];
      const double q = (slab + 1 + pad - from[main]) / step[main];
      enter = std::clamp(std::min(p, q) - 1e-9, 0.0, 1.0);
      leave = std::clamp(std::max(p, q) + 1e-9, 0.0, 1.0);
    }
    const auto across = [&](int axis) {
      return range(axis, from[axis] + enter * step[axis], from[axis] + leave * step[axis]);
    };
    const auto [first_next, last_next] = across(next);
    const auto [first_other, last_other] = across(other);
    cell[static_cast<std::size_t>(main)] = slab;
    for (int i = first_next; i <= last_next; ++i) {
      cell[static_cast<std::size_t>(next)] = i;
      for (int j = first_other; j <= last_other; ++j) {
        cell[static_cast<std::size_t>(other)] = j;
        visit(cell);
      }
    }
  }
}

class BlockRasteriser {
 public:
  BlockRasteriser(const Rasteriser& scene, LeafDirectory& leaves, LeafStore& store);
  void operator()(std::size_t block);
  std::size_t active_voxels() const { return active_voxels_; }

 private:
  enum class Verdict { outside, inside, band };
  enum class Kind { thin, thick, strut, cut, cone };
  struct Entry {
    Kind kind = Kind::cone;
    double radius = 0;
    int piece = -1;
    int caps = 0;
    std::array<int, 2> cap{-1, -1};
    int plane = -1;  // the one cap whose plane cuts it, where all nodes lie behind the plane
  };

  bool yields(int piece, const Vec3& middle, double along) const;
  void bin_to_leaves(int piece, const Index3& lower, const LeafMiddles& middles);
  Verdict cull(const CubeReach& reach, std::vector<Candidate>& near) const;
  const float* fill_leaf(const Index3& origin, std::vector<Candidate>& near);
  void resolve(const std::vector<Candidate>& near, const Vec3& middle);
  void resolve(const Candidate& candidate, const Vec3& middle);
  LeafRows rows_of(int piece, const Vec3& middle) const;
  int store(const std::vector<Candidate>& near, const Vec3& middle, float* values);
  void evaluate(const Vec3& middle);
  void collect_capsules(std::size_t& entry, const Vec3& middle);
  LeafCapsule thin_capsule(int piece, const Vec3& middle) const;
  LeafCapsule thick_capsule(const Entry& entry, const Vec3& middle) const;
  void lower_to_struts(std::size_t& entry, const Vec3& middle);
  void lower_to_cut_capsules(std::size_t& entry, const Vec3& middle);
  void lower_to_cone(const Entry& entry, const Vec3& middle);
  void lower_to_capsules(std::size_t& entry, const Vec3& middle, LeafValues& values);

  const Rasteriser& scene_;
  LeafDirectory& leaves_;
  LeafStore::Writer writer_;
  std::size_t active_voxels_ = 0;
  const LeafKernels& kernels_ = leaf_kernels();
  CubeReach block_reach_, leaf_reach_;
  std::vector<Candidate> of_block_;
  std::array<std::vector<Candidate>, 64> of_leaf_;
  NearLeaves near_;
  std::vector<Entry> entries_;
  std::vector<LeafCapsule> capsules_;
  std::vector<LeafStrut> struts_;
  std::vector<LeafCutCapsule> cut_capsules_;
  std::vector<int> whole_caps_;  // that some piece leaves whole in the present leaf
  LeafValues values_, uncut_;
};

}  // namespace vstent::sdf
