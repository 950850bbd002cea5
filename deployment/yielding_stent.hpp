// A stent that the wall may bend, shift and narrow: its axis as an elastic line, its radii as
// springs.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <optional>
#include <span>

#include "sdf/geometry.hpp"

namespace vstent::deployment {

/// What resists. Nothing given: the axis keeps its curve, the radii stay.
struct StentStiffness {
  std::optional<double> bending;  ///< N mm^2
  std::optional<double> radial;   ///< N/mm^2: force per mm of length and mm of diameter
};

/// Its axis and outer radii there, mm.
struct StentLine {
  Polyline axis;
  std::vector<double> radii;
};

/// A push of the wall on the stent.
struct Push {
  Vec3 place = Vec3::Zero();  ///< mm
  Vec3 force = Vec3::Zero();  ///< N
};

/// The shapes that a stent can take around its unloaded one, by a vector of unknowns that is zero
/// there: a shift of its middle across the axis and a turn about it (2 + 2), curvature in both
/// planes of a frame that does not twist, and loss of radius, both as cubic B-splines along the
/// axis with knots about a radius apart. Its length stays, and it neither slides along its axis nor
/// spins about it. Displacements may be large: curvature turns the axis exactly.
class YieldingStent {
 public:
  /// \pre unloaded: two points at least, evenly spaced, with positive radii
  YieldingStent(StentLine unloaded, StentStiffness stiffness);

  Eigen::Index unknowns() const;
  Eigen::Index losses() const { return losses_; }  ///< of them, at the end: losses of radius
  StentLine shape(const Eigen::VectorXd& unknowns) const;

  /// N mm: EI/2 times the square of the change of curvature, and k times that of the loss of
  /// radius, along the axis (k per diameter is 2 k per radius).
  double energy(const Eigen::VectorXd& unknowns) const;
  /// Work per unit of each unknown that the pushes do and the stent's own energy takes: zero where
  /// the stent is at rest. Pushes act on the cross-section, or the part of the axis, nearest to
  /// them.
  Eigen::VectorXd forces(const Eigen::VectorXd& unknowns, std::span<const Push> pushes) const;

  /// Second derivative of `energy`.
  const Eigen::MatrixXd& stiffness() const { return stiffness_; }
  /// d^T G d is the mean square along the axis (mm^2) of its displacement and of the loss of
  /// radius, to first order around the unloaded shape; the two do not mix.
  const Eigen::MatrixXd& mean_square() const { return mean_square_; }

 private:
  struct Posed;
  Posed pose(const Eigen::VectorXd& unknowns) const;

  StentLine unloaded_;
  StentStiffness resistance_;
  std::vector<double> arc_;
  std::vector<Eigen::Matrix3d> frames_;  // of each segment: normal, binormal, tangent
  std::size_t middle_ = 0;               // the segment that shifts and turns as a whole
  Eigen::Index splines_ = 0;
  Eigen::MatrixXd basis_;  // of the splines at the axis's points
  Eigen::Index bends_ = 0, losses_ = 0;
  Eigen::MatrixXd stiffness_, mean_square_;
};

/// Newtons: the most work that `forces` do on a motion whose root mean square along the stent is 1
/// mm. It does not depend on how the unknowns are chosen.
double largest_force(const YieldingStent& stent, const Eigen::VectorXd& forces);

}  // namespace vstent::deployment
