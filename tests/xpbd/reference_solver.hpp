// The slow obvious twin: Algorithm 1 in one thread, one constraint after another in the order they
// are listed.
#pragma once

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <cmath>
#include <numbers>
#include <utility>
#include <vector>

#include "xpbd/membrane_law.hpp"
#include "xpbd/solver.hpp"

namespace vstent::tests {

/// A constraint's turn in a sweep, or that of two at once.
struct Turn {
  enum Kind { kDistance, kHingedEdge, kTriangle, kBending } kind;
  std::size_t constraint;
  std::size_t bending = 0;  ///< of a hinged edge
};

class ReferenceSolver {
 public:
  /// Without an order, distances come before triangles, and those before bendings.
  explicit ReferenceSolver(const xpbd::Sheet& sheet, bool alternate = true,
                           std::vector<Turn> order = {})
      : sheet_(sheet),
        order_(std::move(order)),
        alternate_(alternate),
        velocity_(sheet.positions.size(), Vec3::Zero()),
        distance_force_(sheet.distances.size(), 0),
        bending_force_(sheet.bendings.size(), 0),
        triangle_force_(sheet.triangles.size(), 0.0) {}

  const std::vector<Vec3>& positions() const { return sheet_.positions; }

  void step(std::span<const xpbd::Contact> contacts, const xpbd::StepOptions& options) {
    dt2_ = options.time_step * options.time_step;
    if (!options.keep_multipliers) {
      distance_force_.assign(distance_force_.size(), 0);
      bending_force_.assign(bending_force_.size(), 0);
      triangle_force_.assign(triangle_force_.size(), 0.0);
    }
    contact_force_.assign(contacts.size(), 0.0);
    const std::vector<Vec3> before = sheet_.positions;
    std::vector<Vec3> predicted = before;
    for (std::size_t i = 0; i < predicted.size(); ++i)
      if (w(i) > 0) {
        predicted[i] += options.time_step * (1 - options.damping) * velocity_[i];
        if (!sheet_.forces.empty()) predicted[i] += w(i) * sheet_.forces[i];
      }
    for (std::size_t c = 0; c < sheet_.distances.size(); ++c) {
      const auto& d = sheet_.distances[c];
      const Vec3 push = distance_force_[c] * (before[at(d.j)] - before[at(d.i)]).normalized();
      predicted[at(d.i)] -= w(at(d.i)) * push;
      predicted[at(d.j)] += w(at(d.j)) * push;
    }
    for (std::size_t c = 0; c < sheet_.bendings.size(); ++c) {
      const auto& b = sheet_.bendings[c];
      const std::array<int, 4> v{b.edge_a, b.edge_b, b.wing_a, b.wing_b};
      std::array<Vec3, 4> g;
      xpbd::hinge_angle(before[at(v[0])], before[at(v[1])], before[at(v[2])], before[at(v[3])], &g);
      for (std::size_t k = 0; k < 4; ++k)
        predicted[at(v[k])] += w(at(v[k])) * bending_force_[c] * g[k];
    }
    for (std::size_t c = 0; c < sheet_.triangles.size(); ++c) {
      const auto& t = sheet_.triangles[c];
      const Strain strain = strain_of(t, before);
      for (std::size_t k = 0; k < 3; ++k)
        predicted[at(t.vertices[k])] +=
            w(at(t.vertices[k])) * triangle_force_[c] * strain.gradient[k];
    }
    sheet_.positions = predicted;
    for (int k = 0; k < options.iterations; ++k) sweep(contacts);
    for (std::size_t i = 0; i < before.size(); ++i)
      velocity_[i] = (sheet_.positions[i] - before[i]) / options.time_step;
  }

  /// C of a triangle and its gradient by the corners; 0 at rest.
  struct Strain {
    double constraint = 0;  // sqrt(2 energy)
    std::array<Vec3, 3> gradient;
  };

  static Strain strain_of(const xpbd::TriangleConstraint& t, const std::vector<Vec3>& x) {
    const Vec3 a = x[at(t.vertices[1])] - x[at(t.vertices[0])];
    const Vec3 b = x[at(t.vertices[2])] - x[at(t.vertices[0])];
    Eigen::Matrix2d rest;
    rest << t.base, t.foot, 0, t.height;
    Eigen::Matrix<double, 3, 2> edges;
    edges << a, b;
    const Eigen::Matrix<double, 3, 2> f = edges * rest.inverse();
    const Eigen::Matrix2d c = f.transpose() * f, strain = c - Eigen::Matrix2d::Identity();
    const double nu = t.poisson_ratio;
    const auto law = xpbd::stretch_of_sheet<xpbd::OneTriangle>(strain.trace(), strain.determinant(),
                                                               2 * (1 + nu) / (3 * (1 - 2 * nu)));
    const double weight = 0.5 * t.base * t.height * t.stiffness / (2 * (1 + nu));
    Strain made;
    made.gradient.fill(Vec3::Zero());
    if (!(law.energy > 1e-26)) return made;
    made.constraint = std::sqrt(2 * weight * law.energy);
    Eigen::Matrix2d cofactor;
    cofactor << c(1, 1), -c(0, 1), -c(0, 1), c(0, 0);
    const Eigen::Matrix<double, 3, 2> by_edges =
        weight * law.inverse_square / made.constraint * f *
        (Eigen::Matrix2d::Identity() - law.pressure * cofactor) * rest.inverse().transpose();
    made.gradient[1] = by_edges.col(0);
    made.gradient[2] = by_edges.col(1);
    made.gradient[0] = -made.gradient[1] - made.gradient[2];
    return made;
  }

