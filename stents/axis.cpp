#include "stents/axis.hpp"

#include <Eigen/Geometry>
#include <Eigen/SVD>
#include <algorithm>
#include <cmath>

#include "sdf/polyline.hpp"

namespace vstent::stents {
namespace {

Vec3 any_perpendicular(const Vec3& direction) {
  int smallest = 0;
  direction.cwiseAbs().minCoeff(&smallest);
  return direction.cross(Vec3::Unit(smallest)).normalized();
}

/// The rigid motion of `line` that brings it closest to `target`, point by point (Kabsch 1976).
Polyline aligned(const Polyline& line, const Polyline& target) {
  const auto centroid = [](const Polyline& points) {
    Vec3 sum = Vec3::Zero();
    for (const Vec3& p : points) sum += p;
    return Vec3(sum / static_cast<double>(points.size()));
  };
  const Vec3 from = centroid(line);
  const Vec3 to = centroid(target);
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();
  for (std::size_t i = 0; i < line.size(); ++i)
    covariance += (target[i] - to) * (line[i] - from).transpose();
  // A line leaves the rotation about itself open; a small multiple of the identity picks the one
  // nearest to none.
  covariance += 1e-9 * covariance.norm() * Eigen::Matrix3d::Identity();
  const Eigen::JacobiSVD<Eigen::Matrix3d> svd(covariance,
                                              Eigen::ComputeFullU | Eigen::ComputeFullV);
  Eigen::Matrix3d fix = Eigen::Matrix3d::Identity();
  fix(2, 2) = (svd.matrixU() * svd.matrixV().transpose()).determinant() < 0 ? -1 : 1;
  const Eigen::Matrix3d rotation = svd.matrixU() * fix * svd.matrixV().transpose();
  Polyline result(line.size());
  for (std::size_t i = 0; i < line.size(); ++i) result[i] = to + rotation * (line[i] - from);
  return result;
}

}  // namespace

std::vector<Frame> rotation_minimising_frames(const Polyline& axis) {
  const std::vector<Vec3> directions = tangents(axis);
  std::vector<Frame> frames(axis.size());
  if (axis.empty()) return frames;
  frames[0] = {directions[0], any_perpendicular(directions[0])};
  for (std::size_t i = 0; i + 1 < axis.size(); ++i) {
    const Vec3 chord = axis[i + 1] - axis[i];
    const double c1 = chord.squaredNorm();
    const Vec3 normal_reflected = frames[i].normal - (2 / c1) * chord.dot(frames[i].normal) * chord;
    const Vec3 tangent_reflected =
        frames[i].tangent - (2 / c1) * chord.dot(frames[i].tangent) * chord;
    const Vec3 v2 = directions[i + 1] - tangent_reflected;
    const double c2 = v2.squaredNorm();
    Vec3 normal = c2 < 1e-14 ? normal_reflected
                             : Vec3(normal_reflected - (2 / c2) * v2.dot(normal_reflected) * v2);
    normal -= normal.dot(directions[i + 1]) * directions[i + 1];
    frames[i + 1] = {directions[i + 1], normal.normalized()};
  }
  return frames;
}

Polyline straightened(const Polyline& axis, double strength) {
  if (strength == 0 || axis.size() < 3) return axis;
  const double keep = 1 - strength;
  Polyline result(axis.size());
  result[0] = axis[0];
  result[1] = axis[1];
  // `orientation` turns the native line's local frame into the new line's; each joint adds back
  // only part of its turn.
  Eigen::Quaterniond orientation = Eigen::Quaterniond::Identity();
  for (std::size_t i = 1; i + 1 < axis.size(); ++i) {
    const Vec3 before = (axis[i] - axis[i - 1]).normalized();
    const Vec3 after = (axis[i + 1] - axis[i]).normalized();
    const Eigen::AngleAxisd turn(Eigen::Quaterniond::FromTwoVectors(before, after));
    const Eigen::Quaterniond undo(Eigen::AngleAxisd(-(1 - keep) * turn.angle(), turn.axis()));
    orientation = (orientation * undo).normalized();
    result[i + 1] = result[i] + orientation * (axis[i + 1] - axis[i]);
  }
  return aligned(result, axis);
}

double largest_curvature(const Polyline& axis) {
  double largest = 0;
  for (std::size_t i = 1; i + 1 < axis.size(); ++i) {
    const Vec3 a = axis[i] - axis[i - 1];
    const Vec3 b = axis[i + 1] - axis[i];
    const double turn = std::atan2(a.cross(b).norm(), a.dot(b));
    largest = std::max(largest, 2 * turn / (a.norm() + b.norm()));
  }
  return largest;
}

double end_tangent_angle(const Polyline& axis) {
  const std::size_t n = axis.size();
  const Vec3 first = axis[1] - axis[0];
  const Vec3 last = axis[n - 1] - axis[n - 2];
  return std::atan2(first.cross(last).norm(), first.dot(last));
}

}  // namespace vstent::stents
