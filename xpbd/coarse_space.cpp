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

}  // namespace

CoarseSpace::CoarseSpace(const ElasticSheet& sheet, std::span<const Slot> particles)
    : solver_(kMostFactorised) {
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

  std::vector<std::pair<int, int>> beside;
  const auto join = [&](int i, int j) {
    const int a = home_[at(i)], b = home_[at(j)];
    if (a >= 0 && b >= 0 && a != b) beside.emplace_back(std::max(a, b), std::min(a, b));
  };
  for (int h = 0; h < homes; ++h) beside.emplace_back(h, h);
  for_each_distance(sheet.layout, [&](int i, int j, double, double) { join(i, j); });
  for_each_bending(sheet.layout, [&](const std::array<int, 4>& v, double, double) {
    for (std::size_t k = 0; k < 4; ++k)
      for (std::size_t l = 0; l < k; ++l) join(v[k], v[l]);
  });
  for_each_triangle(sheet.layout,
                    [&](const std::array<int, 3>& v, const TriangleBatch&, std::size_t) {
                      for (std::size_t k = 0; k < 3; ++k) join(v[k], v[(k + 1) % 3]);
                    });
  stiffness_.set_neighbours(std::move(beside));
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
    turning[slot] += matrices[k] * motion_on(arms_[at(vertices[k])]);
  }
  for (std::size_t k = 0; k < different; ++k)
    for (std::size_t l = 0; l < different; ++l)
      if (homes[k] >= homes[l])
        stiffness_.block(homes[k], homes[l]) += turning[k].transpose().lazyProduct(turning[l]);
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
  for (Matrix6& b : stiffness_.blocks) b.setZero();

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
      const Matrix36 apart = motion_on(arms_[at(j)]) - motion_on(arms_[at(i)]);
      stiffness_.block(a, a) += apart.transpose() * spring * apart;
      return;
    }
    if (a >= 0)
      stiffness_.block(a, a) +=
          motion_on(arms_[at(i)]).transpose() * spring * motion_on(arms_[at(i)]);
    if (b >= 0)
      stiffness_.block(b, b) +=
          motion_on(arms_[at(j)]).transpose() * spring * motion_on(arms_[at(j)]);
    if (a < 0 || b < 0) return;
    const auto [upper, lower] = a > b ? std::pair{i, j} : std::pair{j, i};
    stiffness_.block(std::max(a, b), std::min(a, b)) -=
        motion_on(arms_[at(upper)]).transpose() * spring * motion_on(arms_[at(lower)]);
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
    stiffness_.block(home_[k], home_[k]) +=
        motion_on(arms_[k]).transpose() * stiffness * motion_on(arms_[k]);
  }

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

void CoarseSpace::add_answer(std::span<const Vec3> forces, std::span<Vec3> moves) const {
  if (stiffness_.centres.empty() || !succeeded_) return;
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
  const Eigen::VectorXd motion = solver_.solve(stiffness_, gathered);
  for_each_particle(moves.size(), [&](std::size_t k, std::size_t) {
    if (home_[k] < 0) return;
    const Eigen::Index first = 6 * home_[k];
    moves[k] += motion.segment<3>(first) + Vec3(motion.segment<3>(first + 3)).cross(arms_[k]);
  });
}

}  // namespace vstent::xpbd
