// Stiffness between rigid bodies, and what undoes it.
#pragma once

#include <Eigen/SparseCholesky>
#include <utility>
#include <vector>

#include "sdf/geometry.hpp"

namespace vstent::xpbd {

using Matrix6 = Eigen::Matrix<double, 6, 6>;
using Matrix36 = Eigen::Matrix<double, 3, 6>;

/// What a body's shift t and turn w move its point on this arm by: t + w x arm.
Matrix36 motion_on(const Vec3& arm);

/// A symmetric matrix of 6x6 blocks: the forces and torques on bodies that shift and turn by little
/// (shifts first) about their centres. The lower half, by rows.
struct RigidStiffness {
  std::vector<Vec3> centres;    ///< by body
  std::vector<int> first;       ///< of each body in `neighbours`, and the total at the end
  std::vector<int> neighbours;  ///< b <= a of each body a, ascending: the last is itself
  std::vector<Matrix6> blocks;  ///< beside them

  int bodies() const { return static_cast<int>(centres.size()); }
  bool are_neighbours(int a, int b) const;  ///< b <= a
  /// Of bodies b <= a that are neighbours.
  std::size_t block_number(int a, int b) const;
  Matrix6& block(int a, int b) { return blocks[block_number(a, b)]; }
  /// Makes these pairs (a, b), b <= a, neighbours and no others; all blocks are zero then.
  void set_neighbours(std::vector<std::pair<int, int>> pairs);
};

/// Answers forces on bodies with motions that balance them: exactly for a few bodies, by a sparse
/// factorisation; for more, about: by a Gauss-Seidel sweep there and back, and in between exactly
/// for groups of bodies that move as one. Either way by a symmetric positive matrix, as a
/// preconditioner must be.
class RigidSolver {
 public:
  /// Of more bodies than `most_factorised`, groups are.
  explicit RigidSolver(int most_factorised) : most_factorised_(most_factorised) {}

  /// Once neighbours are known, and whenever they change; centres count.
  void analyse(const RigidStiffness& stiffness);
  /// False where it fails.
  bool factorise(const RigidStiffness& stiffness);
  /// Of the stiffness that was factorised. `forces`: six by body; the motions likewise.
  Eigen::VectorXd solve(const RigidStiffness& stiffness, const Eigen::VectorXd& forces) const;

 private:
  void group(const RigidStiffness& stiffness);
  void add_up(const RigidStiffness& stiffness);

  int most_factorised_;
  Eigen::SparseMatrix<double> matrix_;
  Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>> factors_;
  // Of many bodies only.
  std::vector<Matrix6> inverses_;  // of the diagonal
  std::vector<int> home_;          // group of each body
  std::vector<Vec3> arms_;         // from the group's centre, by body
  RigidStiffness groups_;
};

}  // namespace vstent::xpbd
