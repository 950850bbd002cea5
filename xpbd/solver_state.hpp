// A sheet in motion, for its two ways of moving: by time steps and by relaxation.
#pragma once

#include <optional>

#include "xpbd/closable_spans.hpp"
#include "xpbd/elastic_sheet.hpp"
#include "xpbd/softness.hpp"
#include "xpbd/solver.hpp"

namespace vstent::xpbd {

/// A Contact of a particle, and what it pushes with.
struct ClosableContact {
  Vec3 normal;
  double offset;  // from the solver's own origin
  double compliance;
  double force;  // N, never negative
};

/// What steps in single precision run over.
struct Single {
  std::vector<SlotOf<float>> particles, forces;
};

/// Of the particles of a chunk.
struct Motion {
  double largest_move = 0;
  double power = 0;
  int kept_apart = 0;
};

/// Members by particle, in the layout's order, where nothing else is said.
struct SolverState {
  ElasticSheet elastic;
  Layout& layout = elastic.layout;
  const Vec3& origin = elastic.origin;
  Grouped<Attachment>& attachments = elastic.attachments;
  const Kernels& kernel = kernels();
  std::vector<Slot> particles;  // about `origin`; mobility as of `time_step`
  double time_step = 1;
  std::vector<Vec3> velocities;  // during a step or an iteration: what they move by, mm
  std::vector<Slot> forces;      // in a step of doubles then the places before it
  std::optional<Single> single;
  Grouped<ClosableContact> contacts;
  std::vector<ClosableSpan> spans;
  std::optional<SelfCollision> collision;
  mutable std::vector<Vec3> positions;  // in the sheet's order, when asked
  bool backward = false;
  double steps_since_rest = 0;
  double last_energy = 0;
  bool relaxing = false;
  std::vector<Softness> softness;  // the relaxation's step per force
  int iterations_since_weighing = 0;

  explicit SolverState(const Sheet& sheet);

  std::size_t chunks() const { return chunks_of(particles.size()); }
  /// Where much of the room between walls is used up, looks again for what is near.
  void look_around();
  Grouped<ClosableContact> grouped(std::span<const Contact> contacts) const;
  /// Forces of spans that were there before stay.
  void take_spans(std::span<const SpanContact> from);
  void forget_multipliers();
  void rest();
};

/// One time step.
StepReport step(SolverState& state, std::span<const Contact> contacts, const StepOptions& options,
                std::span<const SpanContact> spans);

}  // namespace vstent::xpbd
