// The stent as the wall meets it while it grows and when it has its final size.
#pragma once

#include <limits>
#include <optional>

#include "deployment/stent_model.hpp"
#include "deployment/strut_contacts.hpp"
#include "sdf/level_set.hpp"
#include "xpbd/equilibrium.hpp"

namespace vstent::deployment {

/// Contacts of the points that may come within `reach` (mm) of the distance `contact_distance` from
/// the level set. \throws Error (numerical) for a point deeper inside than the level set's band
std::vector<xpbd::Contact> find_contacts(const sdf::LevelSet& stent,
                                         std::span<const Vec3> positions,
                                         std::span<const char> pinned, double contact_distance,
                                         double reach, double stiffness);

/// Its distance field at the present size, and the contacts found with it. Struts are carried
/// outwards on a balloon, which holds the wall between them as well: so the wall comes down on the
/// struts from outside and cannot slip past one.
class StentContact {
 public:
  explicit StentContact(const Setup& setup);

  /// The level set of the balloon, or of the smooth stent, at this state. A growing stent needs no
  /// finer field than its steps.
  void grow(StentState state, bool coarse_field);
  /// For `exact_surface` only, which needs no level set.
  void reshape(StentState state) { state_ = std::move(state); }
  /// Takes the balloon away: the wall settles on the struts, or on the sleeve of a graft.
  void deflate(StentState state);

  /// Finds the contacts of a wall's vertices with the balloon or the smooth stent.
  void find(std::span<const Vec3> positions, std::span<const char> pinned);
  /// Finds the contacts with the struts; the wall is the setup's.
  void find_on_struts(std::span<const Vec3> positions);

  /// The surface of the balloon or of a smooth stent by its exact distance: voxels of the contact
  /// distance round its edge only roughly, and a wall that slides on them without friction finds no
  /// rest. Its ends are rounded by `edge_radius` (mm), by the contact distance at least.
  xpbd::ContactField exact_surface(double edge_radius = 0) const;

  bool rigid() const { return stiffness_ == 0; }
  bool on_struts() const { return struts_.has_value(); }
  std::span<const xpbd::Contact> vertices() const { return contacts_; }
  std::span<const xpbd::SpanContact> spans() const {
    return struts_ ? struts_->contacts() : std::span<const xpbd::SpanContact>();
  }
  const StentState& state() const { return state_; }
  /// mm that the wall lies in struts, beyond what it is let.
  double deepest() const { return struts_ ? struts_->deepest() : 0; }
  /// mm: how far the wall may move on the contacts found: no further than to where it would come
  /// upon a strut that it did not see.
  double safe_move() const {
    return struts_ ? 0.5 * reach_ : std::numeric_limits<double>::infinity();
  }
  /// mm: how far the wall may move in an iteration without losing its contacts.
  double step_limit() const { return struts_ ? 0.5 * reach_ : 0.5 * contact_distance_; }

 private:
  const Setup& setup_;
  StentState state_;
  std::optional<sdf::LevelSet> field_;
  std::optional<StrutContacts> struts_;
  double contact_distance_ = 0, reach_ = 0, stiffness_ = 0, sink_ = 0;
  std::vector<xpbd::Contact> contacts_;
};

}  // namespace vstent::deployment
