// Closed surfaces of tubes with a wall, for tests.
#pragma once

#include <cmath>
#include <functional>
#include <numbers>

#include "sdf/geometry.hpp"

namespace vstent::tests {

struct Pipe {
  double outer = 1.5, inner = 1.4, length = 9;
  int around = 48, along = 40;
  std::function<double(double)> wider = [](double) { return 0.0; };  ///< added to both radii at z
};

/// About the z axis from z = 0, outward oriented.
inline TriangleMesh pipe(const Pipe& p) {
  TriangleMesh mesh;
  // The profile runs up the outside and down the inside.
  std::vector<std::array<double, 2>> profile;
  for (int i = 0; i <= p.along; ++i) {
    const double z = p.length * i / p.along;
    profile.push_back({p.outer + p.wider(z), z});
  }
  for (int i = p.along; i >= 0; --i) {
    const double z = p.length * i / p.along;
    profile.push_back({p.inner + p.wider(z), z});
  }
  const int rows = static_cast<int>(profile.size());
  for (const auto& [radius, z] : profile) {
    for (int k = 0; k < p.around; ++k) {
      const double angle = 2 * std::numbers::pi * k / p.around;
      mesh.points.emplace_back(radius * std::cos(angle), radius * std::sin(angle), z);
    }
  }
  const auto vertex = [&](int row, int k) { return (row % rows) * p.around + k % p.around; };
  for (int row = 0; row < rows; ++row) {
    for (int k = 0; k < p.around; ++k) {
      mesh.triangles.push_back({vertex(row, k), vertex(row, k + 1), vertex(row + 1, k)});
      mesh.triangles.push_back({vertex(row, k + 1), vertex(row + 1, k + 1), vertex(row + 1, k)});
    }
  }
  return mesh;
}

}  // namespace vstent::tests