 private:
  static std::size_t at(int i) { return static_cast<std::size_t>(i); }
  double w(std::size_t i) const { return dt2_ * sheet_.inverse_mass[i]; }
  Vec3& x(int i) { return sheet_.positions[at(i)]; }

  void sweep(std::span<const xpbd::Contact> contacts) {
    const std::size_t distances = sheet_.distances.size();
    const std::size_t stretched = distances + sheet_.triangles.size();
    const std::size_t all = order_.empty() ? stretched + sheet_.bendings.size() : order_.size();
    for (std::size_t n = 0; n < all; ++n) {
      const std::size_t c = backward_ ? all - 1 - n : n;
      if (!order_.empty())
        take(order_[c]);
      else if (c < distances)
        project_distance(c);
      else if (c < stretched)
        project_triangle(c - distances);
      else
        project_bending(c - stretched);
    }
    for (std::size_t c = 0; c < contacts.size(); ++c) project_contact(c, contacts[c]);
    if (alternate_) backward_ = !backward_;
  }

  void take(const Turn& turn) {
    switch (turn.kind) {
      case Turn::kDistance:
        return project_distance(turn.constraint);
      case Turn::kTriangle:
        return project_triangle(turn.constraint);
      case Turn::kBending:
        return project_bending(turn.constraint);
      case Turn::kHingedEdge:
        const auto& d = sheet_.distances[turn.constraint];
        const std::array<Vec3, 2> before{x(d.i), x(d.j)};
        project_distance(turn.constraint);
        const std::array<Vec3, 2> after{x(d.i), x(d.j)};
        x(d.i) = before[0];
        x(d.j) = before[1];
        project_bending(turn.bending);
        x(d.i) += after[0] - before[0];
        x(d.j) += after[1] - before[1];
    }
  }

  /// As the solver keeps it.
  static double compliance_of(double stiffness) { return static_cast<float>(1 / stiffness); }

  /// What a kept force changes by when `change` is added.
  static double change_kept(float& force, double change) {
    const float before = std::exchange(force, static_cast<float>(force + change));
    return static_cast<double>(force) - static_cast<double>(before);
  }

  void project_distance(std::size_t c) {
    const auto& d = sheet_.distances[c];
    const Vec3 edge = x(d.j) - x(d.i);
    const double length = edge.norm(), compliance = compliance_of(d.stiffness);
    const double change = change_kept(distance_force_[c],
                                      -(length - d.rest_length + compliance * distance_force_[c]) /
                                          (compliance + w(at(d.i)) + w(at(d.j))));
    x(d.i) -= w(at(d.i)) * change / length * edge;
    x(d.j) += w(at(d.j)) * change / length * edge;
  }

  void project_bending(std::size_t c) {
    const auto& b = sheet_.bendings[c];
    const std::array<int, 4> v{b.edge_a, b.edge_b, b.wing_a, b.wing_b};
    std::array<Vec3, 4> g;
    const double angle = xpbd::hinge_angle(x(v[0]), x(v[1]), x(v[2]), x(v[3]), &g);
    const double fold = std::remainder(angle - b.rest_angle, 2 * std::numbers::pi);
    double pull = 0;
    for (std::size_t k = 0; k < 4; ++k) pull += w(at(v[k])) * g[k].squaredNorm();
    if (!(pull > 0)) return;
    const double compliance = compliance_of(b.stiffness);
    const double change = change_kept(
        bending_force_[c], -(fold + compliance * bending_force_[c]) / (compliance + pull));
    for (std::size_t k = 0; k < 4; ++k) x(v[k]) += w(at(v[k])) * change * g[k];
  }

  void project_triangle(std::size_t c) {
    const auto& t = sheet_.triangles[c];
    const Strain strain = strain_of(t, sheet_.positions);
    double pull = 0;
    for (std::size_t k = 0; k < 3; ++k)
      pull += w(at(t.vertices[k])) * strain.gradient[k].squaredNorm();
    const double change = -(strain.constraint + triangle_force_[c]) / (1 + pull);
    triangle_force_[c] += change;
    for (std::size_t k = 0; k < 3; ++k)
      x(t.vertices[k]) += w(at(t.vertices[k])) * change * strain.gradient[k];
  }

  void project_contact(std::size_t c, const xpbd::Contact& contact) {
    const double mobility = w(at(contact.vertex));
    if (!(mobility > 0)) return;
    const double compliance = contact.stiffness > 0 ? 1 / contact.stiffness : 0;
    const double gap = contact.normal.dot(x(contact.vertex)) - contact.offset;
    const double change = std::max(
        -contact_force_[c], -(gap + compliance * contact_force_[c]) / (compliance + mobility));
    contact_force_[c] += change;
    x(contact.vertex) += mobility * change * contact.normal;
  }

  xpbd::Sheet sheet_;
  std::vector<Turn> order_;
  bool alternate_, backward_ = false;
  double dt2_ = 1;
  std::vector<Vec3> velocity_;
  std::vector<float> distance_force_, bending_force_;
  std::vector<double> triangle_force_, contact_force_;
};

}  // namespace vstent::tests
