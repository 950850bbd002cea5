// A solid's narrow band leaf by leaf, before OpenVDB sees it. Inside this folder only.
#pragma once

#include <array>
#include <functional>
#include <vector>

#include "sdf/leaf_kernels.hpp"
#include "sdf/prepared_solid.hpp"

namespace vstent::sdf {

using Index3 = std::array<int, 3>;

/// Where the leaves of a block go. An origin is the index of a first node, at index * voxel size.
struct LeafSink {
  std::function<float*()> spare;  ///< room for the values of the leaf that may be kept next
  std::function<void(const Index3& origin, const LeafMask& active)> keep;
  /// A cube of nodes inside the solid, deeper than the band.
  std::function<void(const Index3& origin, int size)> fill_inside;
};

/// A solid's pieces binned to the blocks of nodes that their band touches; blocks are the tasks of
/// rasterising.
class Rasteriser {
 public:
  static constexpr int kBlockSide = 32;  ///< nodes

  /// `band` is the half width in mm.
  Rasteriser(const Solid& solid, double voxel_size, double band);

  std::size_t block_count() const { return blocks_.size(); }
  /// Before all nodes of all blocks; a multiple of kBlockSide.
  const Index3& first_node() const { return first_node_; }
  /// All blocks, in parallel; the same bits for any number of threads.
  void run(const std::function<LeafSink(std::size_t block)>& sink_of) const;

 private:
  friend class BlockRasteriser;
  struct Block {
    Index3 origin{};
    int begin = 0, end = 0;  // in candidates_
  };

  struct Shape {
    Vec3 a, b, axis, sideways;  // sideways is unit, perpendicular to the axis and a strut's normal
    double length, outer_radius;
    bool is_plain = false;                      // an uncut capsule
    bool continues = false, continued = false;  // see BlockRasteriser::yields
  };

  PreparedSolid pieces_;
  std::vector<Shape> shapes_;  // of the pieces
  double voxel_size_, band_;
  Index3 first_node_{};
  std::vector<Block> blocks_;
  std::vector<int> candidates_;  // of the blocks, one after another
};

}  // namespace vstent::sdf
