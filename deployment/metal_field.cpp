#include "deployment/metal_field.hpp"

#include <algorithm>
#include <limits>

namespace vstent::deployment {
namespace {

/// Comes down by the distance that is free. Balls of free space of radii f and f' whose centres are
/// f apart leave f'/2 around the way between them. `at(height)` is a place of the field.
template <class PlaceAt>
MetalHit descend(const sdf::LevelSet& metal, PlaceAt&& at, double depth, double reach) {
  const double close = 0.02 * metal.voxel_size();
  MetalHit hit;
  hit.height = depth;
  hit.clearance = std::numeric_limits<double>::infinity();
  double closest = std::numeric_limits<double>::infinity();
  constexpr int kLooks = 24;  // a way that grazes the metal for longer counts as touching it
  for (int look = 0; look < kLooks; ++look) {
    const sdf::Sample sample = metal.sample(at(hit.height));
    // Where a node around the place lies outside the band, all that is known is the band's width
    // less the nodes' distance.
    const double free = sample.gradient.isZero() && sample.distance > 0
                            ? sample.distance - 2.5 * metal.voxel_size()
                            : sample.distance;
    closest = std::min(closest, free);
    hit.clearance = std::min(hit.clearance, 0.5 * free);
    if (free <= close) {
      hit.found = true;
      return hit;
    }
    hit.height -= free;
    if (hit.height < -reach) {
      hit.clearance = std::min(hit.clearance, -reach - hit.height);
      return hit;
    }
  }
  hit.found = closest < 0.25 * metal.voxel_size();
  return hit;
}

}  // namespace

MetalHit VoxelisedMetal::outermost(const WallPlace& place, double depth, double reach) const {
  MetalHit hit = descend(
      metal_, [&](double height) -> Vec3 { return place.point + height * place.outward; }, depth,
      reach);
  hit.outward = place.outward;
  return hit;
}

MappedMetal::MappedMetal(sdf::LevelSet straight, const stents::SurfaceMap& map)
    : straight_(std::move(straight)),
      map_(map),
      stretch_(map.least_stretch()),
      shrunk_by_(std::max(0.0, map.straight_radius() - map.smallest_radius())) {}

MetalHit MappedMetal::outermost(const WallPlace& place, double depth, double reach) const {
  const auto way = map_.way_out(place.point, place.arc_length);
  if (!way) return {.clearance = 0, .outward = place.outward};
  // The straight stent's own axis is as far down as there can be metal.
  const double deepest = std::min(reach, way->straight_radius);
  if (depth <= -deepest) return {.clearance = 0, .outward = way->outward};
  MetalHit hit = descend(
      straight_, [&](double height) { return way->straight(height); }, depth, deepest);
  hit.outward = way->outward;
  // A clearance there is less here where lengths shrink; around the axis they do so with the
  // radius, which is looked at down to half the place's.
  const double around = 0.5 * way->radius / (0.5 * way->radius + shrunk_by_);
  hit.clearance = std::min(hit.clearance * std::min(stretch_, around), 0.5 * way->radius);
  return hit;
}

}  // namespace vstent::deployment
