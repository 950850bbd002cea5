#include "xpbd/rigid_stiffness.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "xpbd/layout.hpp"
#include "xpbd/neighbourhoods.hpp"
#include "xpbd/parallel.hpp"

namespace vstent::xpbd {
namespace {

// Bodies in a group, at least. Groups of groups were tried: too stiff, they took eight times the
// iterations.
constexpr double kMembers = 8;

using Vector6 = Eigen::Matrix<double, 6, 1>;

Eigen::Index six(int body) { return 6 * static_cast<Eigen::Index>(body); }

/// What a group's shift and turn move a body on this arm by: it turns with the group.
Matrix6 carried(const Vec3& arm) {
  Matrix6 motion = Matrix6::Identity();
  motion.topRows<3>() = motion_on(arm);
  return motion;
}

/// Visits all pairs of neighbours: visit(a, b, the block's place), b <= a.
template <class Visit>
void for_each_block(const RigidStiffness& stiffness, Visit&& visit) {
  for (int a = 0; a < stiffness.bodies(); ++a)
    for (int n = stiffness.first[at(a)]; n < stiffness.first[at(a) + 1]; ++n)
      visit(a, stiffness.neighbours[at(n)], at(n));
}

void take_entries(const RigidStiffness& stiffness, Eigen::SparseMatrix<double>& matrix) {
  std::vector<Eigen::Triplet<double>> entries;
  entries.reserve(36 * stiffness.blocks.size());
  for_each_block(stiffness, [&](int a, int b, std::size_t n) {
    for (int r = 0; r < 6; ++r)
      for (int c = 0; c < 6; ++c)
        if (a != b || r >= c)
          entries.emplace_back(six(a) + r, six(b) + c, stiffness.blocks[n](r, c));
  });
  matrix.setFromTriplets(entries.begin(), entries.end());
}

}  // namespace

Matrix36 motion_on(const Vec3& arm) {
  Matrix36 motion;
  motion << 1, 0, 0, 0, arm.z(), -arm.y(),  //
      0, 1, 0, -arm.z(), 0, arm.x(),        //
      0, 0, 1, arm.y(), -arm.x(), 0;
  return motion;
}

bool RigidStiffness::are_neighbours(int a, int b) const {
  return std::binary_search(neighbours.begin() + first[at(a)],
                            neighbours.begin() + first[at(a) + 1], b);
}

std::size_t RigidStiffness::block_number(int a, int b) const {
  const auto begin = neighbours.begin() + first[at(a)];
  const auto end = neighbours.begin() + first[at(a) + 1];
  return static_cast<std::size_t>(std::lower_bound(begin, end, b) - neighbours.begin());
}

void RigidStiffness::set_neighbours(std::vector<std::pair<int, int>> pairs) {
  std::sort(pairs.begin(), pairs.end());
  pairs.erase(std::unique(pairs.begin(), pairs.end()), pairs.end());
  neighbours.clear();
  first.assign(centres.size() + 1, 0);
  for (const auto& [a, b] : pairs) {
    neighbours.push_back(b);
    ++first[at(a) + 1];
  }
  std::partial_sum(first.begin(), first.end(), first.begin());
  blocks.assign(neighbours.size(), Matrix6::Zero());
}

void RigidSolver::analyse(const RigidStiffness& stiffness) {
  home_.clear();
  if (stiffness.bodies() > most_factorised_) group(stiffness);
  const RigidStiffness& factorised = home_.empty() ? stiffness : groups_;
  matrix_.resize(six(factorised.bodies()), six(factorised.bodies()));
  take_entries(factorised, matrix_);
  factors_.analyzePattern(matrix_);
}

void RigidSolver::group(const RigidStiffness& stiffness) {
  std::vector<GraphEdge> edges;
  for_each_block(stiffness, [&](int a, int b, std::size_t) {
    if (a != b)
      edges.push_back({a, b, (stiffness.centres[at(a)] - stiffness.centres[at(b)]).norm()});
  });
  const Graph graph = make_graph(stiffness.centres.size(), edges);
  std::vector<int> order(stiffness.centres.size());
  std::iota(order.begin(), order.end(), 0);
  const double members =
      std::max(kMembers, static_cast<double>(stiffness.bodies()) / most_factorised_);
  const Neighbourhoods found =
      find_neighbourhoods(graph, order, std::sqrt(members) * graph.mean_length);
  home_ = found.home;
  groups_.centres.assign(found.seeds.size(), Vec3::Zero());
  std::vector<std::pair<int, int>> beside;
  for_each_block(stiffness, [&](int a, int b, std::size_t) {
    const auto [lower, upper] = std::minmax(home_[at(a)], home_[at(b)]);
    beside.emplace_back(upper, lower);
  });
  groups_.set_neighbours(std::move(beside));
}

/// The groups' stiffness: that of their bodies, who move with them.
void RigidSolver::add_up(const RigidStiffness& stiffness) {
  std::vector<int> members(groups_.centres.size(), 0);
  std::fill(groups_.centres.begin(), groups_.centres.end(), Vec3::Zero());
  for (std::size_t body = 0; body < home_.size(); ++body) {
    groups_.centres[at(home_[body])] += stiffness.centres[body];
    ++members[at(home_[body])];
  }
  for (std::size_t g = 0; g < members.size(); ++g) groups_.centres[g] /= members[g];
  arms_.resize(home_.size());
  for (std::size_t body = 0; body < home_.size(); ++body)
    arms_[body] = stiffness.centres[body] - groups_.centres[at(home_[body])];
  for (Matrix6& b : groups_.blocks) b.setZero();
  for_each_block(stiffness, [&](int a, int b, std::size_t n) {
    const Matrix6 shared =
        carried(arms_[at(a)]).transpose() * stiffness.blocks[n] * carried(arms_[at(b)]);
    const int of_a = home_[at(a)], of_b = home_[at(b)];
    if (of_a >= of_b) groups_.block(of_a, of_b) += shared;
    if (a != b && of_b >= of_a) groups_.block(of_b, of_a) += shared.transpose();
  });
}

bool RigidSolver::factorise(const RigidStiffness& stiffness) {
  if (!home_.empty()) {
    inverses_.resize(stiffness.centres.size());
    side_by_side(inverses_.size(), [&](std::size_t body) {
      const Matrix6& own = stiffness.blocks[at(stiffness.first[body + 1] - 1)];
      inverses_[body] = own.ldlt().solve(Matrix6::Identity());
    });
    add_up(stiffness);
  }
  take_entries(home_.empty() ? stiffness : groups_, matrix_);
  factors_.factorize(matrix_);
  return factors_.info() == Eigen::Success;
}

Eigen::VectorXd RigidSolver::solve(const RigidStiffness& s, const Eigen::VectorXd& forces) const {
  if (home_.empty()) return factors_.solve(forces);
  const auto of = [](auto& all, int body) { return all.template segment<6>(six(body)); };
  const auto own = [&](int a) { return s.first[at(a) + 1] - 1; };
  /// The body's motion, once those before it have moved.
  const auto move = [&](int a, Vector6 force, Eigen::VectorXd& motions) {
    for (int n = s.first[at(a)]; n < own(a); ++n)
      force -= s.blocks[at(n)] * of(motions, s.neighbours[at(n)]);
    of(motions, a) = inverses_[at(a)] * force;
  };
  /// What its motion does to those before it.
  const auto push = [&](int a, const Eigen::VectorXd& motions, Eigen::VectorXd& forces_before) {
    for (int n = s.first[at(a)]; n < own(a); ++n)
      of(forces_before, s.neighbours[at(n)]) -= s.blocks[at(n)].transpose() * of(motions, a);
  };
  // There, from rest: what is then left of the forces is what bodies further on have done.
  Eigen::VectorXd motions(forces.size());
  Eigen::VectorXd left = Eigen::VectorXd::Zero(forces.size());
  for (int a = 0; a < s.bodies(); ++a) {
    move(a, of(forces, a), motions);
    push(a, motions, left);
  }
  Eigen::VectorXd on_groups = Eigen::VectorXd::Zero(six(groups_.bodies()));
  for (int a = 0; a < s.bodies(); ++a)
    of(on_groups, home_[at(a)]) += carried(arms_[at(a)]).transpose() * of(left, a);
  const Eigen::VectorXd of_groups = factors_.solve(on_groups);
  for (int a = 0; a < s.bodies(); ++a)
    of(motions, a) += carried(arms_[at(a)]) * of(of_groups, home_[at(a)]);
  Eigen::VectorXd from_beyond = Eigen::VectorXd::Zero(forces.size());
  for (int a = s.bodies() - 1; a >= 0; --a) {
    move(a, of(forces, a) + of(from_beyond, a), motions);
    push(a, motions, from_beyond);
  }
  return motions;
}

}  // namespace vstent::xpbd
