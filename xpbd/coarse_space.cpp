#include "xpbd/coarse_space.hpp"

#include <algorithm>
#include <cmath>

#include "xpbd/neighbourhoods.hpp"
#include "xpbd/parallel.hpp"
#include "xpbd/triangle_stiffness.hpp"

namespace vstent::xpbd {
namespace {

// Particles in a neighbourhood: fewer make the coarse system slow, more leave too much to single
// particles. Measured on a coarctation of 14k particles, iterations to 2e-4: 227 with 80, 162 with
// 40, 132 with 20.
constexpr double kMembers = 20;
// Beyond so many neighbourhoods factors cost more than the iterations that they save.
constexpr int kMostFactorised = 1500;
// Of a held particle's stiffness along its normal, over that of a spring.
constexpr double kHeld = 100;
// Share of a neighbourhood's own stiffness that keeps the factorisation from failing where nothing
// holds it.
constexpr double kLeast = 1e-8;
// Parts in which the sheet's stiffness is added up, side by side; fixed, so that sums are the same
// for any number of threads.
constexpr std::size_t kShares = 4;

}  // namespace

CoarseSpace::CoarseSpace(const ElasticSheet& sheet, std::span<const Slot> particles)
    : solver_(kMostFactorised) {
  std::vector<GraphEdge> edges;
  const ConstBatches all = all_of(sheet.layout);
  for_each_distance(all, [&](const std::array<int, 2>& v, double length, double) {
    edges.push_back({v[0], v[1], length});
  });
  for_each_triangle(all, [&](const std::array<int, 3>& v, const TriangleBatch&, std::size_t) {
    for (std::size_t k = 0; k < 3; ++k) {  // most edges twice: no matter
      const int i = v[k], j = v[(k + 1) % 3];
      edges.push_back({i, j, (place(particles[at(i)]) - place(particles[at(j)])).norm()});
    }
  });
  const Graph graph = make_graph(particles.size(), edges);
  std::vector<int> free;
  for (std::size_t k = 0; k < sheet.free.size(); ++k)
    if (sheet.free[k]) free.push_back(static_cast<int>(k));
  // A neighbourhood of this spacing owns about as much as so many particles of an even mesh.
  home_ = find_neighbourhoods(graph, free, std::sqrt(kMembers) * graph.mean_length).home;
  const int homes = home_.empty() ? 0 : 1 + *std::max_element(home_.begin(), home_.end());
  first_.assign(at(homes) + 1, 0);
  for (const int h : home_)
    if (h >= 0) ++first_[at(h) + 1];
  for (std::size_t h = 1; h < first_.size(); ++h) first_[h] += first_[h - 1];
  members_.resize(at(first_.back()));
  std::vector<int> next(first_.begin(), first_.end() - 1);
  for (std::size_t k = 0; k < home_.size(); ++k)
    if (home_[k] >= 0) members_[at(next[at(home_[k])]++)] = static_cast<int>(k);
  stiffness_.centres.resize(at(homes));
  arms_.assign(particles.size(), Vec3::Zero());

  std::vector<std::vector<int>> lower(at(homes));  // neighbours of each
  const auto join = [&](int i, int j) {
    const auto [b, a] = std::minmax(home_[at(i)], home_[at(j)]);
    if (b < 0 || a == b) return;
    std::vector<int>& known = lower[at(a)];
    if (std::find(known.begin(), known.end(), b) == known.end()) known.push_back(b);
  };
  for_each_distance(all, [&](const std::array<int, 2>& v, double, double) { join(v[0], v[1]); });
  for_each_bending(all, [&](const std::array<int, 4>& v, double, double) {
    for (std::size_t k = 0; k < 4; ++k)
      for (std::size_t l = 0; l < k; ++l) join(v[k], v[l]);
  });
  for_each_triangle(all, [&](const std::array<int, 3>& v, const TriangleBatch&, std::size_t) {
    for (std::size_t k = 0; k < 3; ++k) join(v[k], v[(k + 1) % 3]);
  });
  std::vector<std::pair<int, int>> beside;
  for (int a = 0; a < homes; ++a) {
    beside.emplace_back(a, a);
    for (int b : lower[at(a)]) beside.emplace_back(a, b);
  }
  stiffness_.set_neighbours(std::move(beside));
}

/// Rows that the motions of neighbourhoods are multiplied by.
template <int kRows, std::size_t kMost>
class CoarseSpace::Rows {
 public:
  /// Adds `matrix` times the motion of particle k.
  void add(const CoarseSpace& space, int k, const Eigen::Matrix<double, kRows, 3>& matrix) {
    const int home = space.home_[at(k)];
    if (home < 0) return;
    std::size_t n = 0;
    while (n < count_ && homes_[n] != home) ++n;
    if (n == count_) {
      homes_[count_] = home;
      rows_[count_++].setZero();
    }
    rows_[n].template leftCols<3>() += matrix;
    const Vec3& arm = space.arms_[at(k)];
    for (int r = 0; r < kRows; ++r)
      rows_[n].row(r).template tail<3>() += arm.cross(Vec3(matrix.row(r))).transpose();
  }

