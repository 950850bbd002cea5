// The slow obvious twin: Algorithm 1 in one thread, one constraint after another in the order they
// are listed.
#pragma once

#include <Eigen/Geometry>
#include <cmath>
#include <numbers>
#include <vector>

#include "xpbd/solver.hpp"

namespace vstent::tests {

class ReferenceSolver {
 public:
  explicit ReferenceSolver(const xpbd::Sheet& sheet, bool alternate = true)
      : sheet_(sheet),
        alternate_(alternate),
        velocity_(sheet.positions.size(), Vec3::Zero()),
        distance_force_(sheet.distances.size(), 0.0),
        bending_force_(sheet.bendings.size(), 0.0) {}

  const std::vector<Vec3>& positions() const { return sheet_.positions; }

  void step(std::span<const xpbd::Contact> contacts, const xpbd::StepOptions& options) {
    dt2_ = options.time_step * options.time_step;
    if (!options.keep_multipliers) {
      distance_force_.assign(distance_force_.size(), 0.0);
      bending_force_.assign(bending_force_.size(), 0.0);
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
    sheet_.positions = predicted;
    for (int k = 0; k < options.iterations; ++k) sweep(contacts);
    for (std::size_t i = 0; i < before.size(); ++i)
      velocity_[i] = (sheet_.positions[i] - before[i]) / options.time_step;
  }

 private:
  static std::size_t at(int i) { return static_cast<std::size_t>(i); }
  double w(std::size_t i) const { return dt2_ * sheet_.inverse_mass[i]; }
  Vec3& x(int i) { return sheet_.positions[at(i)]; }

  void sweep(std::span<const xpbd::Contact> contacts) {
    const std::size_t distances = sheet_.distances.size();
    const std::size_t all = distances + sheet_.bendings.size();
    for (std::size_t n = 0; n < all; ++n) {
      const std::size_t c = backward_ ? all - 1 - n : n;
      c < distances ? project_distance(c) : project_bending(c - distances);
    }
    for (std::size_t c = 0; c < contacts.size(); ++c) project_contact(c, contacts[c]);
    if (alternate_) backward_ = !backward_;
  }

  void project_distance(std::size_t c) {
    const auto& d = sheet_.distances[c];
    const Vec3 edge = x(d.j) - x(d.i);
    const double length = edge.norm(), compliance = 1 / d.stiffness;
    const double change = -(length - d.rest_length + compliance * distance_force_[c]) /
                          (compliance + w(at(d.i)) + w(at(d.j)));
    distance_force_[c] += change;
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
    const double compliance = 1 / b.stiffness;
    const double change = -(fold + compliance * bending_force_[c]) / (compliance + pull);
    bending_force_[c] += change;
    for (std::size_t k = 0; k < 4; ++k) x(v[k]) += w(at(v[k])) * change * g[k];
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
  bool alternate_, backward_ = false;
  double dt2_ = 1;
  std::vector<Vec3> velocity_;
  std::vector<double> distance_force_, bending_force_, contact_force_;
};

}  // namespace vstent::tests
