#include "deployment/self_contact.hpp"

#include <algorithm>
#include <limits>

#include "sdf/polyline.hpp"

namespace vstent::deployment {
namespace {

/// One of the two places that a push is between.
struct Side {
  Vec3 place = Vec3::Zero(), moved = Vec3::Zero();
  bool held = true;
};

}  // namespace

SelfContact self_contact(const Setup& setup, std::span<const xpbd::Push> pushes,
                         std::span<const Vec3> positions, const Polyline& axis) {
  SelfContact contact;
  if (pushes.empty()) return contact;
  const std::vector<double> arc = arc_lengths(axis);
  contact.least_clearance = std::numeric_limits<double>::infinity();
  for (const xpbd::Push& push : pushes) {
    ++contact.places;
    contact.least_clearance = std::min(contact.least_clearance, push.gap);
    contact.force += push.force;
    std::array<Side, 2> sides;
    for (std::size_t k = 0; k < 4; ++k) {
      Side& side = sides[push.weights[k] > 0 ? 0 : 1];
      const double share = std::abs(push.weights[k]);
      if (share == 0) continue;
      const auto i = static_cast<std::size_t>(push.particles[k]);
      const Vec3& before =
          setup.surface.mesh.points[static_cast<std::size_t>(setup.region.vertices[i])];
      side.place += share * positions[i];
      side.moved += share * (positions[i] - before);
      side.held = side.held && setup.region.pinned[i];
    }
    const auto squared_distance = [&](const Side& side) {
      return nearest_place(axis, arc, side.place).squared_distance;
    };
    const Side& further =
        squared_distance(sides[0]) > squared_distance(sides[1]) ? sides[0] : sides[1];
    contact.pushed_aside = std::max(contact.pushed_aside, further.moved.norm());
    contact.against_held += further.held;
  }
  return contact;
}

std::vector<std::string> warnings_of(const SelfContact& contact) {
  if (contact.against_held == 0) return {};
  return {"the wall presses on other wall that cannot give way in " +
          std::to_string(contact.against_held) + " of " + std::to_string(contact.places) +
          " places, because the patch that may move ends there; a larger /patch/margin lets it"};
}

}  // namespace vstent::deployment
