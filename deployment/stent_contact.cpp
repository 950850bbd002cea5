#include "deployment/stent_contact.hpp"

#include <algorithm>
#include <cmath>

#include "sdf/exact_field.hpp"
#include "stents/cover.hpp"
#include "vessels/error.hpp"
#include "vessels/text.hpp"

namespace vstent::deployment {
namespace {

// Of a strut's thickness: the most that it lifts the wall between two searches for contacts.
constexpr double kGentle = 0.05;
// Of a voxel: what edges and triangles are let into struts. With what the field itself is wrong by,
// no place is then half a voxel deep.
constexpr double kSink = 0.25;

/// Of the balloon's level set, mm.
double balloon_voxel_size(const Setup& setup) {
  const Case& c = setup.specification;
  return setup.has_struts() ? std::min(setup.stent.diameter / 50, *c.contact_distance)
                            : *c.voxel_size;
}

/// Twice as many values on the same curve: between four evenly spaced values of a smooth function
/// lies (9 (b + c) - (a + d)) / 16, to fourth order (Dyn, Gregory & Levin 1987).
template <class Value>
std::vector<Value> subdivided(const std::vector<Value>& coarse) {
  const std::size_t last = coarse.size() - 1;
  const auto beyond = [&](std::size_t end, std::size_t next) {
    return Value(2 * coarse[end] - coarse[next]);
  };
  std::vector<Value> finer{coarse.front()};
  for (std::size_t i = 0; i < last; ++i) {
    const Value before = i > 0 ? coarse[i - 1] : beyond(0, 1);
    const Value after = i + 1 < last ? coarse[i + 2] : beyond(last, last - 1);
    finer.push_back((9 * (coarse[i] + coarse[i + 1]) - (before + after)) / 16);
    finer.push_back(coarse[i + 1]);
  }
  return finer;
}

}  // namespace

std::vector<xpbd::Contact> find_contacts(const sdf::LevelSet& stent,
                                         std::span<const Vec3> positions,
                                         std::span<const char> pinned, double contact_distance,
                                         double reach, double stiffness) {
  std::vector<sdf::Sample> samples(positions.size());
  stent.sample(positions, samples);
  std::vector<xpbd::Contact> contacts;
  for (std::size_t i = 0; i < positions.size(); ++i) {
    if (pinned[i] || samples[i].distance >= contact_distance + reach) continue;
    if (samples[i].gradient.isZero()) {
      if (samples[i].distance > 0) continue;
      throw Error(ExitCode::numerical,
                  "a wall vertex at " + vessels::place(positions[i]) +
                      " mm lies deeper inside the stent than its level set reaches; "
                      "try a smaller growth_per_step or a stiffer contact");
    }
    xpbd::Contact contact;
    contact.vertex = static_cast<int>(i);
    contact.normal = samples[i].gradient;
    contact.offset = contact.normal.dot(positions[i]) + contact_distance - samples[i].distance;
    contact.stiffness = stiffness;
    contacts.push_back(contact);
  }
  return contacts;
}

StentContact::StentContact(const Setup& setup) : setup_(setup) {
  const Case& c = setup.specification;
  contact_distance_ = *c.contact_distance;
  reach_ = 3 * *c.growth_per_step;
  if (setup.has_struts()) return;
  stiffness_ = c.contact_stiffness.value_or(0);
  // Under soft contact the wall rests inside the stent, the deeper the softer it is.
  if (stiffness_ > 0) sink_ = 0.25 * setup.stent.diameter / 2;
}

void StentContact::grow(StentState state, bool coarse_field) {
  const double voxel_size = (coarse_field ? 2 : 1) * balloon_voxel_size(setup_);
  // Nodal gradients see 2.45 voxels around a point; the wall may enter by the growth of a step
  // and leave by the reach.
  const double half_width = (contact_distance_ + 2 * reach_ + sink_) / voxel_size + 3.5;
  field_ = sdf::voxelise(envelope_of(setup_, state, contact_distance_), {voxel_size, half_width});
  state_ = std::move(state);
}

void StentContact::deflate(StentState state) {
  const Case& c = setup_.specification;
  const stents::Cover& cover = setup_.design_specification.cover;
  if (stents::covered(cover)) {
    for (double& r : state.radii) r += cover.outer;
    return grow(std::move(state), false);
  }
  reach_ = setup_.strut.half();
  state_ = std::move(state);
  contacts_.clear();
  const double half_width = (2 * reach_ + *c.patch_edge_length) / *c.voxel_size + 2.5;
  field_ = voxelised(shape_of(setup_, state_), {*c.voxel_size, half_width});
  struts_.emplace(
      setup_.region.triangles, setup_.region.pinned,
      StrutContactOptions{.reach = reach_, .spacing = 0.5 * reach_, .sink = kSink * *c.voxel_size});
}

void StentContact::find(std::span<const Vec3> positions, std::span<const char> pinned) {
  contacts_ = find_contacts(*field_, positions, pinned, contact_distance_, reach_, stiffness_);
}

void StentContact::find_on_struts(std::span<const Vec3> positions) {
  struts_->update(*field_, positions, kGentle * setup_.strut.thickness);
}

xpbd::ContactField StentContact::exact_surface(double edge_radius) const {
  const double thinnest = *std::min_element(state_.radii.begin(), state_.radii.end());
  const double inset = std::clamp(edge_radius, contact_distance_, 0.5 * thinnest);
  // On the inner side of a bend segments meet in creases. A vertex that lies in one is pushed by
  // both sides, and a force that tells them apart has no rest: so the creases are made faint.
  StentState smooth = state_;
  for (int i = 0; i < 2; ++i) {
    smooth.axis = subdivided(smooth.axis);
    smooth.radii = subdivided(smooth.radii);
  }
  return [field = std::make_shared<const sdf::ExactField>(envelope_of(setup_, smooth, inset)),
          inset](std::span<const Vec3> places, std::span<xpbd::Gap> gaps) {
    std::vector<sdf::Sample> samples(places.size());
    field->sample(places, samples);
    for (std::size_t i = 0; i < places.size(); ++i)
      gaps[i] = {samples[i].distance - inset, samples[i].gradient};
  };
}

}  // namespace vstent::deployment
