// Rigid motions of neighbourhoods: the soft, wide motions of a sheet that single particles learn of
// only edge by edge.
#pragma once

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

  /// Adds the answer to `forces` to `moves`; both by particle.
  void add_answer(std::span<const Vec3> forces, std::span<Vec3> moves) const;

  int neighbourhoods() const { return stiffness_.bodies(); }

 private:
  void make_room(std::span<const Link> links);
  void add(std::span<const Link> links);

  /// Adds the square of sum_v matrices[v] u_v, for u the vertices' motions.
  template <int kRows, std::size_t kVertices>
  void add_square(const std::array<int, kVertices>& vertices,
                  const std::array<Eigen::Matrix<double, kRows, 3>, kVertices>& matrices);

  std::vector<int> home_;     // neighbourhood of each particle, -1: none
  std::vector<int> first_;    // of each neighbourhood in members_
  std::vector<int> members_;  // particles, by neighbourhood
  std::vector<Vec3> arms_;    // from its centre, by particle
  RigidStiffness stiffness_;  // of neighbourhoods
  RigidSolver solver_;
  bool analysed_ = false, succeeded_ = false;
};

}  // namespace vstent::xpbd
