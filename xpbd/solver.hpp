// The time step of Algorithm 1: predict, project every constraint, update velocities; and the force balance it leaves.
#pragma once

#include <memory>

#include "xpbd/sheet.hpp"

namespace vstent::xpbd {

struct StepOptions {
  double time_step = 1.0;      ///< s; numerical only, like the masses: the settled shape does not depend on it
  int iterations = 10;         ///< sweeps over all constraints; consecutive sweeps run in opposite directions
  double velocity_limit = 0;   ///< mm per step that inertia may move a particle (the paper's xi d_c); 0: none
  double damping = 0;          ///< fraction of the velocity lost per step, before forces act
  bool keep_multipliers = true;  ///< start from the last step's multipliers: no iteration-count bias at rest
};

struct StepReport {
  double largest_move = 0;        ///< mm, any vertex, this step
  int clamped_vertices = 0;       ///< whose inertial move met velocity_limit
};

/// Static forces at the present positions: what the constraints' energies leave unbalanced.
struct ForceBalance {
  double residual_rms = 0;        ///< N, over free particles, after contact reactions
  double residual_max = 0;        ///< N
  int worst_vertex = -1;
  double contact_force_mean = 0;  ///< N, over particles in contact
  double contact_force_sum = 0;   ///< N
  int in_contact = 0;
  double energy = 0;              ///< N mm, of distances, bendings and attachments
  /// residual_rms / contact_force_mean; without contact residual_rms over the rms force a constraint carries, 0 at rest.
  double relative = 0;
};

/// Holds a sheet in motion. Results are bit-identical for any number of threads.
class Solver {
 public:
  explicit Solver(const Sheet& sheet);
  ~Solver();
  Solver(Solver&&) noexcept;

  /// One time step under these contacts; multipliers of contacts are matched by vertex between steps.
  StepReport step(std::span<const Contact> contacts, const StepOptions& options);

  std::span<const Vec3> positions() const;
  std::span<const Vec3> velocities() const;
  void set_velocities(std::span<const Vec3> velocities);
  void set_positions(std::span<const Vec3> positions);  ///< velocities and multipliers become zero

  /// A contact is closed where its gap is below `contact_tolerance` (mm).
  ForceBalance balance(std::span<const Contact> contacts, double contact_tolerance) const;

 private:
  struct Implementation;
  std::unique_ptr<Implementation> implementation_;
};

/// Sets masses so that k dt^2/m, summed over what pulls at each particle, is `kappa`: mass is numerical here, and this
/// choice makes every particle, in a coarse or a fine corner of the mesh, equally far from the stability of a sweep.
void scale_masses(Sheet& sheet, double time_step, double kappa);

}  // namespace vstent::xpbd
