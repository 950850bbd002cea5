#include "xpbd/crossings.hpp"

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

double volume(const Vec3& a, const Vec3& b, const Vec3& c, const Vec3& d) {
  return (b - a).cross(c - a).dot(d - a);
}

bool goes_through(const Vec3& p, const Vec3& q, const std::array<Vec3, 3>& t) {
  if (volume(t[0], t[1], t[2], p) * volume(t[0], t[1], t[2], q) >= 0) return false;
  const double a = volume(p, q, t[0], t[1]), b = volume(p, q, t[1], t[2]),
               c = volume(p, q, t[2], t[0]);
  return (a >= 0 && b >= 0 && c >= 0) || (a <= 0 && b <= 0 && c <= 0);
}

std::vector<Slot> slots(std::span<const Vec3> places) {
  std::vector<Slot> result(places.size());
  for (std::size_t k = 0; k < places.size(); ++k) put(result[k], places[k]);
  return result;
}

}  // namespace

std::size_t crossings(const SurfaceOfWall& surface, std::span<const Vec3> rest,
                      std::span<const Vec3> places) {
  SurfaceCells cells(slots(rest), surface.triangles, cell_spacing(surface));
  cells.place_at(slots(places));
  const auto through = [&](int of_edges, int of_triangles) {
    std::size_t count = 0;
    for (const int t : cells.triangles(of_triangles)) {
      std::array<Vec3, 3> corners;
      Box box;
      for (std::size_t k = 0; k < 3; ++k) {
        corners[k] = places[at(surface.triangles[at(t)][k])];
        box.include(corners[k]);
      }
      for (const int e : cells.edges(of_edges)) {
        const auto [i, j] = cells.edges()[at(e)];
        Box edge;
        edge.include(places[at(i)]);
        edge.include(places[at(j)]);
        if (box.overlaps(edge)) count += goes_through(places[at(i)], places[at(j)], corners);
      }
    }
    return count;
  };
  std::size_t count = 0;
  for (const auto& [a, b] : cells.meetings(0)) count += through(a, b) + through(b, a);
  return count;
}

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