  /// Adds the square of what they come to.
  void add_square(const CoarseSpace& space, Share& share) const {
    for (std::size_t k = 0; k < count_; ++k)
      for (std::size_t l = 0; l < count_; ++l)
        if (homes_[k] >= homes_[l])
          share.blocks[space.stiffness_.block_number(homes_[k], homes_[l])] +=
              rows_[k].transpose().lazyProduct(rows_[l]);
  }

 private:
  std::array<int, kMost> homes_{};
  std::array<Eigen::Matrix<double, kRows, 6>, kMost> rows_;
  std::size_t count_ = 0;
};

template <std::size_t kCount>
bool CoarseSpace::move_as_one(const std::array<int, kCount>& particles) const {
  return std::all_of(particles.begin(), particles.end(),
                     [&](int k) { return home_[at(k)] == home_[at(particles[0])]; });
}

void CoarseSpace::add(const ConstBatches& batches, std::span<const Slot> particles,
                      Share& share) const {
  for_each_distance(batches, [&](const std::array<int, 2>& v, double rest, double stiffness) {
    const Vec3 edge = place(particles[at(v[1])]) - place(particles[at(v[0])]);
    const double length = edge.norm();
    if (!(length > 0)) return;
    for (int end : v) share.own[at(end)] += stiffness;
    // A compressed spring takes stiffness away across itself: left out, the matrix stays positive.
    const double across = std::max(0.0, 1 - rest / length);
    if (across == 0 && move_as_one(v)) return;
    const Eigen::Matrix3d along = edge * edge.transpose() / (length * length);
    const Eigen::Matrix3d root =
        std::sqrt(stiffness) * (along + std::sqrt(across) * (Eigen::Matrix3d::Identity() - along));
    Rows<3, 2> rows;
    rows.add(*this, v[0], -root);
    rows.add(*this, v[1], root);
    rows.add_square(*this, share);
  });
  for_each_bending(batches, [&](const std::array<int, 4>& v, double, double stiffness) {
    if (move_as_one(v)) return;
    const auto x = [&](std::size_t k) { return place(particles[at(v[k])]); };
    std::array<Vec3, 4> gradient;
    hinge_angle(x(0), x(1), x(2), x(3), &gradient);
    Rows<1, 4> rows;
    for (std::size_t k = 0; k < 4; ++k)
      rows.add(*this, v[k], std::sqrt(stiffness) * gradient[k].transpose());
    rows.add_square(*this, share);
  });
  for_each_triangle(
      batches, [&](const std::array<int, 3>& v, const TriangleBatch& batch, std::size_t lane) {
        const auto x = [&](std::size_t k) { return place(particles[at(v[k])]); };
        const TriangleStiffness s = measure_stiffness(batch, lane, {x(0), x(1), x(2)});
        for (std::size_t k = 0; k < 3; ++k) share.own[at(v[k])] += s.strains[k].squaredNorm();
        if (!move_as_one(v)) {
          Rows<3, 3> strain;
          for (std::size_t k = 0; k < 3; ++k) strain.add(*this, v[k], s.strains[k]);
          strain.add_square(*this, share);
        }
        for (std::size_t m = 0; m < 2; ++m) {
          if (!(s.stress[m] > 0)) continue;
          Rows<3, 3> turn;
          for (std::size_t k = 0; k < 3; ++k)
            turn.add(*this, v[k],
                     std::sqrt(s.stress[m]) * s.shares[m][k] * Eigen::Matrix3d::Identity());
          turn.add_square(*this, share);
        }
      });
}

/// Neighbourhoods that links join become neighbours.
void CoarseSpace::make_room(std::span<const Link> links) {
  std::vector<std::pair<int, int>> missing;
  for (const Link& link : links)
    for (std::size_t k = 0; k < 4; ++k)
      for (std::size_t l = 0; l < 4; ++l) {
        const int a = home_[at(link.particles[k])], b = home_[at(link.particles[l])];
        if (b < 0 || a <= b) continue;
        if (!stiffness_.are_neighbours(a, b)) missing.emplace_back(a, b);
      }
  if (missing.empty()) return;
  for (int a = 0; a < neighbourhoods(); ++a)
    for (int n = stiffness_.first[at(a)]; n < stiffness_.first[at(a) + 1]; ++n)
      missing.emplace_back(a, stiffness_.neighbours[at(n)]);
  stiffness_.set_neighbours(std::move(missing));
  analysed_ = false;
}

void CoarseSpace::add(std::span<const Link> links) {
  using Vector6 = Eigen::Matrix<double, 6, 1>;
  for (const Link& link : links) {
    std::array<Vector6, 4> turning;
    std::array<int, 4> homes;
    for (std::size_t k = 0; k < 4; ++k) {
      homes[k] = home_[at(link.particles[k])];
      turning[k] =
          motion_on(arms_[at(link.particles[k])]).transpose() * link.weights[k] * link.normal;
    }
    for (std::size_t k = 0; k < 4; ++k)
      for (std::size_t l = 0; l < 4; ++l)
        if (homes[l] >= 0 && homes[k] >= homes[l])
          stiffness_.block(homes[k], homes[l]) +=
              link.stiffness * turning[k] * turning[l].transpose();
  }
}

void CoarseSpace::update(const ElasticSheet& sheet, std::span<const Slot> particles,
                         std::span<const Vec3> held, std::span<const Link> links) {
  if (stiffness_.centres.empty()) return;
  make_room(links);
  side_by_side(stiffness_.centres.size(), [&](std::size_t h) {
    Vec3 sum = Vec3::Zero();
    for (int m = first_[h]; m < first_[h + 1]; ++m) sum += place(particles[at(members_[at(m)])]);
    stiffness_.centres[h] = sum / (first_[h + 1] - first_[h]);
    for (int m = first_[h]; m < first_[h + 1]; ++m) {
      const std::size_t k = at(members_[at(m)]);
      arms_[k] = place(particles[k]) - stiffness_.centres[h];
    }
  });
  std::array<Share, kShares> shares;
  side_by_side(kShares, [&](std::size_t n) {
    Share& share = shares[n];
    share.blocks.assign(stiffness_.blocks.size(), Matrix6::Zero());
    share.own.assign(particles.size(), 0.0);
    add(share_of(sheet.layout, n, kShares), particles, share);
  });
  for_each_particle(stiffness_.blocks.size(), [&](std::size_t n, std::size_t) {
    stiffness_.blocks[n] = shares[0].blocks[n];
    for (std::size_t k = 1; k < kShares; ++k) stiffness_.blocks[n] += shares[k].blocks[n];
  });
  const auto own = [&](std::size_t k) {
    double sum = 0;
    for (const Share& share : shares) sum += share.own[k];
    return sum;
  };

  side_by_side(stiffness_.centres.size(), [&](std::size_t h) {
    Matrix6& of_home = stiffness_.blocks[at(stiffness_.first[h + 1] - 1)];
    for (int m = first_[h]; m < first_[h + 1]; ++m) {
      const std::size_t k = at(members_[at(m)]);
      double support = 0;
      for (const Attachment& a : sheet.attachments.of(k)) support += 1 / a.compliance;
      if (support == 0 && held[k].isZero()) continue;
      const Eigen::Matrix3d stiffness =
          support * Eigen::Matrix3d::Identity() + kHeld * own(k) * held[k] * held[k].transpose();
      of_home += motion_on(arms_[k]).transpose() * stiffness * motion_on(arms_[k]);
    }
  });

  add(links);

  for (int a = 0; a < neighbourhoods(); ++a) {
    Matrix6& values = stiffness_.block(a, a);
    const double shift = values.diagonal().head<3>().maxCoeff();
    const double turn = values.diagonal().tail<3>().maxCoeff();
    values.diagonal().head<3>().array() += kLeast * shift + 1e-300;
    values.diagonal().tail<3>().array() += kLeast * turn + 1e-300;
  }
  if (!analysed_) solver_.analyse(stiffness_);
  analysed_ = true;
  succeeded_ = solver_.factorise(stiffness_);
}

Eigen::VectorXd CoarseSpace::answer(std::span<const Vec3> forces) const {
  if (!succeeded_) return Eigen::VectorXd::Zero(6 * neighbourhoods());
  Eigen::VectorXd gathered(6 * neighbourhoods());
  side_by_side(stiffness_.centres.size(), [&](std::size_t h) {
    Vec3 force = Vec3::Zero(), torque = Vec3::Zero();
    for (int m = first_[h]; m < first_[h + 1]; ++m) {
      const std::size_t k = at(members_[at(m)]);
      force += forces[k];
      torque += arms_[k].cross(forces[k]);
    }
    gathered.segment<6>(6 * static_cast<Eigen::Index>(h)) << force, torque;
  });
  return solver_.solve(stiffness_, gathered);
}

}  // namespace vstent::xpbd
