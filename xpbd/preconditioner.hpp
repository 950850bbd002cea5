// How far a force moves the sheet: an approximate inverse of its stiffness matrix, from each
// particle's own surroundings and from motions of whole neighbourhoods.
#pragma once

#include <Eigen/SparseCholesky>
#include <array>
#include <span>
#include <vector>

#include "xpbd/layout.hpp"

namespace vstent::xpbd {

/// Directions in which a particle cannot move: all (pinned), one (a closed contact) or none.
struct Hold {
  Vec3 normal = Vec3::Zero();
  bool pinned = false;

  Vec3 free_part(const Vec3& v) const {
    return pinned ? Vec3::Zero() : Vec3(v - normal.dot(v) * normal);
  }
};

/// Two levels, added. Near: 3x3 blocks D with D >= K (the Gauss-Newton stiffness) as matrices, so
/// that no eigenvalue of D^-1 K exceeds 1. Far: P (P^T K P)^-1 P^T, where P blends rigid motions of
/// overlapping neighbourhoods, none of which moves a particle where it is held.
class Preconditioner {
 public:
  /// Neighbourhoods' centres lie `spacing` mean edges apart or more; 0: near blocks only.
  Preconditioner(const Layout& layout, std::span<const Slot> particles, double spacing);

  /// Weighs the stiffness at the present places: first D, to which `own` (N/mm) is added at each
  /// particle, then the neighbourhoods', with particles held as given.
  void measure_near(const Layout& layout, std::span<const Slot> particles,
                    std::span<const double> own);
  void measure_far(const Layout& layout, std::span<const Slot> particles,
                   std::span<const Hold> holds);

  /// D^-1 force, mm.
  Vec3 near_move(std::size_t particle, const Vec3& force) const;

  /// Solves for the neighbourhoods' motions under the particles' residual forces.
  void pull(std::span<const Slot> residuals);
  /// What they make of a particle, mm.
  Vec3 far_move(std::size_t particle) const;

 private:
  struct Share {
    int node = 0;
    float weight = 0;
  };
  using Motion = std::array<double, 6>;  // of a node: displacement, rotation about its centre

  std::span<const Share> shares(std::size_t particle) const {
    return std::span(shares_).subspan(first_share_[particle],
                                      first_share_[particle + 1] - first_share_[particle]);
  }
  void spread_nodes(const Layout& layout, std::span<const Slot> particles, double spacing);
  void list_members();

  std::vector<std::array<double, 6>> inverse_;  // of D: xx, yy, zz, xy, xz, yz
  std::vector<std::size_t> first_share_;        // by particle, and the total at the end
  std::vector<Share> shares_;
  std::vector<Vec3> centres_;
  std::vector<std::size_t> first_member_;  // by node
  std::vector<std::pair<int, float>> members_;
  std::vector<Vec3> places_;  // where the motions are taken about
  std::vector<Hold> holds_;
  std::vector<Motion> motions_;
  Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>> factors_;
  Eigen::VectorXd load_, answer_;
};

}  // namespace vstent::xpbd
