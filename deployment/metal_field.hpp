// The metal of a stent as the wall meets it: how high does it stand on the line out from the axis?
#pragma once

#include "sdf/level_set.hpp"
#include "stents/surface_map.hpp"

namespace vstent::deployment {

/// A place of the wall, and its way out of the stent.
struct WallPlace {
  Vec3 point, outward;
  double arc_length = 0;  ///< of an axis point near it, mm
};

/// Lengths in mm.
struct MetalHit {
  bool found = false;
  double height = 0;     ///< of the outermost metal above the place, along `outward`
  double clearance = 0;  ///< no metal lies nearer to the way than this
  Vec3 outward;          ///< unit
};

class MetalField {
 public:
  virtual ~MetalField() = default;
  /// Comes down the way out from `depth` above the place to `reach` below it.
  virtual MetalHit outermost(const WallPlace& place, double depth, double reach) const = 0;
};

/// Metal voxelised where it is.
class VoxelisedMetal final : public MetalField {
 public:
  explicit VoxelisedMetal(sdf::LevelSet metal) : metal_(std::move(metal)) {}
  MetalHit outermost(const WallPlace& place, double depth, double reach) const override;

 private:
  sdf::LevelSet metal_;
};

/// Metal voxelised once on the straight stent. The map takes the way out to a radial line there, at
/// its own scale.
class MappedMetal final : public MetalField {
 public:
  /// \pre the map outlives the field
  MappedMetal(sdf::LevelSet straight, const stents::SurfaceMap& map);
  MetalHit outermost(const WallPlace& place, double depth, double reach) const override;

 private:
  sdf::LevelSet straight_;
  const stents::SurfaceMap& map_;
  double stretch_;    // of lengths along the axis and out from it, at least
  double shrunk_by_;  // mm, of radii, at most
};

}  // namespace vstent::deployment
