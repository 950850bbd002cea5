// A solid's narrow band as plain 8^3 leaves, before OpenVDB sees it. Inside this folder only.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <vector>

#include "sdf/solid.hpp"

namespace vstent::sdf {

using Index3 = std::array<int, 3>;

/// 8^3 nodes at (origin + (i, j, k)) h, value index 64 i + 8 j + k. Bit 8 j + k of active[i]:
/// |value| < band.
struct RasterLeaf {
  Index3 origin;
  std::array<float, 512> values;
  std::array<std::uint64_t, 8> active;
};

/// A cube of nodes that lies inside the solid, deeper than the band.
struct InsideBlock {
  Index3 origin;
  int size;  ///< nodes per side
};

struct RasterPiece {
  std::vector<std::unique_ptr<RasterLeaf>> leaves;
  std::vector<InsideBlock> inside;
};

/// Pieces in a fixed order, with the same bits for any number of threads. `band` is the half width
/// in mm.
std::vector<RasterPiece> rasterise(const Solid& solid, double voxel_size, double band);

/// Bytes at the peak of building the level set of a solid: the leaves within the band of each
/// segment's side and of each loose end, as if none overlapped.
double estimated_bytes(const Solid& solid, double voxel_size, double half_width);

/// The same for a surface of this area (mm^2) with bands of different widths (voxels) inside and
/// outside.
double estimated_bytes(double area, double voxel_size, double outside_width, double inside_width);

}  // namespace vstent::sdf
