// Coulomb friction between a sheet and the body that it rests on.
#pragma once

#include <span>
#include <vector>

#include "xpbd/elastic_sheet.hpp"
#include "xpbd/link.hpp"

namespace vstent::xpbd {

/// A place in contact is held by up to `coefficient` times what it is pressed with. Short of that
/// it gives way by as much of `slip` (mm) as is asked of the hold: a small length that stands for
/// sticking.
struct FrictionLaw {
  double coefficient = 0;
  double slip = 0;
};

/// Every particle in contact has an anchor on the body, where it first touched or where it slid to;
/// it is pulled back along the way it has moved from there. The limit of the pull is that of the
/// pressure at the last renewal: between two of them friction has an energy (the lagged friction of
/// Li et al. 2020, "Incremental potential contact").
class Friction {
 public:
  Friction(FrictionLaw law, std::size_t particles);

  bool anchored(std::size_t k) const { return anchored_[k]; }
  void anchor(std::size_t k, const Vec3& place);
  void let_go(std::size_t k) { anchored_[k] = 0; }
  /// Anchors follow what slid further than `slip`; by particle, the particle's own place without
  /// one.
  std::vector<Vec3> dragged(std::span<const Slot> particles) const;

  /// Takes the pushes of the body (N, by particle; 0 where it does not touch).
  void renew(std::span<const double> pushes);
  /// Adds the forces on particles that touch, and gives their energy.
  double add_forces(std::span<const Slot> particles, std::span<const char> touching,
                    std::vector<Slot>& forces) const;
  /// What the force on particle k would be more, were its limit that of this push.
  Vec3 missing(std::size_t k, const Vec3& place, double push) const;
  void add_links(std::span<const Slot> particles, std::vector<Link>& links) const;

 private:
  /// Of the limit, along the way back.
  Vec3 share(std::size_t k, const Vec3& place) const;

  FrictionLaw law_;
  std::vector<Vec3> anchors_;
  std::vector<char> anchored_;
  std::vector<double> limits_;  // N
};

}  // namespace vstent::xpbd
