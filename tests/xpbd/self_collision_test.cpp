// Walls that meet: forces against differences, pressure against its closed form, and no crossing.
#include "xpbd/self_collision.hpp"

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include "tests/xpbd/shapes.hpp"
#include "xpbd/equilibrium.hpp"
#include "xpbd/proximity.hpp"

namespace vstent::tests {
namespace {

using xpbd::Sheet;

constexpr double kModulus = 1.2;    // MPa
constexpr double kThickness = 0.1;  // mm
constexpr double kReach = 2 * kThickness;

std::size_t at(int i) { return static_cast<std::size_t>(i); }

Mesh operator+(Mesh a, const Mesh& b) {
  const int first = static_cast<int>(a.points.size());
  a.points.insert(a.points.end(), b.points.begin(), b.points.end());
  a.pinned.insert(a.pinned.end(), b.pinned.begin(), b.pinned.end());
  for (const Triangle& t : b.triangles)
    a.triangles.push_back({t[0] + first, t[1] + first, t[2] + first});
  return a;
}

Mesh patch_at(int columns, int rows, double edge, double turn, const Vec3& centre) {
  Mesh mesh = make_patch(columns, rows, edge);
  Vec3 mean = Vec3::Zero();
  for (const Vec3& p : mesh.points) mean += p / static_cast<double>(mesh.points.size());
  const Eigen::AngleAxisd rotation(turn, Vec3::UnitZ());
  for (Vec3& p : mesh.points) p = rotation * (p - mean) + centre;
  return mesh;
}

Sheet colliding(const Mesh& mesh) {
  Sheet sheet = xpbd::make_sheet(mesh.points, mesh.triangles, mesh.pinned,
                                 xpbd::Membrane{kModulus, kThickness, 0.45});
  sheet.surface =
      xpbd::SurfaceOfWall{mesh.triangles, std::vector<double>(mesh.points.size(), kThickness),
                          std::vector<double>(mesh.points.size(), kModulus)};
  return sheet;
}

/// The twin of "does not cross": edges of one triangle through the inside of another, by signed
/// volumes.
int crossings(std::span<const Vec3> x, const std::vector<Triangle>& triangles) {
  const auto volume = [&](int a, int b, int c, int d) {
    return (x[at(b)] - x[at(a)]).cross(x[at(c)] - x[at(a)]).dot(x[at(d)] - x[at(a)]);
  };
  int count = 0;
  for (const Triangle& t : triangles) {
    Box box;
    for (const int v : t) box.include(x[at(v)]);
    for (const Triangle& other : triangles)
      for (std::size_t k = 0; k < 3; ++k) {
        const int p = other[k], q = other[(k + 1) % 3];
        Box edge;
        edge.include(x[at(p)]);
        edge.include(x[at(q)]);
        if (!box.overlaps(edge)) continue;
        if (std::count(t.begin(), t.end(), p) + std::count(t.begin(), t.end(), q) > 0) continue;
        if (volume(t[0], t[1], t[2], p) * volume(t[0], t[1], t[2], q) >= 0) continue;
        const double a = volume(p, q, t[0], t[1]), b = volume(p, q, t[1], t[2]),
                     c = volume(p, q, t[2], t[0]);
        count += (a > 0 && b > 0 && c > 0) || (a < 0 && b < 0 && c < 0);
      }
  }
  return count;
}

void nowhere(std::span<const Vec3> places, std::span<xpbd::Gap> gaps) {
  for (std::size_t i = 0; i < places.size(); ++i) gaps[i] = {1e9, Vec3::Zero()};
}

TEST(Proximity, NoPlaceIsNearerThanTheNearest) {
  std::mt19937 random(3);
  for (int trial = 0; trial < 300; ++trial) {
    const std::array<Vec3, 4> x{random_vector(random), random_vector(random), random_vector(random),
                                random_vector(random)};
    const auto offset = [&](const std::array<double, 4>& w) {
      return Vec3(w[0] * x[0] + w[1] * x[1] + w[2] * x[2] + w[3] * x[3]);
    };
    const xpbd::Nearest triangle = xpbd::point_triangle(x[0], x[1], x[2], x[3]);
    const xpbd::Nearest segments = xpbd::segment_segment(x[0], x[1], x[2], x[3]);
    EXPECT_LT((offset(triangle.weights) - triangle.offset).norm(), 1e-14);
    EXPECT_LT((offset(segments.weights) - segments.offset).norm(), 1e-14);
    double of_triangle = 1e9, of_segments = 1e9;
    constexpr int kSteps = 60;
    for (int i = 0; i <= kSteps; ++i)
      for (int j = 0; j <= kSteps; ++j) {
        const double s = static_cast<double>(i) / kSteps, t = static_cast<double>(j) / kSteps;
        of_segments = std::min(of_segments, offset({1 - s, s, t - 1, -t}).norm());
        if (i + j <= kSteps)
          of_triangle = std::min(of_triangle, offset({1, s + t - 1, -s, -t}).norm());
      }
    // Samples are as far apart as edges of at most 2 sqrt 3, cut in kSteps.
    EXPECT_LE(triangle.distance, of_triangle + 1e-14);
    EXPECT_GE(triangle.distance, of_triangle - 2 * 3.5 / kSteps);
    EXPECT_LE(segments.distance, of_segments + 1e-14);
    EXPECT_GE(segments.distance, of_segments - 2 * 3.5 / kSteps);
  }
}

/// Two crumpled patches that have come as near as `gap`.
struct Crumpled {
  Sheet sheet;
  xpbd::ElasticSheet elastic;
  std::vector<xpbd::Slot> near;
  xpbd::SelfCollision collision;

