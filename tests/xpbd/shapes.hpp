// Meshes that the solver's tests stretch.
#pragma once

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>
#include <span>
#include <vector>

#include "xpbd/solver.hpp"

namespace vstent::tests {

struct Mesh {
  std::vector<Vec3> points;
  std::vector<Triangle> triangles;
  std::vector<char> pinned;  // the two rims
};

struct TubeShape {
  double radius = 5, length = 40, edge = 1;
  double narrowing = 0;  // of the diameter, a cosine over +-10 mm
  double jitter = 0;     // of the edge
};

/// Equilateral triangles (before narrowing and jitter), edges along the hoop, odd rows shifted by
/// half an edge.
inline Mesh make_tube(const TubeShape& shape) {
  const int around =
      static_cast<int>(std::lround(2 * std::numbers::pi * shape.radius / shape.edge));
  // An even number of rows above the middle one, which lies at z = 0.
  const int rows =
      2 * static_cast<int>(std::lround(shape.length / shape.edge / std::sqrt(3.0))) + 1;
  const double hoop_edge = 2 * shape.radius * std::sin(std::numbers::pi / around);
  const double spacing = hoop_edge * std::sqrt(3.0) / 2;
  std::mt19937 random(7);
  std::uniform_real_distribution<double> offset(-shape.jitter, shape.jitter);
  Mesh mesh;
  for (int i = 0; i < rows; ++i)
    for (int j = 0; j < around; ++j) {
      const bool rim = i == 0 || i == rows - 1;
      double angle = 2 * std::numbers::pi * (j + 0.5 * (i & 1)) / around;
      double z = spacing * (i - rows / 2);
      if (!rim && shape.jitter > 0) {
        angle += offset(random) * hoop_edge / shape.radius;
        z += offset(random) * hoop_edge;
      }
      const double dip = std::abs(z) < 10 ? 0.5 * (1 + std::cos(std::numbers::pi * z / 10)) : 0;
      const double radius = shape.radius * (1 - shape.narrowing * dip);
      mesh.points.push_back({radius * std::cos(angle), radius * std::sin(angle), z});
      mesh.pinned.push_back(rim);
    }
  for (int i = 0; i + 1 < rows; ++i)
    for (int j = 0; j < around; ++j) {
      const int a = i * around + j, b = i * around + (j + 1) % around;
      const int c = a + around, d = b + around;
      if (i & 1) {
        mesh.triangles.push_back({a, b, d});
        mesh.triangles.push_back({a, d, c});
      } else {
        mesh.triangles.push_back({a, b, c});
        mesh.triangles.push_back({b, d, c});
      }
    }
  return mesh;
}

/// A flat patch of equilateral triangles in the plane z = 0, edges along x.
inline Mesh make_patch(int columns, int rows, double edge) {
  Mesh mesh;
  for (int i = 0; i < rows; ++i)
    for (int j = 0; j < columns; ++j) {
      mesh.points.push_back({edge * (j + 0.5 * (i & 1)), edge * i * std::sqrt(3.0) / 2, 0});
      mesh.pinned.push_back(0);
    }
  for (int i = 0; i + 1 < rows; ++i)
    for (int j = 0; j + 1 < columns; ++j) {
      const int a = i * columns + j, b = a + 1, c = a + columns, d = c + 1;
      if (i & 1) {
        mesh.triangles.push_back({a, b, d});
        mesh.triangles.push_back({a, d, c});
      } else {
        mesh.triangles.push_back({a, b, c});
        mesh.triangles.push_back({b, d, c});
      }
    }
  return mesh;
}

/// A rigid cylinder about z that holds every free vertex with |z| <= half_length outside `radius`.
inline std::vector<xpbd::Contact> cylinder_contacts(std::span<const Vec3> positions,
                                                    const std::vector<char>& pinned, double radius,
                                                    double half_length, double stiffness = 0) {
  std::vector<xpbd::Contact> contacts;
  for (std::size_t i = 0; i < positions.size(); ++i) {
    if (pinned[i] || std::abs(positions[i].z()) > half_length) continue;
    Vec3 normal = positions[i];
    normal.z() = 0;
    if (normal.norm() > radius + 0.5) continue;
    normal.normalize();
    contacts.push_back({static_cast<int>(i), normal, radius, stiffness});
  }
  return contacts;
}

/// Energy (N mm) of the sheet at places of one's choosing.
inline double energy_at(const xpbd::Sheet& sheet, std::span<const Vec3> places) {
  xpbd::Solver solver(sheet);
  solver.set_positions(places);
  return solver.balance({}, 0).energy;
}

inline double distance_from_axis(const Vec3& p) { return std::hypot(p.x(), p.y()); }

inline Vec3 random_vector(std::mt19937& random) {
  std::uniform_real_distribution<double> u(-1, 1);
  const double x = u(random), y = u(random), z = u(random);
  return {x, y, z};
}

inline Eigen::Quaterniond random_rotation(std::mt19937& random) {
  const Vec3 axis = random_vector(random).normalized();
  return Eigen::Quaterniond(Eigen::AngleAxisd(3 * random_vector(random).x(), axis));
}

}  // namespace vstent::tests
