// How far each particle gives way to a force: the inverse of the stiffness around it.
#pragma once

#include <span>
#include <vector>

#include "xpbd/layout.hpp"
#include "xpbd/link.hpp"

namespace vstent::xpbd {

/// Symmetric 3x3 matrix, mm/N: a particle is soft along the wall's normal and stiff within the
/// wall.
struct Softness {
  double xx = 0, yy = 0, zz = 0, xy = 0, xz = 0, yz = 0;

  Vec3 operator*(const Vec3& f) const {
    return {xx * f.x() + xy * f.y() + xz * f.z(), xy * f.x() + yy * f.y() + yz * f.z(),
            xz * f.x() + yz * f.y() + zz * f.z()};
  }
};

/// Inverses of 3x3 blocks D, which as a block-diagonal matrix bound the sheet's stiffness K at
/// these places from above: no eigenvalue of D^-1 K exceeds 1. K is that of Gauss and Newton,
/// without the hinges' own curvature and without what compressed springs take away across
/// themselves. `own` (N/mm) is added at each particle, `links` between them; softness is 0 where
/// nothing holds.
std::vector<Softness> measure_softness(const Layout& layout, std::span<const Slot> particles,
                                       std::span<const double> own,
                                       std::span<const Link> links = {});

}  // namespace vstent::xpbd
