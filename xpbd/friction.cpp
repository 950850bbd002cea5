#include "xpbd/friction.hpp"

#include <algorithm>
#include <cassert>
#include <cmath>

#include "xpbd/parallel.hpp"

namespace vstent::xpbd {

Friction::Friction(FrictionLaw law, std::size_t particles)
    : law_(law),
      anchors_(particles, Vec3::Zero()),
      anchored_(particles, 0),
      limits_(particles, 0.0) {
  assert(law.coefficient > 0 && law.slip > 0);
}

void Friction::anchor(std::size_t k, const Vec3& place) {
  anchors_[k] = place;
  anchored_[k] = 1;
}

std::vector<Vec3> Friction::dragged(std::span<const Slot> particles) const {
  std::vector<Vec3> places(particles.size());
  for (std::size_t k = 0; k < places.size(); ++k) {
    places[k] = place(particles[k]);
    if (!anchored_[k]) continue;
    const Vec3 back = anchors_[k] - places[k];
    const double away = back.norm();
    places[k] = away > law_.slip ? Vec3(places[k] + law_.slip / away * back) : anchors_[k];
  }
  return places;
}

void Friction::renew(std::span<const double> pushes) {
  for (std::size_t k = 0; k < limits_.size(); ++k) limits_[k] = law_.coefficient * pushes[k];
}

Vec3 Friction::share(std::size_t k, const Vec3& place) const {
  const Vec3 back = anchors_[k] - place;
  return back / std::max(back.norm(), law_.slip);
}

double Friction::add_forces(std::span<const Slot> particles, std::span<const char> touching,
                            std::vector<Slot>& forces) const {
  std::vector<double> partial(chunks_of(particles.size()), 0.0);
  for_each_particle(particles.size(), [&](std::size_t k, std::size_t chunk) {
    if (!touching[k] || !anchored_[k] || !(limits_[k] > 0)) return;
    const Vec3 at = place(particles[k]);
    const double away = (anchors_[k] - at).norm();
    partial[chunk] +=
        limits_[k] * (away < law_.slip ? 0.5 * away * away / law_.slip : away - 0.5 * law_.slip);
    put(forces[k], place(forces[k]) + limits_[k] * share(k, at));
  });
  double energy = 0;
  for (const double part : partial) energy += part;
  return energy;
}

Vec3 Friction::missing(std::size_t k, const Vec3& place, double push) const {
  if (!anchored_[k]) return Vec3::Zero();
  return (law_.coefficient * push - limits_[k]) * share(k, place);
}

void Friction::add_links(std::span<const Slot> particles, std::vector<Link>& links) const {
  for (std::size_t k = 0; k < limits_.size(); ++k) {
    if (!anchored_[k] || !(limits_[k] > 0)) continue;
    const double away = std::max((anchors_[k] - place(particles[k])).norm(), law_.slip);
    const int particle = static_cast<int>(k);
    for (int axis = 0; axis < 3; ++axis)
      links.push_back({{particle, particle, particle, particle},
                       {1, 0, 0, 0},
                       Vec3::Unit(axis),
                       limits_[k] / away});
  }
}

}  // namespace vstent::xpbd