  explicit Crumpled(double gap)
      : sheet(
            colliding(patch_at(9, 9, 0.3, 0, Vec3::Zero()) + patch_at(8, 8, 0.35, 0.4, {0, 0, 1}))),
        elastic(xpbd::make_elastic_sheet(sheet)),
        near(near_places(gap)),
        collision(sheet, elastic, xpbd::particles_of(elastic, sheet.positions)) {
    collision.look(near);
  }

  std::vector<xpbd::Slot> near_places(double gap) const {
    std::mt19937 random(11);
    std::vector<Vec3> x = sheet.positions;
    for (Vec3& p : x) {
      if (p.z() > 0.5) p.z() = gap;
      p += 0.12 * gap * random_vector(random);
    }
    return xpbd::particles_of(elastic, x);
  }

  double energy(const std::vector<xpbd::Slot>& x) const {
    std::vector<xpbd::Slot> forces(x.size());
    return collision.add_forces(x, forces).energy;
  }
};

// Once where vertices push, once so near that edges do as well.
TEST(SelfCollision, ForcesAreTheEnergysGradient) {
  for (const double gap : {0.7 * kReach, 0.35 * kReach}) {
    Crumpled c(gap);
    std::vector<xpbd::Slot> forces(c.near.size());
    c.collision.add_forces(c.near, forces);
    const auto pushes = c.collision.pushes(c.near);
    const auto of_edges =
        std::count_if(pushes.begin(), pushes.end(), [](const xpbd::Push& p) { return p.of_edges; });
    EXPECT_EQ(of_edges > 0, gap < 0.5 * kReach);
    double largest = 0;
    for (const xpbd::Slot& f : forces) largest = std::max(largest, Vec3(f.x, f.y, f.z).norm());
    ASSERT_GT(largest, 0);
    // Central differences are off by h^2 / 6 times the third derivative, some k d^3 / g^4: of the
    // force k d a few (h / g)^2. Where the nearest triangle changes within h the slope of a
    // distance turns by what the patches are crumpled by, in some of them.
    const double h = 1e-6;
    int off = 0;
    for (std::size_t k = 0; k < c.near.size(); ++k) {
      const std::array<double xpbd::Slot::*, 3> axes{&xpbd::Slot::x, &xpbd::Slot::y,
                                                     &xpbd::Slot::z};
      for (const auto axis : axes) {
        std::vector<xpbd::Slot> there = c.near;
        there[k].*axis += h;
        const double ahead = c.energy(there);
        there[k].*axis -= 2 * h;
        const double slope = (ahead - c.energy(there)) / (2 * h);
        off += std::abs(slope + forces[k].*axis) > 1e-5 * largest;
      }
    }
    EXPECT_EQ(off, 0) << gap;
  }
}

TEST(SelfCollision, PushesAreEqualAndOppositeAndTurnNothing) {
  const Crumpled c(0.4 * kReach);
  std::vector<xpbd::Slot> forces(c.near.size());
  c.collision.add_forces(c.near, forces);
  Vec3 sum = Vec3::Zero(), torque = Vec3::Zero();
  double scale = 0;
  for (std::size_t k = 0; k < forces.size(); ++k) {
    const Vec3 f(forces[k].x, forces[k].y, forces[k].z);
    sum += f;
    torque += Vec3(c.near[k].x, c.near[k].y, c.near[k].z).cross(f);
    scale += f.norm();
  }
  EXPECT_GT(scale, 0);
  EXPECT_LT(sum.norm(), 1e-13 * scale);
  EXPECT_LT(torque.norm(), 1e-13 * scale);
}

TEST(SelfCollision, ASheetThatLiesNearItselfAtRestIsFreeOfStress) {
  for (const double gap : {0.5 * kReach, 0.1 * kReach, 0.03 * kReach}) {
    const Sheet sheet =
        colliding(patch_at(9, 9, 0.3, 0, Vec3::Zero()) + patch_at(8, 8, 0.35, 0.4, {0, 0, gap}));
    const xpbd::ElasticSheet elastic = xpbd::make_elastic_sheet(sheet);
    const auto rest = xpbd::particles_of(elastic, sheet.positions);
    const xpbd::SelfCollision collision(sheet, elastic, rest);
    EXPECT_GT(collision.watched(), 0u);
    EXPECT_EQ(collision.pushes(rest).size(), 0u);
  }
}

TEST(SelfCollision, ASheetByItselfHasNothingToWatch) {
  const Mesh tube = make_tube({.radius = 5, .length = 20, .edge = 0.5});
  const Sheet sheet = colliding(tube);
  const xpbd::ElasticSheet elastic = xpbd::make_elastic_sheet(sheet);
  const xpbd::SelfCollision collision(sheet, elastic, xpbd::particles_of(elastic, sheet.positions));
  EXPECT_EQ(collision.watched(), 0u);
}

/// A patch pressed onto a larger one that is held, until forces balance; the mean gap inside.
double pressed_gap(double pressure, double edge, double edge_below, double turn) {
  const auto columns = [](double width, double e) { return static_cast<int>(width / e) + 1; };
  Mesh below =
      patch_at(columns(9, edge_below), columns(10.4, edge_below), edge_below, turn, Vec3::Zero());
  below.pinned.assign(below.pinned.size(), 1);
  const std::size_t held = below.points.size();
  const Mesh both =
      below + patch_at(columns(6, edge), columns(7, edge), edge, 0, {0, 0, 1.2 * kReach});
  Sheet sheet = colliding(both);
  sheet.forces.assign(both.points.size(), Vec3::Zero());
  for (const Triangle& t : both.triangles) {
    const Vec3& a = both.points[at(t[0])];
    const double area = 0.5 * (both.points[at(t[1])] - a).cross(both.points[at(t[2])] - a).norm();
    for (const int v : t)
      if (at(v) >= held) sheet.forces[at(v)].z() -= pressure * area / 3;
  }
  // So that nothing slides or tilts away.
  xpbd::support(sheet, both.triangles, 1e-6);
  xpbd::Equilibrium equilibrium(sheet, sheet.positions, nowhere);
  // A gap that is off by 0.001 of itself leaves about 0.002 (d/g)^2 k d / (2 p) of the load.
  xpbd::RelaxReport report;
  for (int i = 0; i < 3000 && (i == 0 || report.balance.relative > 1e-4); ++i)
    report = equilibrium.iterate({.largest_move = 0.1});
  EXPECT_LE(report.balance.relative, 1e-4);
  double sum = 0;
  int inside = 0;
  for (std::size_t v = held; v < both.points.size(); ++v) {
    const Vec3& p = both.points[v];
    if (std::abs(p.x()) > 1.5 || std::abs(p.y()) > 1.5) continue;
    sum += equilibrium.positions()[v].z();
    ++inside;
  }
  return sum / inside;
}

// p = E/2 (d^2/g^2 - 1), so g = d / sqrt(1 + 2 p / E). The upper half of the pressure is exact
// where its mesh is even; the lower's vertices lie under the patch as they happen to, and their
// forces are handed to the corners of triangles: over 3 mm with edges of 0.4 and bending stiffness
// to share them that makes at most a tenth of its half. d g / g = (1 - (g/d)^2) / 2 times the
// relative error of the pressure: 0.01 of the gap at p = 0.2 E.
TEST(SelfCollision, PressureFollowsItsLawWhateverTheMesh) {
  for (const double over_modulus : {0.02, 0.2}) {
    const double expected = kReach / std::sqrt(1 + 2 * over_modulus);
    const double share = 0.5 * (1 - 1 / (1 + 2 * over_modulus));
    for (const auto& [edge, below] : {std::pair{0.5, 0.42}, std::pair{0.25, 0.21}}) {
      const double gap = pressed_gap(over_modulus * kModulus, edge, below, 0.3);
      EXPECT_NEAR(gap, expected, 0.05 * share * expected + 1e-3 * expected)
          << over_modulus << ' ' << edge;
    }
  }
}

/// Two patches thrown at each other, faster than they are apart.
std::pair<int, int> crossings_after_a_crash(bool kept_apart) {
  Mesh above = patch_at(11, 11, 0.33, 0.5, {0.1, 0, 0.8});
  for (Vec3& p : above.points) p.z() += 0.2 * p.x();  // so that none goes through all at once
  const Mesh both = patch_at(12, 12, 0.3, 0, Vec3::Zero()) + above;
  Sheet sheet = colliding(both);
  if (!kept_apart) sheet.surface.reset();
  xpbd::scale_masses(sheet, 1, 1);
  xpbd::Solver solver(sheet);
  int at_worst = 0, after = 0;
  std::vector<Vec3> velocities;
  for (const Vec3& p : both.points) velocities.push_back({0, 0, p.z() > 0.2 ? -0.4 : 0.3});
  solver.set_velocities(velocities);
  for (int step = 0; step < 12; ++step) {
    solver.step({}, {.iterations = 3});
    after = crossings(solver.positions(), both.triangles);
    at_worst = std::max(at_worst, after);
  }
  return {at_worst, after};
}

TEST(SelfCollision, PatchesThrownAtEachOtherDoNotCross) {
  EXPECT_EQ(crossings_after_a_crash(true).first, 0);
  EXPECT_GT(crossings_after_a_crash(false).first, 0);
}

/// A tube that is put over a capsule all at once, far into the tube beside it.
std::vector<Vec3> widened_beside(bool kept_apart, int iterations, int* crossed = nullptr) {
  const Mesh tube = make_tube({.radius = 5, .length = 24, .edge = 1});
  Mesh second = make_tube({.radius = 4, .length = 24, .edge = 0.9});
  for (Vec3& p : second.points) p.x() += 9.3;
  const Mesh both = tube + second;
  Sheet sheet = colliding(both);
  if (!kept_apart) sheet.surface.reset();
  const xpbd::ContactField cylinder = [](std::span<const Vec3> places, std::span<xpbd::Gap> gaps) {
    for (std::size_t i = 0; i < places.size(); ++i) {
      // A capsule of radius 6 about z, 8 mm of it straight.
      const Vec3 from(places[i].x(), places[i].y(),
                      places[i].z() - std::clamp(places[i].z(), -4.0, 4.0));
      gaps[i] = {from.norm() - 6, from.normalized()};
    }
  };
  xpbd::Equilibrium equilibrium(sheet, sheet.positions, cylinder);
  xpbd::RelaxReport report;
  for (int i = 0; i < iterations && (i == 0 || report.balance.relative > 1e-3); ++i)
    report = equilibrium.iterate({.largest_move = 1});
  if (crossed) {
    EXPECT_LE(report.balance.relative, 1e-3);
    EXPECT_EQ(equilibrium.kept_inside(), 0);
    EXPECT_EQ(equilibrium.pushes().empty(), !kept_apart);
    *crossed = crossings(equilibrium.positions(), both.triangles);
  }
  return {equilibrium.positions().begin(), equilibrium.positions().end()};
}

TEST(SelfCollision, AWidenedTubePushesItsNeighbourAside) {
  int crossed = 0;
  widened_beside(true, 1000, &crossed);
  EXPECT_EQ(crossed, 0);
  widened_beside(false, 1000, &crossed);
  EXPECT_GT(crossed, 0);
}

TEST(SelfCollision, BitsDoNotDependOnThreads) {
  std::vector<std::vector<Vec3>> results;
  for (const std::size_t threads : {1u, 2u, 3u, 8u}) {
    const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads);
    results.push_back(widened_beside(true, 40));
  }
  for (const auto& result : results)
    for (std::size_t v = 0; v < result.size(); ++v)
      EXPECT_TRUE((result[v].array() == results[0][v].array()).all());
}

}  // namespace
}  // namespace vstent::tests
