// How an elastic triangle resists small motions of its corners.
#pragma once

#include <Eigen/Core>
#include <array>
#include <span>

#include "sdf/geometry.hpp"
#include "xpbd/batches.hpp"

namespace vstent::xpbd {

/// The second derivative of the energy in the corners' motions u_v is the square of
/// sum_v strains[v] u_v, plus stress[m] times that of sum_v shares[m][v] u_v for the two principal
/// stresses m. What is negative in the first is left out.
struct TriangleStiffness {
  std::array<Eigen::Matrix3d, 3> strains;  ///< by corner
  std::array<double, 2> stress{};          ///< N mm; negative where compressed
  std::array<std::array<double, 3>, 2> shares{};
};

TriangleStiffness measure_stiffness(const TriangleBatch& batch, std::size_t lane,
                                    const std::array<Vec3, 3>& corners);

}  // namespace vstent::xpbd
