#include "xpbd/lead_apart.hpp"

#include <algorithm>

#include "xpbd/parallel.hpp"
#include "xpbd/self_collision.hpp"

namespace vstent::xpbd {
namespace {

// Looks on the way: a vessel that is widened by a few millimetres takes some tens.
constexpr int kLooks = 500;
// Of the way that is left: less at once, and each goes as far as it can by itself.
constexpr double kTogether = 0.01;
// mm: as good as there.
constexpr double kThere = 1e-9;
// Of the way that is left: what does not come further by so much in a look is held up.
constexpr double kHeldUp = 1e-3;

}  // namespace

std::vector<Vec3> lead_apart(const Sheet& sheet, std::span<const Vec3> target) {
  const ElasticSheet elastic = make_elastic_sheet(sheet);
  std::vector<Slot> particles = particles_of(elastic, sheet.positions);
  const std::vector<Slot> goal = particles_of(elastic, target);
  SelfCollision collision(sheet, elastic, particles);
  std::vector<Vec3> left(particles.size());
  for (int n = 0; n < kLooks; ++n) {
    collision.look(particles);
    double farthest = 0, moved = 0;
    for (std::size_t k = 0; k < particles.size(); ++k) {
      left[k] = elastic.free[k] ? Vec3(place(goal[k]) - place(particles[k])) : Vec3::Zero();
      farthest = std::max(farthest, left[k].norm());
    }
    const double together = collision.allowed(particles, left, 1);
    for (std::size_t k = 0; k < particles.size(); ++k) {
      const Vec3 from = place(particles[k]);
      Vec3 to = from + (together > kTogether ? together : 1) * left[k];
      collision.keep_pushed(k, to);
      put(particles[k], to);
      moved = std::max(moved, (to - from).norm());
    }
    if (farthest <= kThere || moved <= kHeldUp * farthest) break;
  }
  std::vector<Vec3> places(sheet.positions);
  for (std::size_t k = 0; k < particles.size(); ++k)
    if (elastic.free[k])
      places[at(elastic.layout.original[k])] = place(particles[k]) + elastic.origin;
  return places;
}

}  // namespace vstent::xpbd
