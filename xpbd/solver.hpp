// The time step of Algorithm 1: predict, project every constraint, update velocities; and the force
// balance it leaves.
#pragma once

#include <memory>

#include "xpbd/self_collision.hpp"
#include "xpbd/sheet.hpp"

namespace vstent::xpbd {

enum class Precision { kDouble, kSingle };

struct StepOptions {
  /// s; numerical only, like the masses: the settled shape does not depend on it.
  double time_step = 1.0;
  /// Sweeps over all constraints; consecutive sweeps run in opposite directions.
  int iterations = 10;
  /// mm per step that inertia (the paper's xi d_c), or forces kept from the step before, may move a
  /// particle; 0: no limit.
  double velocity_limit = 0;
  /// Fraction of the velocity lost per step, before forces act.
  double damping = 0;
  /// In place of `damping`: velocity lost is 3 / (n + 3) in the n-th step since rest, and rest
  /// comes whenever forces turn against the motion. Settles in the square root of the steps that
  /// fixed damping takes, with nothing to tune.
  bool adaptive_damping = false;
  /// Start from the last step's multipliers: no iteration-count bias at rest.
  bool keep_multipliers = true;
  /// Of the sweeps: single takes about six tenths of the time and moves a particle by about 1e-7
  /// of its distance from the sheet's middle. Elastic triangles are swept in double only: \throws
  /// std::invalid_argument for a sheet that has some.
  Precision precision = Precision::kDouble;
};

struct StepReport {
  double largest_move = 0;   ///< mm, any vertex, this step
  int clamped_vertices = 0;  ///< whose inertial move met velocity_limit
  /// Vertices that stopped short of what they might meet: another step takes them further.
  int kept_apart = 0;
};

/// Static forces at the present positions: what the constraints' energies leave unbalanced.
struct ForceBalance {
  double residual_rms = 0;  ///< N, over free particles, after contact reactions
  double residual_max = 0;  ///< N
  int worst_vertex = -1;
  double contact_force_mean = 0;  ///< N, over particles in contact
  double contact_force_sum = 0;   ///< N
  int in_contact = 0;
  double energy = 0;  ///< N mm, of distances, bendings and attachments
  /// residual_rms / contact_force_mean; without contact residual_rms over the rms force a
  /// constraint carries, 0 at rest.
  double relative = 0;
};

struct RelaxOptions {
  /// Over the inverse of blocks that bound the stiffness matrix; beyond 4/3 it may not settle.
  double step = 1.3;
  /// mm that a particle may move in an iteration, before contacts; 0: no limit.
  double largest_move = 0.1;
  /// mm, for the balance in the report.
  double contact_tolerance = 1e-3;
};

struct RelaxReport {
  double largest_move = 0;  ///< mm
  ForceBalance balance;     ///< of the places where the iteration took its forces
};

/// Holds a sheet in motion; one with a surface does not pass through itself. Results are
/// bit-identical for any number of threads.
class Solver {
 public:
  explicit Solver(const Sheet& sheet);
  ~Solver();
  Solver(Solver&&) noexcept;

  /// One time step under these contacts; multipliers of contacts are matched by vertex, of spans by
  /// key, with those of the step before.
  StepReport step(std::span<const Contact> contacts, const StepOptions& options,
                  std::span<const SpanContact> spans = {});

  /// One iteration towards static balance: no masses, time or multipliers, but the forces
  /// themselves, preconditioned by the 3x3 stiffness around each particle, with momentum as under
  /// `adaptive_damping`; contacts by projection. Costs about a sweep and comes with the balance.
  /// Starts from rest where `step` was called before, and the other way round.
  RelaxReport relax(std::span<const Contact> contacts, const RelaxOptions& options,
                    std::span<const SpanContact> spans = {});

  std::span<const Vec3> positions() const;  ///< by vertex, mm; changes with the next call
  std::vector<Vec3> velocities() const;     ///< by vertex, mm/s
  void set_velocities(std::span<const Vec3> velocities);
  void set_positions(std::span<const Vec3> positions);  ///< velocities and multipliers become zero

  /// A contact is closed where its gap is below `contact_tolerance` (mm); span contacts push as
  /// they did at the end of the last step or iteration.
  ForceBalance balance(std::span<const Contact> contacts, double contact_tolerance) const;

  /// What keeps the sheet's surface from passing through itself, by vertex.
  std::vector<Push> pushes() const;

 private:
  struct Implementation;
  std::unique_ptr<Implementation> implementation_;
};

/// Sets masses so that k dt^2/m, summed over what pulls at each particle, is `kappa`: mass is
/// numerical here, and this choice makes every particle, in a coarse or a fine corner of the mesh,
/// equally far from the stability of a sweep. With kept multipliers take kappa <= 0.6 for one sweep
/// a step, <= 1 for two.
void scale_masses(Sheet& sheet, double time_step, double kappa);

}  // namespace vstent::xpbd
