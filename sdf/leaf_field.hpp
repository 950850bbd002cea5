// Values on 8^3 leaves as the sampler reads them, whoever owns them. Inside this folder only.
#pragma once

#include <array>
#include <span>

#include "sdf/leaf_directory.hpp"
#include "sdf/leaf_kernels.hpp"
#include "sdf/solid.hpp"

namespace vstent::sdf {

struct LeafField {
  LeafDirectory leaves;
  double voxel_size = 0;
  Vec3 origin = Vec3::Zero();  ///< world position of node (0, 0, 0)
  float outside = 0;           ///< the value beyond the band, outside
  float inside = 0;            ///< and inside, negative
};

/// One thread's view: points that follow one another in space find their leaves ready.
class LeafCursor {
 public:
  explicit LeafCursor(const LeafField& field);
  /// As LevelSet::sample.
  Sample sample(const Vec3& x);
  /// The same bits: finds and fetches the nodes of several points before it looks at any.
  void sample(std::span<const Vec3> points, std::span<Sample> samples);
  /// With a value of third order where the field is smooth: less the bend along each axis that
  /// linear interpolation leaves out.
  Sample sample_closely(const Vec3& x);

 private:
  /// Pointers to leaves where no page has them.
  using Loose = std::array<const float*, 32>;

  /// `loose` has room for the leaves of each.
  void locate(std::span<const Vec3> points, LeafPlaces& places, std::span<Loose> loose);
  /// From this leaf of the block on.
  Loose find_loose(int leaf) const;

  const LeafField& field_;
  const LeafLattice lattice_;
  const LeafRange range_;
  const LeafKernels& kernels_ = leaf_kernels();
  IndexTable::Index block_{};
  const LeafPage* page_ = nullptr;
};

}  // namespace vstent::sdf
