#include "xpbd/coarse_space.hpp"

#include <algorithm>
#include <cmath>
#include <set>

#include "xpbd/neighbourhoods.hpp"
#include "xpbd/parallel.hpp"
#include "xpbd/triangle_stiffness.hpp"

namespace vstent::xpbd {
namespace {

// Particles in a neighbourhood: fewer make the coarse system slow, more leave too much to single
// particles. Measured on a coarctation of 14k particles, iterations to 2e-4: 227 with 80, 162 with
// 40, 132 with 20.
constexpr double kMembers = 20;
constexpr double kMostNeighbourhoods = 1500;
// Of a held particle's stiffness along its normal, over that of a spring.
constexpr double kHeld = 100;
// Share of a neighbourhood's own stiffness that keeps the factorisation from failing where nothing
// holds it.
constexpr double kLeast = 1e-8;

Eigen::Matrix3d cross_matrix(const Vec3& v) {
  Eigen::Matrix3d m;
  m << 0, -v.z(), v.y(), v.z(), 0, -v.x(), -v.y(), v.x(), 0;
  return m;
}

using Rigid = Eigen::Matrix<double, 3, 6>;

/// What a neighbourhood's shift and turn move a particle on this arm by: t + w x arm.
Rigid rigid(const Vec3& arm) {
  Rigid motion;
  motion << Eigen::Matrix3d::Identity(), -cross_matrix(arm);
  return motion;
}

}  // namespace

CoarseSpace::CoarseSpace(const ElasticSheet& sheet, std::span<const Slot> particles) {
  std::vector<GraphEdge> edges;
  for_each_distance(sheet.layout, [&](int i, int j, double length, double) {
    edges.push_back({i, j, length});
  });
  for_each_triangle(
      sheet.layout, [&](const std::array<int, 3>& v, const TriangleBatch&, std::size_t) {
        for (std::size_t k = 0; k < 3; ++k) {  // most edges twice: no matter
          const int i = v[k], j = v[(k + 1) % 3];
          edges.push_back({i, j, (place(particles[at(i)]) - place(particles[at(j)])).norm()});
        }
      });
  const Graph graph = make_graph(particles.size(), edges);
  std::vector<int> free;
  for (std::size_t k = 0; k < sheet.free.size(); ++k)
    if (sheet.free[k]) free.push_back(static_cast<int>(k));
  const double members =
      std::max(kMembers, static_cast<double>(particles.size()) / kMostNeighbourhoods);
  // A neighbourhood of this spacing owns about as much as so many particles of an even mesh.
  home_ = find_neighbourhoods(graph, free, std::sqrt(members) * graph.mean_length).home;
  const int homes = home_.empty() ? 0 : 1 + *std::max_element(home_.begin(), home_.end());
  first_.assign(at(homes) + 1, 0);
  for (const int h : home_)
    if (h >= 0) ++first_[at(h) + 1];
  for (std::size_t h = 1; h < first_.size(); ++h) first_[h] += first_[h - 1];
  members_.resize(at(first_.back()));
  std::vector<int> next(first_.begin(), first_.end() - 1);
  for (std::size_t k = 0; k < home_.size(); ++k)
    if (home_[k] >= 0) members_[at(next[at(home_[k])]++)] = static_cast<int>(k);
  centres_.resize(at(homes));
  arms_.assign(particles.size(), Vec3::Zero());

  std::vector<std::set<int>> beside(at(homes));
  const auto join = [&](int i, int j) {
    const int a = home_[at(i)], b = home_[at(j)];
    if (a >= 0 && b >= 0) beside[at(std::max(a, b))].insert(std::min(a, b));
  };
  for (int h = 0; h < homes; ++h) beside[at(h)].insert(h);
  for_each_distance(sheet.layout, [&](int i, int j, double, double) { join(i, j); });
  for_each_bending(sheet.layout, [&](const std::array<int, 4>& v, double, double) {
    for (std::size_t k = 0; k < 4; ++k)
      for (std::size_t l = 0; l < k; ++l) join(v[k], v[l]);
  });
  for_each_triangle(sheet.layout,
                    [&](const std::array<int, 3>& v, const TriangleBatch&, std::size_t) {
                      for (std::size_t k = 0; k < 3; ++k) join(v[k], v[(k + 1) % 3]);
                    });
  first_neighbour_.push_back(0);
  for (const std::set<int>& of_one : beside) {
    neighbours_.insert(neighbours_.end(), of_one.begin(), of_one.end());
    first_neighbour_.push_back(static_cast<int>(neighbours_.size()));
  }
  blocks_.resize(neighbours_.size());
  matrix_.resize(6 * homes, 6 * homes);
}

template <int kRows, std::size_t kVertices>
void CoarseSpace::add_square(
    const std::array<int, kVertices>& vertices,
    const std::array<Eigen::Matrix<double, kRows, 3>, kVertices>& matrices) {
  std::array<int, kVertices> homes{};
  std::array<Eigen::Matrix<double, kRows, 6>, kVertices> turning;
  std::size_t different = 0;
  for (std::size_t k = 0; k < kVertices; ++k) {
    const int home = home_[at(vertices[k])];
    if (home < 0) continue;
    std::size_t slot = 0;
    while (slot < different && homes[slot] != home) ++slot;
    if (slot == different) {
      homes[different] = home;
      turning[different++].setZero();
    }
    turning[slot] += matrices[k] * rigid(arms_[at(vertices[k])]);
  }
  for (std::size_t k = 0; k < different; ++k)
    for (std::size_t l = 0; l < different; ++l)
      if (homes[k] >= homes[l]) block(homes[k], homes[l]) += turning[k].transpose() * turning[l];
}

CoarseSpace::Matrix6& CoarseSpace::block(int a, int b) {
  const auto begin = neighbours_.begin() + first_neighbour_[at(a)];
  const auto end = neighbours_.begin() + first_neighbour_[at(a) + 1];
  return blocks_[static_cast<std::size_t>(std::lower_bound(begin, end, b) - neighbours_.begin())];
}

void CoarseSpace::update(const ElasticSheet& sheet, std::span<const Slot> particles,
                         std::span<const Vec3> held) {
  if (centres_.empty()) return;
  side_by_side(centres_.size(), [&](std::size_t h) {
    Vec3 sum = Vec3::Zero();
    for (int m = first_[h]; m < first_[h + 1]; ++m) sum += place(particles[at(members_[at(m)])]);
    centres_[h] = sum / (first_[h + 1] - first_[h]);
    for (int m = first_[h]; m < first_[h + 1]; ++m) {
      const std::size_t k = at(members_[at(m)]);
      arms_[k] = place(particles[k]) - centres_[h];
    }
  });
  for (Matrix6& b : blocks_) b.setZero();

  std::vector<double> own(particles.size(), 0.0);
  for_each_distance(sheet.layout, [&](int i, int j, double rest, double stiffness) {
    const Vec3 edge = place(particles[at(j)]) - place(particles[at(i)]);
    const double length = edge.norm();
    if (!(length > 0)) return;
    own[at(i)] += stiffness;
    own[at(j)] += stiffness;
    const int a = home_[at(i)], b = home_[at(j)];
    // A compressed spring takes stiffness away across itself: left out, the matrix stays positive.
    const double across = std::max(0.0, 1 - rest / length);
    const Eigen::Matrix3d along = edge * edge.transpose() / (length * length);
    const Eigen::Matrix3d spring =
        stiffness * (along + across * (Eigen::Matrix3d::Identity() - along));
    if (a == b) {
      if (a < 0 || across == 0) return;
      const Rigid apart = rigid(arms_[at(j)]) - rigid(arms_[at(i)]);
      block(a, a) += apart.transpose() * spring * apart;
      return;
    }
    if (a >= 0) block(a, a) += rigid(arms_[at(i)]).transpose() * spring * rigid(arms_[at(i)]);
    if (b >= 0) block(b, b) += rigid(arms_[at(j)]).transpose() * spring * rigid(arms_[at(j)]);
    if (a < 0 || b < 0) return;
    const auto [upper, lower] = a > b ? std::pair{i, j} : std::pair{j, i};
    block(std::max(a, b), std::min(a, b)) -=
        rigid(arms_[at(upper)]).transpose() * spring * rigid(arms_[at(lower)]);
  });
  for_each_bending(sheet.layout, [&](const std::array<int, 4>& v, double, double stiffness) {
    const auto home = [&](std::size_t k) { return home_[at(v[k])]; };
    if (home(0) == home(1) && home(1) == home(2) && home(2) == home(3)) return;
    std::array<Vec3, 4> gradient;
    hinge_angle(place(particles[at(v[0])]), place(particles[at(v[1])]), place(particles[at(v[2])]),
                place(particles[at(v[3])]), &gradient);
    std::array<Eigen::Matrix<double, 1, 3>, 4> rows;
    for (std::size_t k = 0; k < 4; ++k) rows[k] = std::sqrt(stiffness) * gradient[k].transpose();
    add_square(v, rows);
  });
  for_each_triangle(
      sheet.layout, [&](const std::array<int, 3>& v, const TriangleBatch& batch, std::size_t lane) {
        const auto x = [&](std::size_t k) { return place(particles[at(v[k])]); };
        const TriangleStiffness s = measure_stiffness(batch, lane, {x(0), x(1), x(2)});
        for (std::size_t k = 0; k < 3; ++k) own[at(v[k])] += s.strains[k].squaredNorm();
        std::array<Eigen::Matrix<double, 9, 3>, 3> rows;
        const double first = std::sqrt(std::max(0.0, s.stress[0]));
        const double second = std::sqrt(std::max(0.0, s.stress[1]));
        for (std::size_t k = 0; k < 3; ++k)
          rows[k] << s.strains[k], first * s.shares[0][k] * Eigen::Matrix3d::Identity(),
              second * s.shares[1][k] * Eigen::Matrix3d::Identity();
        add_square(v, rows);
      });
  for (std::size_t k = 0; k < particles.size(); ++k) {
    if (home_[k] < 0) continue;
    double support = 0;
    for (const Attachment& a : sheet.attachments.of(k)) support += 1 / a.compliance;
    if (support == 0 && held[k].isZero()) continue;
    const Eigen::Matrix3d stiffness =
        support * Eigen::Matrix3d::Identity() + kHeld * own[k] * held[k] * held[k].transpose();
    block(home_[k], home_[k]) += rigid(arms_[k]).transpose() * stiffness * rigid(arms_[k]);
  }

  std::vector<Eigen::Triplet<double>> entries;
  entries.reserve(36 * blocks_.size());
  for (int a = 0; a < neighbourhoods(); ++a)
    for (int n = first_neighbour_[at(a)]; n < first_neighbour_[at(a) + 1]; ++n) {
      const int b = neighbours_[at(n)];
      Matrix6 values = blocks_[at(n)];
      if (a == b) {
        const double shift = values.diagonal().head<3>().maxCoeff();
        const double turn = values.diagonal().tail<3>().maxCoeff();
        values.diagonal().head<3>().array() += kLeast * shift + 1e-300;
        values.diagonal().tail<3>().array() += kLeast * turn + 1e-300;
      }
      for (int r = 0; r < 6; ++r)
        for (int c = 0; c < 6; ++c)
          if (a != b || r >= c) entries.emplace_back(6 * a + r, 6 * b + c, values(r, c));
    }
  matrix_.setFromTriplets(entries.begin(), entries.end());
  if (!analysed_) factors_.analyzePattern(matrix_);
  analysed_ = true;
  factors_.factorize(matrix_);
}

void CoarseSpace::add_answer(std::span<const Vec3> forces, std::span<Vec3> moves) const {
  if (centres_.empty() || factors_.info() != Eigen::Success) return;
  Eigen::VectorXd gathered(6 * neighbourhoods());
  side_by_side(centres_.size(), [&](std::size_t h) {
    Vec3 force = Vec3::Zero(), torque = Vec3::Zero();
    for (int m = first_[h]; m < first_[h + 1]; ++m) {
      const std::size_t k = at(members_[at(m)]);
      force += forces[k];
      torque += arms_[k].cross(forces[k]);
    }
    gathered.segment<6>(6 * static_cast<Eigen::Index>(h)) << force, torque;
  });
  const Eigen::VectorXd motion = factors_.solve(gathered);
  for_each_particle(moves.size(), [&](std::size_t k, std::size_t) {
    if (home_[k] < 0) return;
    const Eigen::Index first = 6 * home_[k];
    moves[k] += motion.segment<3>(first) + Vec3(motion.segment<3>(first + 3)).cross(arms_[k]);
  });
}

}  // namespace vstent::xpbd
