// Static equilibrium of a sheet around a rigid body, to any tolerance.
#pragma once

#include <functional>
#include <memory>

#include "xpbd/friction.hpp"
#include "xpbd/self_collision.hpp"
#include "xpbd/solver.hpp"

namespace vstent::xpbd {

/// Where a place lies to the surface that the sheet rests on.
struct Gap {
  double distance = 0;         ///< mm, exact; negative inside
  Vec3 normal = Vec3::Zero();  ///< unit, outwards; zero: far outside, `distance` is a lower bound
};

/// Gaps of places. Distances must be exact: a place moved by -distance along the normal lies on the
/// surface.
using ContactField = std::function<void(std::span<const Vec3> places, std::span<Gap> gaps)>;

struct EquilibriumOptions {
  double largest_move = 0.5;  ///< mm that a particle may move in an iteration
  /// Iterations between looks at the stiffness that preconditions the search.
  int renewal = 40;
};

/// Minimises the sheet's elastic energy over all places outside a body: particles in contact slide
/// on its surface, without friction unless there is a law of it, and leave it when they are pulled.
/// Nonlinear conjugate gradients
/// on that surface (Polak & Ribiere, restarted), preconditioned on two levels: the 3x3 stiffness
/// around each particle, and rigid motions of neighbourhoods (CoarseSpace). The minimum is that of
/// the very energy that Solver projects; masses and time have no part in it. A sheet with a surface
/// does not pass through itself on the way. Results are bit-identical for any number of threads.
class Equilibrium {
 public:
  /// `start`: by vertex; particles inside the body are put on its surface. Pinned vertices stay.
  /// `anchors`, of friction: by vertex, where each is held by the body, put on its surface; empty:
  /// where it touches first.
  Equilibrium(const Sheet& sheet, std::span<const Vec3> start, ContactField field,
              FrictionLaw friction = {}, std::span<const Vec3> anchors = {});
  ~Equilibrium();
  Equilibrium(Equilibrium&&) noexcept;

  /// One iteration; the balance is that of the places it leads to.
  RelaxReport iterate(const EquilibriumOptions& options);

  std::span<const Vec3> positions() const;   ///< by vertex, mm
  ForceBalance balance() const;              ///< at the present places
  std::vector<Vec3> contact_forces() const;  ///< by vertex, N: what the body pushes it with
  /// By vertex: where friction holds it now, for the equilibrium that comes next; its own place
  /// where it does not touch.
  std::vector<Vec3> anchors() const;

  /// What keeps the sheet's surface from passing through itself, by vertex.
  std::vector<Push> pushes() const;
  /// Whether parts of the sheet lie near each other that are not beside each other on it.
  bool is_near_itself() const;
  /// Particles that the body should hold on its surface, and that the sheet itself keeps from it.
  int kept_inside() const;

 private:
  struct Implementation;
  std::unique_ptr<Implementation> implementation_;
};

}  // namespace vstent::xpbd
