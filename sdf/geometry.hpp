// Plain geometry types that every folder shares. Lengths are millimetres throughout.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <array>
#include <limits>
#include <vector>

namespace vstent {

using Vec3 = Eigen::Vector3d;
using Triangle = std::array<int, 3>;

/// Axis-aligned box; a default box is empty and grows with `include`.
struct Box {
  Vec3 lower = Vec3::Constant(std::numeric_limits<double>::infinity());
  Vec3 upper = Vec3::Constant(-std::numeric_limits<double>::infinity());

  void include(const Vec3& point) {
    lower = lower.cwiseMin(point);
    upper = upper.cwiseMax(point);
  }
  void include(const Box& other) {
    lower = lower.cwiseMin(other.lower);
    upper = upper.cwiseMax(other.upper);
  }
  void pad(double margin) {
    lower.array() -= margin;
    upper.array() += margin;
  }
  bool overlaps(const Box& other) const {
    return (lower.array() <= other.upper.array()).all() &&
           (other.lower.array() <= upper.array()).all();
  }
  double squared_distance(const Vec3& point) const {
    return (lower - point).cwiseMax(point - upper).cwiseMax(0.0).squaredNorm();
  }
};

/// Triangles indexing points; a surface's triangles are counter-clockwise seen from outside.
struct TriangleMesh {
  std::vector<Vec3> points;
  std::vector<Triangle> triangles;
};

/// Points joined in order by straight segments.
using Polyline = std::vector<Vec3>;

}  // namespace vstent
