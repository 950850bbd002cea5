// Closed loops in space that are nearly flat: outlines that the wall carried along.
#pragma once

#include <span>

#include "vessels/sections.hpp"

namespace vstent::measure {

/// The area vector is half the sum of p x q over the sides (Stokes); the centroid is that of the
/// loop seen along it.
struct Loop {
  Vec3 centroid = Vec3::Zero();
  Vec3 area_vector = Vec3::Zero();  ///< mm2
};
Loop loop(std::span<const Vec3> points);

/// Where the outline's points went with the wall they lie on. `points`: of the moved mesh.
std::vector<Vec3> carried(const vessels::Section& section, std::span<const Vec3> points);

}  // namespace vstent::measure
