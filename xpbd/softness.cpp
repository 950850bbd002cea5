#include "xpbd/softness.hpp"

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <array>
#include <cmath>
#include <numbers>

#include "xpbd/parallel.hpp"
#include "xpbd/triangle_stiffness.hpp"

namespace vstent::xpbd {
namespace {

// Share of the mean stiffness that every direction has at least: a flat, slack neighbourhood holds
// nothing across it and would be thrown out of its plane, and hinges beside slivers curve.
constexpr double kLeast = 0.1;

class Blocks {
 public:
  explicit Blocks(std::size_t particles) : blocks_(particles, Eigen::Matrix3d::Zero()) {}

  Eigen::Matrix3d& operator[](std::size_t k) { return blocks_[k]; }

  /// Bounds the term stiffness (sum_v gradient_v . u_v)^2 by one for each v: the square of the sum
  /// is at most the sum of squares over shares that add up to 1, here by |gradient_v|.
  template <std::size_t kVertices>
  void add(const std::array<int, kVertices>& vertices, const std::array<Vec3, kVertices>& gradient,
           double stiffness) {
    double total = 0;
    for (const Vec3& g : gradient) total += g.norm();
    for (std::size_t v = 0; v < kVertices; ++v)
      if (const double norm = gradient[v].norm(); norm > 0)
        blocks_[at(vertices[v])] +=
            stiffness * total / norm * gradient[v] * gradient[v].transpose();
  }

 private:
  std::vector<Eigen::Matrix3d> blocks_;
};

}  // namespace

std::vector<Softness> measure_softness(const Layout& layout, std::span<const Slot> particles,
                                       std::span<const double> own, std::span<const Link> links) {
  Blocks blocks(particles.size());
  const auto x = [&](int k) { return place(particles[at(k)]); };
  const auto add_distance = [&](const std::array<int, 2>& v, double rest, double stiffness) {
    const Vec3 edge = x(v[1]) - x(v[0]);
    const double length = edge.norm();
    if (!(length > 0)) return;
    const Vec3 along = edge / length;
    blocks.add<2>(v, {-along, along}, stiffness);
    // What a compressed spring takes away counts as if it were tension: it may come back.
    const double across = stiffness * std::abs(1 - rest / length);
    const Eigen::Matrix3d plane = Eigen::Matrix3d::Identity() - along * along.transpose();
    for (int end : v) blocks[at(end)] += 2 * across * plane;
  };
  const auto add_bending = [&](const std::array<int, 4>& v, double rest, double stiffness) {
    std::array<Vec3, 4> gradient;
    const double angle = hinge_angle(x(v[0]), x(v[1]), x(v[2]), x(v[3]), &gradient);
    blocks.add<4>(v, gradient, stiffness);
    // A turned hinge's moment changes direction as its triangles do: its second derivatives are
    // of the order of products of its gradients.
    double total = 0;
    for (const Vec3& g : gradient) total += g.norm();
    const double moment = stiffness * std::abs(std::remainder(angle - rest, 2 * std::numbers::pi));
    for (std::size_t k = 0; k < 4; ++k)
      blocks[at(v[k])].diagonal().array() += moment * total * gradient[k].norm();
  };
  const auto add_triangle = [&](const std::array<int, 3>& v, const TriangleBatch& batch,
                                std::size_t lane) {
    const TriangleStiffness s = measure_stiffness(batch, lane, {x(v[0]), x(v[1]), x(v[2])});
    for (int row = 0; row < 3; ++row)
      blocks.add<3>(v, {s.strains[0].row(row), s.strains[1].row(row), s.strains[2].row(row)}, 1);
    for (std::size_t m = 0; m < 2; ++m) {
      const auto& share = s.shares[m];
      const double total = std::abs(share[0]) + std::abs(share[1]) + std::abs(share[2]);
      for (std::size_t k = 0; k < 3; ++k)  // compressed: as springs
        blocks[at(v[k])].diagonal().array() += std::abs(s.stress[m]) * total * std::abs(share[k]);
    }
  };
  for (const auto* phase : {&layout.within, &layout.between})
    side_by_side(phase->size(), [&](std::size_t n) {
      const ConstBatches batches = batches_of(layout, (*phase)[n]);
      for_each_distance(batches, add_distance);
      for_each_bending(batches, add_bending);
      for_each_triangle(batches, add_triangle);
    });
  for (const Link& link : links) {
    std::array<Vec3, 4> gradient;
    for (std::size_t k = 0; k < 4; ++k) gradient[k] = link.weights[k] * link.normal;
    blocks.add<4>(link.particles, gradient, link.stiffness);
  }
  std::vector<Softness> softness(particles.size());
  for_each_particle(softness.size(), [&](std::size_t k, std::size_t) {
    Eigen::Matrix3d stiffness = blocks[k] + own[k] * Eigen::Matrix3d::Identity();
    if (!(stiffness.trace() > 0)) return;
    stiffness.diagonal().array() += kLeast / 3 * stiffness.trace();
    const Eigen::Matrix3d s = stiffness.inverse();
    softness[k] = {s(0, 0), s(1, 1), s(2, 2), s(0, 1), s(0, 2), s(1, 2)};
  });
  return softness;
}

}  // namespace vstent::xpbd
