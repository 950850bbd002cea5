// A solid's narrow band leaf by leaf. Inside this folder only.
#pragma once

#include <array>
#include <vector>

#include "sdf/index_table.hpp"
#include "sdf/leaf_directory.hpp"
#include "sdf/leaf_kernels.hpp"
#include "sdf/leaf_store.hpp"
#include "sdf/prepared_solid.hpp"

namespace vstent::sdf {

using Index3 = std::array<int, 3>;

/// A solid's pieces binned to the blocks of nodes that their band touches; blocks are the tasks of
/// rasterising.
class Rasteriser {
 public:
  static constexpr int kBlockSide = kLeafSide * LeafPage::kSide;  ///< nodes

  /// `pieces` are those of the solid; `band` is the half width in mm.
  Rasteriser(const Solid& solid, PreparedSolid pieces, double voxel_size, double band);

  /// Block (i, j, k) begins at node kBlockSide * (i, j, k).
  const IndexTable& blocks() const { return blocks_; }
  /// Fills the pages of a directory of these blocks, in parallel; the same bits for any number of
  /// threads. Returns the number of active voxels.
  std::size_t run(LeafDirectory& leaves, LeafStore& store) const;

 private:
  friend class BlockRasteriser;

  struct Shape {
    Vec3 a, b, axis;
    Vec3 along, sideways, aside;  // unit, perpendicular; along the axis where there is one
    double length, outer_radius;
    double reach;                               // of a leaf along the axis, from its middle
    std::array<double, 2> first_row, end_row;   // its band's, of a leaf whose middle is at 0
    LeafCapsule thin;                           // its slopes
    bool is_plain = false;                      // an uncut capsule
    bool is_thin = false;                       // and not thick
    bool continues = false, continued = false;  // see BlockRasteriser::yields
  };

  /// Of which single precision needs help: see LeafCapsule.
  bool is_thick(double radius) const { return radius >= 16 * voxel_size_ && radius >= 2 * band_; }
  Shape shape_of(int piece) const;
  void prepare_shapes(const Solid& solid);
  void bin_to_blocks();

  PreparedSolid pieces_;
  std::vector<Shape> shapes_;  // of the pieces
  double voxel_size_, band_;
  IndexTable blocks_;
  std::vector<int> first_candidate_;  // of each block, in candidates_; one more for the end
  std::vector<int> candidates_;       // of the blocks, one after another
};

}  // namespace vstent::sdf
