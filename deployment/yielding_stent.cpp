#include "deployment/yielding_stent.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <utility>

#include "sdf/polyline.hpp"

namespace vstent::deployment {
namespace {

using Eigen::Index;
using Eigen::Matrix3d;
using Eigen::VectorXd;

constexpr Index kShift = 0, kTurn = 2, kRigid = 4;  // offsets of the unknowns

Matrix3d cross_matrix(const Vec3& v) {
  Matrix3d m;
  m << 0, -v.z(), v.y(), v.z(), 0, -v.x(), -v.y(), v.x(), 0;
  return m;
}

Matrix3d rotation(const Vec3& turn) {
  const double angle = turn.norm();
  if (angle == 0) return Matrix3d::Identity();
  return Eigen::AngleAxisd(angle, turn / angle).toRotationMatrix();
}

/// As `turn` grows a little, rotation(turn) is followed by a rotation of this times the growth.
Matrix3d growth_of_rotation(const Vec3& turn) {
  const double angle = turn.norm();
  const Matrix3d k = cross_matrix(turn);
  if (angle < 1e-4) return Matrix3d::Identity() + k / 2 + k * k / 6;
  return Matrix3d::Identity() + (1 - std::cos(angle)) / (angle * angle) * k +
         (angle - std::sin(angle)) / (angle * angle * angle) * k * k;
}

/// The uniform cubic B-spline that lives on 0 .. 4.
double cubic_spline(double u) {
  if (u <= 0 || u >= 4) return 0;
  if (u > 2) u = 4 - u;
  if (u <= 1) return u * u * u / 6;
  const double w = u - 1;
  return (1 + 3 * w + 3 * w * w - 3 * w * w * w) / 6;
}

Matrix3d frame(const Vec3& normal, const Vec3& tangent) {
  Matrix3d m;
  m.col(0) = normal;
  m.col(1) = tangent.cross(normal);
  m.col(2) = tangent;
  return m;
}

/// Of the segments of a line, each turned from the one before by the least rotation.
std::vector<Matrix3d> segment_frames(const Polyline& axis) {
  std::vector<Matrix3d> frames;
  for (std::size_t i = 0; i + 1 < axis.size(); ++i) {
    const Vec3 tangent = (axis[i + 1] - axis[i]).normalized();
    if (frames.empty()) {
      int smallest = 0;
      tangent.cwiseAbs().minCoeff(&smallest);
      frames.push_back(frame(tangent.cross(Vec3::Unit(smallest)).normalized(), tangent));
    } else {
      const Matrix3d& before = frames.back();
      const Vec3 normal =
          Eigen::Quaterniond::FromTwoVectors(before.col(2), tangent) * before.col(0);
      frames.push_back(frame((normal - normal.dot(tangent) * tangent).normalized(), tangent));
    }
  }
  return frames;
}

Index index(std::size_t i) { return static_cast<Index>(i); }

}  // namespace

/// The stent somewhere.
struct YieldingStent::Posed {
  StentLine line;
  std::vector<Matrix3d> frames;  // of segments
  std::vector<Vec3> turns;       // beyond the unloaded ones, at inner points, in the frame behind
};

YieldingStent::YieldingStent(StentLine unloaded, StentStiffness stiffness)
    : unloaded_(std::move(unloaded)),
      resistance_(stiffness),
      arc_(arc_lengths(unloaded_.axis)),
      frames_(segment_frames(unloaded_.axis)),
      middle_(frames_.size() / 2) {
  const double length = arc_.back();
  const double radius = *std::max_element(unloaded_.radii.begin(), unloaded_.radii.end());
  const double spans = std::max(2.0, std::round(length / radius));
  splines_ = static_cast<Index>(spans) + 3;
  const auto points = index(arc_.size());
  basis_.resize(points, splines_);
  for (Index i = 0; i < points; ++i)
    for (Index k = 0; k < splines_; ++k)
      basis_(i, k) = cubic_spline(arc_[static_cast<std::size_t>(i)] / length * spans + 3 -
                                  static_cast<double>(k));
  bends_ = resistance_.bending ? splines_ : 0;
  losses_ = resistance_.radial ? splines_ : 0;

  // Length that belongs to each point.
  VectorXd share(points);
  for (Index i = 0; i < points; ++i) {
    const auto p = static_cast<std::size_t>(i);
    share[i] = 0.5 * (arc_[std::min(p + 1, arc_.size() - 1)] - arc_[p > 0 ? p - 1 : 0]);
  }
  const Index n = unknowns();
  stiffness_ = Eigen::MatrixXd::Zero(n, n);
  // Curvature is of inner points; between them the line is straight.
  VectorXd inner = share;
  inner[0] = inner[points - 1] = 0;
  for (Index plane = 0; plane < 2 && bends_ > 0; ++plane) {
    const Index at = kRigid + plane * bends_;
    stiffness_.block(at, at, bends_, bends_) =
        *resistance_.bending * basis_.transpose() * inner.asDiagonal() * basis_;
  }
  const Index loss = kRigid + 2 * bends_;
  if (losses_ > 0)
    stiffness_.block(loss, loss, losses_, losses_) =
        2 * *resistance_.radial * basis_.transpose() * share.asDiagonal() * basis_;

  mean_square_ = Eigen::MatrixXd::Zero(n, n);
  if (losses_ > 0)
    mean_square_.block(loss, loss, losses_, losses_) =
        basis_.transpose() * (share / length).asDiagonal() * basis_;
  // What unit pushes at the axis's points would do is how these points move.
  const VectorXd rest = VectorXd::Zero(n);
  for (std::size_t i = 0; i < unloaded_.axis.size(); ++i) {
    for (int direction = 0; direction < 3; ++direction) {
      const Push unit{unloaded_.axis[i], Vec3::Unit(direction)};
      VectorXd moves = forces(rest, {&unit, 1});
      moves.tail(losses_).setZero();
      mean_square_ += share[index(i)] / length * moves * moves.transpose();
    }
  }
}

Index YieldingStent::unknowns() const { return kRigid + 2 * bends_ + losses_; }

YieldingStent::Posed YieldingStent::pose(const VectorXd& unknowns) const {
  const std::size_t segments = frames_.size();
  Posed p;
  p.turns.assign(segments + 1, Vec3::Zero());
  if (bends_ > 0) {
    const VectorXd first = basis_ * unknowns.segment(kRigid, bends_);
    const VectorXd second = basis_ * unknowns.segment(kRigid + bends_, bends_);
    for (std::size_t i = 1; i < segments; ++i) {
      const double reach = 0.5 * (arc_[i + 1] - arc_[i - 1]);
      p.turns[i] = reach * Vec3(first[index(i)], second[index(i)], 0);
    }
  }
  const Matrix3d& rest = frames_[middle_];
  const Vec3 turn = rest.col(0) * unknowns[kTurn] + rest.col(1) * unknowns[kTurn + 1];
  p.frames.resize(segments);
  p.frames[middle_] = rotation(turn) * rest;
  // From segment to segment: the unloaded turn, then the turn beyond it.
  const auto joint = [&](std::size_t i) {
    return Matrix3d(frames_[i - 1].transpose() * frames_[i] * rotation(p.turns[i]));
  };
  for (std::size_t i = middle_ + 1; i < segments; ++i) p.frames[i] = p.frames[i - 1] * joint(i);
  for (std::size_t i = middle_; i > 0; --i) p.frames[i - 1] = p.frames[i] * joint(i).transpose();

  const auto segment_length = [&](std::size_t i) { return arc_[i + 1] - arc_[i]; };
  const Vec3 centre = 0.5 * (unloaded_.axis[middle_] + unloaded_.axis[middle_ + 1]) +
                      rest.col(0) * unknowns[kShift] + rest.col(1) * unknowns[kShift + 1];
  p.line.axis.resize(segments + 1);
  p.line.axis[middle_] = centre - 0.5 * segment_length(middle_) * p.frames[middle_].col(2);
  for (std::size_t i = middle_; i < segments; ++i)
    p.line.axis[i + 1] = p.line.axis[i] + segment_length(i) * p.frames[i].col(2);
  for (std::size_t i = middle_; i > 0; --i)
    p.line.axis[i - 1] = p.line.axis[i] - segment_length(i - 1) * p.frames[i - 1].col(2);

  p.line.radii = unloaded_.radii;
  if (losses_ > 0) {
    const VectorXd loss = basis_ * unknowns.tail(losses_);
    for (std::size_t i = 0; i <= segments; ++i) p.line.radii[i] -= loss[index(i)];
  }
  return p;
}

StentLine YieldingStent::shape(const VectorXd& unknowns) const { return pose(unknowns).line; }

double YieldingStent::energy(const VectorXd& unknowns) const {
  return 0.5 * unknowns.dot(stiffness_ * unknowns);
}

VectorXd YieldingStent::forces(const VectorXd& unknowns, std::span<const Push> pushes) const {
  const Posed p = pose(unknowns);
  const std::size_t segments = frames_.size();
  // Per segment: the force on it, and its moment about the origin.
  std::vector<Vec3> force(segments, Vec3::Zero()), moment(segments, Vec3::Zero());
  VectorXd squeezed = VectorXd::Zero(basis_.rows());
  for (const Push& push : pushes) {
    const PolylinePlace place = nearest_place(p.line.axis, arc_, push.place);
    const auto s = static_cast<std::size_t>(place.segment);
    force[s] += push.force;
    moment[s] += push.place.cross(push.force);
    if (losses_ == 0) continue;
    const Vec3 out = push.place - point_at(p.line.axis, arc_, place.arc_length);
    if (out.isZero()) continue;
    const double share = (place.arc_length - arc_[s]) / (arc_[s + 1] - arc_[s]);
    const double inwards = -push.force.dot(out.normalized());
    squeezed[index(s)] += (1 - share) * inwards;
    squeezed[index(s + 1)] += share * inwards;
  }

  VectorXd result = -stiffness_ * unknowns;
  Vec3 all = Vec3::Zero(), about_origin = Vec3::Zero();
  for (std::size_t i = 0; i < segments; ++i) {
    all += force[i];
    about_origin += moment[i];
  }
  const Matrix3d& rest = frames_[middle_];
  const Vec3 centre = 0.5 * (p.line.axis[middle_] + p.line.axis[middle_ + 1]);
  const Vec3 turn = rest.col(0) * unknowns[kTurn] + rest.col(1) * unknowns[kTurn + 1];
  const Vec3 about_middle =
      growth_of_rotation(turn).transpose() * (about_origin - centre.cross(all));
  for (Index plane = 0; plane < 2; ++plane) {
    result[kShift + plane] += rest.col(plane).dot(all);
    result[kTurn + plane] += rest.col(plane).dot(about_middle);
  }

  if (bends_ > 0) {
    // A turn at an inner point takes along what lies beyond it, seen from the middle.
    VectorXd first = VectorXd::Zero(basis_.rows()), second = first;
    const auto add = [&](std::size_t i, const Vec3& beyond, const Vec3& beyond_moment,
                         double sign) {
      const Vec3 about_point = beyond_moment - p.line.axis[i].cross(beyond);
      const Vec3 local =
          growth_of_rotation(-p.turns[i]).transpose() * (p.frames[i].transpose() * about_point);
      const double reach = sign * 0.5 * (arc_[i + 1] - arc_[i - 1]);
      first[index(i)] = reach * local.x();
      second[index(i)] = reach * local.y();
    };
    Vec3 beyond = Vec3::Zero(), beyond_moment = Vec3::Zero();
    for (std::size_t i = segments - 1; i > middle_; --i) {
      beyond += force[i];
      beyond_moment += moment[i];
      add(i, beyond, beyond_moment, 1);
    }
    beyond = beyond_moment = Vec3::Zero();
    for (std::size_t i = 1; i <= middle_; ++i) {
      beyond += force[i - 1];
      beyond_moment += moment[i - 1];
      add(i, beyond, beyond_moment, -1);
    }
    result.segment(kRigid, bends_) += basis_.transpose() * first;
    result.segment(kRigid + bends_, bends_) += basis_.transpose() * second;
  }
  if (losses_ > 0) result.tail(losses_) += basis_.transpose() * squeezed;
  return result;
}

double largest_force(const YieldingStent& stent, const VectorXd& forces) {
  return std::sqrt(std::max(0.0, forces.dot(stent.mean_square().ldlt().solve(forces))));
}

}  // namespace vstent::deployment
