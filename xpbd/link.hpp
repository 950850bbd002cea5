// A stiffness between four particles along one direction.
#pragma once

#include <array>
#include <span>

#include "sdf/geometry.hpp"

namespace vstent::xpbd {

/// Energy stiffness / 2 (sum of weight_k normal . u_k)^2 for small motions u_k.
struct Link {
  std::array<int, 4> particles{};
  std::array<double, 4> weights{};
  Vec3 normal = Vec3::Zero();
  double stiffness = 0;  ///< N/mm
};

}  // namespace vstent::xpbd
