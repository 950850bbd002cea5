// The inner loops that fill a leaf of 8^3 nodes with distances and that read from leaves, compiled
// once for any machine and twice for wide registers; all give the same bits. Coordinates are
// counted from the leaf's middle, so that single precision keeps the distances to its own rounding
// wherever the solid lies.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

namespace vstent::sdf {

constexpr int kLeafSide = 8;
constexpr int kLeafNodes = 512;

/// Node (i, j, k) of the leaf has index 64 i + 8 j + k.
struct alignas(32) LeafValues {
  std::array<float, kLeafNodes> at;
};

/// middle + (i - 3.5) x + (j - 3.5) y + (k - 3.5) z at node (i, j, k).
struct Affine {
  float middle = 0, x = 0, y = 0, z = 0;
};

/// The rows of nodes that a piece's band can reach: i in [first_i, end_i), j in [first_j, end_j).
/// The others may be left as they are.
struct LeafRows {
  int first_i = 0, end_i = kLeafSide;
  int first_j = 0, end_j = kLeafSide;
};

/// A capsule seen from a leaf, in coordinates along its axis and two across it. Of the capsules
/// that are thick beside a leaf, `across` points away from the axis at the leaf's middle and counts
/// from the capsule's side.
struct LeafCapsule {
  Affine across, aside;
  Affine past_b;       ///< how far beyond b
  float before_a = 0;  ///< how far before a, at the middle
  LeafRows reached;
};

/// A strut's core seen from a leaf.
struct LeafStrut {
  Affine sideways, height;
  Affine past_b;
  float before_a = 0;
  float half_width = 0, half_thickness = 0, edge_radius = 0;
  LeafRows reached;
};

/// A capsule, thick beside the leaf, that is cut by a cap whose disc is as thick; coordinates from
/// the cap along its outward direction and two across it, `across` from the disc's rim.
struct LeafCutCapsule {
  LeafCapsule capsule;
  float radius = 0, length = 0;
  Affine beyond, across, aside;
  float cap_radius = 0;
  float cap_from_a = 0;  ///< along the outward direction
  float slope = 0;       ///< of the capsule's axis along the outward direction
};

struct LeafVector {
  double x, y, z;
};

/// The middles of a block's 4^3 leaves along each axis (mm).
using LeafMiddles = std::array<std::array<double, 4>, 3>;

/// A capsule beside a block of leaves.
struct BlockCapsule {
  LeafVector a, axis;
  double length;
  double thickness;   ///< its radius and the band
  double half;        ///< how far a leaf's nodes lie from its middle, along x, y or z
  double reach;       ///< and along the capsule's axis
  double last_along;  ///< leaves that begin farther than that along the axis are left out
  std::array<int, 2> first, last;  ///< along x and y
};

/// Of leaf 16 i + 4 j + k: how far along a capsule's axis its middle lies, the way from the axis's
/// nearest point to it, and the square of that distance.
struct NearLeaves {
  alignas(32) std::array<double, 64> along, x, y, z, squared;
};

/// A round cone with up to two caps, or a flat-capped cylinder, relative to the leaf's first node.
struct LeafCone {
  struct Cap {
    LeafVector from_centre, outward;
    double radius;
  };
  LeafVector from_a, axis;
  double length, radius, sine, tangent;
  bool flat;
  int caps;
  std::array<Cap, 2> cap;
};

/// Node (i, j, k) lies at origin + (i, j, k) / nodes_per_mm.
struct LeafLattice {
  double origin[3];
  double nodes_per_mm;
};
/// Along an axis, from the origin: farther than any node of a field.
constexpr double kFarthestNode = 0x1p31 - 64;

constexpr std::size_t kPlaces = 32;

/// Where the 4^3 nodes around some points are, up to kPlaces of them; along each axis, where it
/// says so.
struct LeafPlaces {
  template <class Number>
  using Of = std::array<Number, kPlaces>;
  static constexpr int kStep[3]{25, 5, 1};

  alignas(64) std::array<Of<int>, 3> block;  ///< of 4^3 leaves: the first node's
  alignas(64) Of<int> leaf;                  ///< in the block: the sum of kStep times its indices
  alignas(64) std::array<Of<int>, 3> node;   ///< in the leaf: the first node
  alignas(64) std::array<Of<float>, 3> fraction;  ///< of the way from the second node to the third
  /// From the first node's leaf on, those that follow kStep apart along each axis.
  alignas(64) Of<const float* const*> leaves;
};

struct LeafRange {
  float inside, outside;       ///< the values beyond the band
  float innermost, outermost;  ///< values that count as beyond it
};

/// Each lowers the values to the least distance over the pieces it is given.
struct LeafKernels {
  void (*lower_to_thin)(std::span<const LeafCapsule>, float radius, LeafValues& values);
  void (*lower_to_thick)(std::span<const LeafCapsule>, float radius, LeafValues& values);
  void (*lower_to_struts)(std::span<const LeafStrut>, LeafValues& values);
  void (*lower_to_cut_capsules)(std::span<const LeafCutCapsule>, LeafValues& values);
  void (*lower_to_cone)(const LeafCone&, double voxel_size, LeafValues& values);
  /// Uncut distances to pieces that end at a plane, all nodes being behind it.
  void (*lower_to_larger)(const LeafValues& uncut, const Affine& beyond, LeafValues& values);
  /// Copies the values, none beyond +-background; how many are within?
  int (*store)(const LeafValues& values, float background, float* leaf);
  /// The same of values that only thin capsules lower, in one pass.
  int (*store_thin)(std::span<const LeafCapsule>, float radius, float background, float* leaf);
  /// The leaves that the capsule can reach, by bits; of those the numbers are set.
  std::uint64_t (*find_near)(const BlockCapsule&, const LeafMiddles&, NearLeaves& near);
  /// All but the leaves, of points x, y, z, x, ... Those beyond kFarthestNode are put there, and
  /// what is not a number.
  void (*locate)(std::span<const double> coordinates, const LeafLattice& lattice,
                 LeafPlaces& places);
  /// Per point the trilinear value and the normalised nodal gradient; beyond the band, `inside` or
  /// `outside` and no gradient.
  void (*sample)(const LeafPlaces& places, const LeafRange& range,
                 std::span<std::array<double, 4>> samples);
};

const LeafKernels& baseline_leaf_kernels();
/// Null where the program was not built for, or does not run on, a machine with AVX2.
const LeafKernels* avx2_leaf_kernels();
/// The same for AVX-512 (F, BW, DQ and VL).
const LeafKernels* avx512_leaf_kernels();
/// The widest that this machine runs.
const LeafKernels& leaf_kernels();

}  // namespace vstent::sdf
