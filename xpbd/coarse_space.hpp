// Rigid motions of neighbourhoods: the soft, wide motions of a sheet that single particles learn of
// only edge by edge.
#pragma once

#include <Eigen/Geometry>
#include <array>
#include <span>
#include <vector>

#include "xpbd/elastic_sheet.hpp"
#include "xpbd/rigid_stiffness.hpp"

namespace vstent::xpbd {

/// A coarse model of the sheet: free particles are gathered into neighbourhoods that move rigidly.
/// Answers a field of forces with the motion of neighbourhoods that balances it, as RigidSolver
/// does: the coarse half of a two-level preconditioner (additive Schwarz with the nullspace of an
/// unsupported shell, as in smoothed aggregation; Vanek, Mandel & Brezina 1996).
class CoarseSpace {
 public:
  CoarseSpace(const ElasticSheet& sheet, std::span<const Slot> particles);

  /// Takes the stiffness at these places. `held`: unit normals along which a particle cannot move,
  /// zero for the others. `links` are added to the sheet.
  void update(const ElasticSheet& sheet, std::span<const Slot> particles,
              std::span<const Vec3> held, std::span<const Link> links = {});

  /// What answers `forces`, by particle: the motions of neighbourhoods.
  Eigen::VectorXd answer(std::span<const Vec3> forces) const;
  /// What particle k moves by with its neighbourhood.
  Vec3 move(const Eigen::VectorXd& answer, std::size_t k) const {
    if (home_[k] < 0) return Vec3::Zero();
    const Eigen::Index first = 6 * home_[k];
    return answer.segment<3>(first) + Vec3(answer.segment<3>(first + 3)).cross(arms_[k]);
  }

  int neighbourhoods() const { return stiffness_.bodies(); }

 private:
  void make_room(std::span<const Link> links);
  void add(std::span<const Link> links);

  /// A part of the sheet's stiffness.
  struct Share {
    std::vector<Matrix6> blocks;
    std::vector<double> own;  // of single particles, N/mm
  };
  template <int kRows, std::size_t kMost>
  class Rows;

  void add(const ConstBatches& batches, std::span<const Slot> particles, Share& share) const;

  /// Whether all are of one neighbourhood, or of none.
  template <std::size_t kCount>
  bool move_as_one(const std::array<int, kCount>& particles) const;

  std::vector<int> home_;     // neighbourhood of each particle, -1: none
  std::vector<int> first_;    // of each neighbourhood in members_
  std::vector<int> members_;  // particles, by neighbourhood
  std::vector<Vec3> arms_;    // from its centre, by particle
  RigidStiffness stiffness_;  // of neighbourhoods
  RigidSolver solver_;
  bool analysed_ = false, succeeded_ = false;
};

}  // namespace vstent::xpbd
