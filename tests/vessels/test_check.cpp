#include <gtest/gtest.h>

#include <algorithm>
#include <cstdint>
#include <random>

#include "tests/data.hpp"
#include "tests/vessels/shapes.hpp"
#include "vessels/check.hpp"
#include "vessels/error.hpp"
#include "vessels/predicates.hpp"

namespace vstent::vessels {
namespace {

using tests::shared_data;
using tests::tube;

std::size_t count_of(const CheckReport& report, const std::string& kind,
                     Finding::Severity severity) {
  for (const Finding& finding : report.findings) {
    if (finding.kind == kind && finding.severity == severity) return finding.count;
  }
  return 0;
}

CheckReport check_mesh(const TriangleMesh& mesh) { return check(make_surface(mesh, "generated")); }

// --- predicates
// -----------------------------------------------------------------------------------------------------

__extension__ using Wide = __int128;
using Grid = std::array<std::int64_t, 3>;

Vec3 real(const Grid& x) {
  return {static_cast<double>(x[0]), static_cast<double>(x[1]), static_cast<double>(x[2])};
}
Grid minus(const Grid& a, const Grid& b) { return {a[0] - b[0], a[1] - b[1], a[2] - b[2]}; }
int sign_of(Wide x) { return (x > 0) - (x < 0); }
int integer_orient3d(const Grid& a, const Grid& b, const Grid& c, const Grid& d) {
  const Grid u = minus(b, a), v = minus(c, a), w = minus(d, a);
  Wide sum = 0;
  for (std::size_t k = 0; k < 3; ++k) {
    const std::size_t l = (k + 1) % 3, m = (k + 2) % 3;
    sum += (Wide{u[l]} * v[m] - Wide{u[m]} * v[l]) * w[k];
  }
  return sign_of(sum);
}

TEST(Predicates, AgreeWithIntegersWherePointsAreNearlyCoplanar) {
  // Differences of 31 bits: determinants of up to 96 bits overflow a double's 53 and fit into 128.
  std::mt19937_64 random(1);
  std::uniform_int_distribution<std::int64_t> wide(-(std::int64_t{1} << 33), std::int64_t{1} << 33),
      tiny(-1, 1);
  std::size_t zero = 0;
  for (int i = 0; i < 20000; ++i) {
    Grid a, u, v, b, c, d;
    for (std::size_t k = 0; k < 3; ++k) {
      a[k] = wide(random) / 4;
      u[k] = wide(random) / 16;
      v[k] = wide(random) / 16;
      b[k] = a[k] + u[k];
      c[k] = a[k] + v[k];
      d[k] = a[k] + 2 * u[k] - v[k] + tiny(random) * (i % 3 == 0 ? 1 : 0);
    }
    const int expected = integer_orient3d(a, b, c, d);
    zero += expected == 0 ? 1 : 0;
    ASSERT_EQ(orient3d(real(a), real(b), real(c), real(d)), expected) << i;
    ASSERT_EQ(orient3d(real(b), real(a), real(c), real(d)), -expected) << i;
  }
  EXPECT_GT(zero, 10000U);
  EXPECT_LT(zero, 20000U);
}

TEST(Predicates, PlaneAlgebraIsExactFarFromTheOrigin) {
  const double far = 1e6, step = 0x1p-33;  // the last bit of 1e6
  const Vec3 a(far, far, far), b(far + 1, far, far), c(far, far + 1, far);
  EXPECT_EQ(orient3d(a, b, c, Vec3(far + 0.3, far + 0.3, far)), 0);
  EXPECT_EQ(orient3d(a, b, c, Vec3(far + 0.3, far + 0.3, far + step)), 1);
  EXPECT_EQ(orient3d(a, b, c, Vec3(far + 0.3, far + 0.3, far - step)), -1);
  EXPECT_TRUE(collinear(Vec3(0.1, 0.1, 0.1), Vec3(0.2, 0.2, 0.2), Vec3(0.7, 0.7, 0.7)));
  EXPECT_FALSE(
      collinear(Vec3(0.1, 0.1, 0.1), Vec3(0.2, 0.2, 0.2), Vec3(0.7, 0.7, std::nextafter(0.7, 1))));
}

// --- self-intersections: the slow twin tries all pairs with integer arithmetic
// ---------------------------------------

struct IntegerTriangle {
  std::array<Grid, 3> x;
};

Grid cross(const Grid& u, const Grid& v) {
  return {u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]};
}
std::int64_t dot(const Grid& u, const Grid& v) { return u[0] * v[0] + u[1] * v[1] + u[2] * v[2]; }

// Separating axes: two convex sets are disjoint exactly when some normal of a face, or cross
// product of edges (for flat pairs: in-plane edge normals), separates them strictly. Integers, so
// no rounding. Small coordinates: no overflow.
bool separated_by(const Grid& axis, const std::vector<Grid>& a, const std::vector<Grid>& b) {
  if (axis == Grid{0, 0, 0}) return false;
  const auto range = [&](const std::vector<Grid>& set) {
    std::int64_t low = dot(axis, set[0]), high = low;
    for (const Grid& x : set) {
      low = std::min(low, dot(axis, x));
      high = std::max(high, dot(axis, x));
    }
    return std::pair(low, high);
  };
  const auto [a_low, a_high] = range(a);
  const auto [b_low, b_high] = range(b);
  return a_high < b_low || b_high < a_low;
}

bool integer_disjoint(const std::vector<Grid>& a, const std::vector<Grid>& b) {
  const auto edges = [](const std::vector<Grid>& set) {
    std::vector<Grid> result;
    for (std::size_t i = 0; i < set.size(); ++i) {
      for (std::size_t j = i + 1; j < set.size(); ++j) result.push_back(minus(set[j], set[i]));
    }
    return result;
  };
  const std::vector<Grid> ea = edges(a), eb = edges(b);
  std::vector<Grid> normals, axes;
  for (const auto* e : {&ea, &eb}) {
    for (std::size_t i = 0; i < e->size(); ++i) {
      for (std::size_t j = i + 1; j < e->size(); ++j) normals.push_back(cross((*e)[i], (*e)[j]));
    }
  }
  axes = normals;
  for (const Grid& u : ea) {
    for (const Grid& v : eb) axes.push_back(cross(u, v));
  }
  for (const Grid& n : normals) {
    for (const auto* e : {&ea, &eb}) {
      for (const Grid& u : *e) axes.push_back(cross(n, u));
    }
  }
  return std::any_of(axes.begin(), axes.end(),
                     [&](const Grid& axis) { return separated_by(axis, a, b); });
}

// Beyond shared corners: shrinking is not exact, so shared parts are left out by what remains of
// each triangle.
bool integer_meets(const std::vector<Grid>& points, Triangle s, Triangle t) {
  std::vector<int> shared;
  for (const int v : s) {
    if (std::find(t.begin(), t.end(), v) != t.end()) shared.push_back(v);
  }
  const auto at = [&](int v) { return points[static_cast<std::size_t>(v)]; };
  const auto corners = [&](const Triangle& triangle, bool without_shared) {
    std::vector<Grid> result;
    for (const int v : triangle) {
      if (without_shared && std::find(shared.begin(), shared.end(), v) != shared.end()) continue;
      result.push_back(at(v));
    }
    return result;
  };
  if (shared.size() == 3) return true;
  if (shared.size() < 2) {
    // Whole against whole without shared corners; otherwise the far edge of one against the whole
    // other.
    if (shared.empty()) return !integer_disjoint(corners(s, false), corners(t, false));
    return !integer_disjoint(corners(s, true), corners(t, false)) ||
           !integer_disjoint(corners(s, false), corners(t, true));
  }
  // A shared edge: the midpoints of the shared edge and each far corner's triangle overlap only
  // when folded flat.
  const Grid c = corners(s, true)[0], d = corners(t, true)[0];
  const Grid edge = minus(at(shared[1]), at(shared[0]));
  const Grid m = cross(edge, minus(c, at(shared[0]))), n = cross(edge, minus(d, at(shared[0])));
  return cross(m, n) == Grid{0, 0, 0} && dot(m, n) > 0;
}

TEST(SelfIntersections, SameAsIntegerTwinOnSoupsFullOfTouchesAndOverlaps) {
  for (unsigned seed = 1; seed <= 12; ++seed) {
    std::mt19937 random(seed);
    // Few grid places: most pairs touch, lie in one plane or share corners.
    const bool planar = seed % 4 == 1;
    const int side = seed % 3 == 0 && !planar ? 3 : 12;
    std::uniform_int_distribution<int> coordinate(0, side);
    std::vector<Grid> points;
    TriangleMesh mesh;
    while (points.size() < 60) {
      const Grid x = {coordinate(random), coordinate(random), planar ? 0 : coordinate(random)};
      if (std::find(points.begin(), points.end(), x) != points.end()) {
        if (side == 3 && points.size() > 40) break;
        continue;
      }
      points.push_back(x);
      mesh.points.push_back(0.125 * real(x));  // exact in binary
    }
    std::uniform_int_distribution<int> pick(0, static_cast<int>(points.size()) - 1);
    while (mesh.triangles.size() < 120) {
      const Triangle t = {pick(random), pick(random), pick(random)};
      const auto at = [&](int v) { return points[static_cast<std::size_t>(v)]; };
      if (cross(minus(at(t[1]), at(t[0])), minus(at(t[2]), at(t[0]))) != Grid{0, 0, 0})
        mesh.triangles.push_back(t);
    }
    std::vector<std::pair<int, int>> expected;
    for (int i = 0; i < 120; ++i) {
      for (int j = i + 1; j < 120; ++j) {
        if (integer_meets(points, mesh.triangles[static_cast<std::size_t>(i)],
                          mesh.triangles[static_cast<std::size_t>(j)])) {
          expected.emplace_back(i, j);
        }
      }
    }
    ASSERT_EQ(self_intersections(mesh), expected) << "seed " << seed;
    EXPECT_GT(expected.size(), 20U);

    std::vector<char> consider(120, 0);
    for (std::size_t t = 0; t < 120; t += 7) consider[t] = 1;
    std::erase_if(expected, [&](const auto& pair) {
      return consider[static_cast<std::size_t>(pair.first)] == 0 &&
             consider[static_cast<std::size_t>(pair.second)] == 0;
    });
    EXPECT_EQ(self_intersections(mesh, consider), expected) << "seed " << seed;
  }
}

TEST(SelfIntersections, NoneInATubeAndSomeInTwoCrossedTubes) {
  TriangleMesh mesh = tube(3, 20, 24, 21);
  EXPECT_TRUE(self_intersections(mesh).empty());
  const TriangleMesh other = tube(2, 20, 24, 21);
  const int offset = static_cast<int>(mesh.points.size());
  for (const Vec3& x : other.points) mesh.points.emplace_back(x.z() - 10, x.y(), x.x() + 10);
  for (const Triangle& t : other.triangles)
    mesh.triangles.push_back({t[0] + offset, t[1] + offset, t[2] + offset});
  const auto pairs = self_intersections(mesh);
  EXPECT_GE(
      pairs.size(),
      48U);  // two closed curves around the smaller tube, each through every one of its 24 columns
  for (const auto& [a, b] : pairs) EXPECT_TRUE(a < 960 && b >= 960);
}

// --- topology
// -------------------------------------------------------------------------------------------------------

TEST(Topology, TubeHasTwoRimsWithTheInteriorOnTheLeft) {
  const TriangleMesh mesh = tube(3, 20, 24, 11);
  const Topology facts = topology(mesh);
  ASSERT_EQ(facts.boundary_loops.size(), 2U);
  EXPECT_EQ(facts.components, 1);
  EXPECT_TRUE(facts.non_manifold_edges.empty() && facts.bow_tie_vertices.empty() &&
              facts.inconsistent_edges.empty());
  for (int i = 0; i < 24; ++i) {
    EXPECT_EQ(facts.boundary_loops[0][static_cast<std::size_t>(i)],
              i);  // lower rim: with the triangles, counter-clockwise
    EXPECT_EQ(facts.boundary_loops[1][static_cast<std::size_t>(i)], 240 + (24 - i) % 24);
  }
}

TEST(Topology, LoopsStayApartWhereRimsTouchInABowTie) {
  TriangleMesh mesh = tube(3, 20, 12, 5);
  const int offset = static_cast<int>(mesh.points.size());
  for (const Vec3& x : tube(3, 20, 12, 5).points) mesh.points.push_back(x + Vec3(0, 0, 20));
  for (const Triangle& t : tube(3, 20, 12, 5).triangles) {
    Triangle moved = {t[0] + offset, t[1] + offset, t[2] + offset};
    std::replace(moved.begin(), moved.end(), offset,
                 offset - 12);  // the tubes share one rim vertex
    mesh.triangles.push_back(moved);
  }
  const Topology facts = topology(mesh);
  EXPECT_EQ(facts.bow_tie_vertices, std::vector<int>{offset - 12});
  ASSERT_EQ(facts.boundary_loops.size(), 4U);
  for (const auto& loop : facts.boundary_loops) EXPECT_EQ(loop.size(), 12U);
  EXPECT_EQ(facts.components, 2);
}

TEST(Topology, CountsSharedAndTornEdges) {
  TriangleMesh mesh = tube(3, 20, 12, 5);
  mesh.points.emplace_back(9, 0, 0);
  mesh.triangles.push_back(
      {12, 13, static_cast<int>(mesh.points.size()) - 1});  // a fin on an interior edge
  std::swap(mesh.triangles[50][0], mesh.triangles[50][1]);
  const Topology facts = topology(mesh);
  EXPECT_EQ(facts.non_manifold_edges, (std::vector<std::array<int, 2>>{{12, 13}}));
  EXPECT_EQ(facts.inconsistent_edges.size(), 3U);
}

// --- check
// ----------------------------------------------------------------------------------------------------------

TEST(Check, OpeningsOfATube) {
  const CheckReport report = check_mesh(tube(3, 20, 48, 21));
  EXPECT_TRUE(report.stentable());
  EXPECT_FALSE(report.closed);
  ASSERT_EQ(report.openings.size(), 2U);
  // A regular 48-gon has area 24 r^2 sin(2 pi / 48); the diameter is the equal circle's.
  const double diameter =
      2 * 3 * std::sqrt(24 * std::sin(2 * std::numbers::pi / 48) / std::numbers::pi);
  for (const auto& opening : report.openings) EXPECT_NEAR(opening.diameter, diameter, 1e-12);
  EXPECT_NEAR((report.openings[0].centre - Vec3(0, 0, 0)).norm(), 0, 1e-12);
  EXPECT_NEAR((report.openings[1].centre - Vec3(0, 0, 20)).norm(), 0, 1e-12);
  EXPECT_NEAR(report.edge_min, 6 * std::sin(std::numbers::pi / 48), 1e-12);
  EXPECT_NO_THROW(require_stentable(make_surface(tube(3, 20, 48, 21), "t"), report));
}

TEST(Check, EveryDefectIsAnErrorWithItsCount) {
  const TriangleMesh good = tube(3, 20, 24, 21);
  const auto error = Finding::Severity::error;
  {
    TriangleMesh mesh = good;
    mesh.triangles.push_back(mesh.triangles[100]);
    const CheckReport report = check_mesh(mesh);
    EXPECT_EQ(count_of(report, "duplicate-triangle", error), 1U);
    EXPECT_FALSE(report.stentable());
  }
  {
    TriangleMesh mesh = good;
    for (const Vec3& x : good.points) mesh.points.push_back(x + Vec3(30, 0, 0));
    for (const Triangle& t : good.triangles)
      mesh.triangles.push_back({t[0] + 504, t[1] + 504, t[2] + 504});
    EXPECT_EQ(count_of(check_mesh(mesh), "components", error), 2U);
  }
  {
    TriangleMesh mesh = good;
    mesh.points.emplace_back(9, 0, 5);
    mesh.triangles.push_back({120, 121, 504});
    const CheckReport report = check_mesh(mesh);
    EXPECT_EQ(count_of(report, "non-manifold-edge", error), 1U);
    try {
      require_stentable(make_surface(mesh, "fin.vtp"), report);
      ADD_FAILURE();
    } catch (const Error& thrown) {
      EXPECT_EQ(thrown.code(), ExitCode::geometry);
      EXPECT_TRUE(std::string(thrown.what())
                      .starts_with("fin.vtp: cannot be stented: 1 edge of more than two"));
    }
  }
  {
    TriangleMesh mesh = good;
    for (std::size_t i = 0; i < 3; ++i) mesh.triangles[100 + i] = {10, 11, 10 + 24};
    EXPECT_FALSE(check_mesh(mesh).stentable());
  }
  {
    TriangleMesh mesh = tests::turned(good, 960);
    EXPECT_EQ(count_of(check_mesh(mesh), "inconsistent-orientation", error),
              2U);  // its third edge is on the rim
  }
  {
    TriangleMesh mesh = good;  // a vertex pushed through the far wall
    mesh.points[10 * 24] = Vec3(-5, 0.1, mesh.points[10 * 24].z());
    EXPECT_GT(count_of(check_mesh(mesh), "self-intersection", error), 0U);
  }
}

TEST(Check, AHoleIsNotAVesselEnd) {
  TriangleMesh mesh = tube(3, 20, 24, 21);
  mesh.triangles.erase(mesh.triangles.begin() + 400);
  const CheckReport report = check_mesh(mesh);
  EXPECT_EQ(report.openings.size(), 3U);
  EXPECT_EQ(count_of(report, "hole", Finding::Severity::warning), 1U);
}

TEST(Check, AFewFlatTrianglesAreAWarning) {
  TriangleMesh mesh = tube(3, 40, 48, 41);  // 3,840 triangles: up to 3 may be flat
  mesh.points.push_back(0.5 * (mesh.points[480] + mesh.points[481]));
  const int middle = static_cast<int>(mesh.points.size()) - 1;
  mesh.triangles.push_back(
      {480, middle, 481});  // a flat flap on an interior edge: non-manifold, and flat
  const CheckReport report = check_mesh(mesh);
  EXPECT_EQ(count_of(report, "degenerate-triangle", Finding::Severity::warning), 1U);
}

struct RealVessel {
  const char* file;
  LengthUnit unit;
  std::size_t openings;
};

TEST(Check, RealVesselsCanBeStented) {
  const RealVessel vessels[] = {
      {"coa_patient1/wall_aorta.stl", LengthUnit::mm, 5},
      {"coa_patient1/capped_oriented.vtp", LengthUnit::mm, 0},
      {"veingraft_stenosis/capped.vtp", LengthUnit::cm, 0},
      {"veingraft_stenosis/walls_combined.vtp", LengthUnit::cm, 2},
      {"coronary_branch/fine.stl", LengthUnit::mm, 2},
      {"coronary_branch/coarse.stl", LengthUnit::mm, 2},
      {"aortoiliac_demo/aorta_fine.vtp", LengthUnit::cm, 0},
      {"aortoiliac_demo/demo_model.vtp", LengthUnit::cm, 0},
      {"rpa_su201/SU201_2005_RPA1_exterior.vtp", LengthUnit::mm, 0},
      {"aorta_vmtk/aorta-surface-open-ends.stl", LengthUnit::mm, 3},
      {"aorta_vmtk/aorta-surface.vtp", LengthUnit::mm, 0},
  };
  for (const RealVessel& vessel : vessels) {
    const auto path = shared_data(vessel.file);
    SKIP_WITHOUT(path);
    const Surface surface = read_surface(path, vessel.unit);
    const CheckReport report = check(surface);
    EXPECT_TRUE(report.stentable()) << vessel.file;
    EXPECT_EQ(report.openings.size(), vessel.openings) << vessel.file;
    EXPECT_EQ(report.closed, vessel.openings == 0) << vessel.file;
    EXPECT_TRUE(topology(surface.mesh).inconsistent_edges.empty()) << vessel.file;
  }
}

TEST(Check, RawCoarctationIsTurnedAsItsCleanedCopyIs) {
  const auto raw = shared_data("coa_patient1/wall_aorta.stl");
  SKIP_WITHOUT(raw);
  const Surface surface = read_surface(raw, LengthUnit::mm);
  const Surface clean = read_surface(shared_data("coa_patient1/wall_oriented.vtp"), LengthUnit::mm);
  ASSERT_EQ(surface.mesh.triangles.size(), clean.mesh.triangles.size());
  const auto volume = [](const TriangleMesh& mesh) {
    double sum = 0;
    for (const Triangle& t : mesh.triangles) {
      const Vec3 &a = mesh.points[static_cast<std::size_t>(t[0])],
                 &b = mesh.points[static_cast<std::size_t>(t[1])],
                 &c = mesh.points[static_cast<std::size_t>(t[2])];
      sum += a.x() * (b.y() * c.z() - b.z() * c.y()) + a.y() * (b.z() * c.x() - b.x() * c.z()) +
             a.z() * (b.x() * c.y() - b.y() * c.x());
    }
    return sum / 6;
  };
  EXPECT_NEAR(volume(surface.mesh), volume(clean.mesh), 1e-4 * std::abs(volume(clean.mesh)));
  EXPECT_GT(volume(surface.mesh), 0);
}

TEST(Check, DirtySegmentationIsRefusedWithCountsAndPlaces) {
  const auto path = shared_data("dirty_aortofemoral_shawn260/shawn_260.vtp");
  SKIP_WITHOUT(path);
  const Surface surface = read_surface(path, LengthUnit::cm);
  const CheckReport report = check(surface);
  EXPECT_EQ(count_of(report, "non-manifold-edge", Finding::Severity::error), 180U);
  // All of them triangles given twice: with exact arithmetic no others meet beyond shared corners.
  EXPECT_EQ(count_of(report, "duplicate-triangle", Finding::Severity::error), 126U);
  EXPECT_EQ(count_of(report, "self-intersection", Finding::Severity::error), 126U);
  EXPECT_THROW(require_stentable(surface, report), Error);
}

TEST(Check, CrossingComponentsAreCountedAsExactArithmeticCountsThem) {
  const auto path = shared_data("aorta_vmtk/aorta-surface-two-segments.vtp");
  SKIP_WITHOUT(path);
  const Surface surface = read_surface(path, LengthUnit::mm);
  const auto pairs = self_intersections(surface.mesh);
  EXPECT_EQ(pairs.size(), 541U);  // by intersecting the triangles with rational numbers
  for (const auto& [a, b] : pairs) {
    const Triangle& s = surface.mesh.triangles[static_cast<std::size_t>(a)];
    const Triangle& t = surface.mesh.triangles[static_cast<std::size_t>(b)];
    EXPECT_TRUE(std::none_of(s.begin(), s.end(),
                             [&](int v) { return std::find(t.begin(), t.end(), v) != t.end(); }));
  }
  EXPECT_FALSE(check(surface).stentable());
}

}  // namespace
}  // namespace vstent::vessels
