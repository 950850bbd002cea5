#include <gtest/gtest.h>
#include <oneapi/tbb/global_control.h>

#include <map>

#include "meshing/remesh.hpp"
#include "sdf/mesh_distance.hpp"
#include "tests/data.hpp"
#include "tests/meshing/models.hpp"
#include "tests/sdf/meshes.hpp"
#include "vessels/error.hpp"

namespace vstent::meshing {
namespace {

using tests::corner;

RemeshOptions edges_of(double length, bool resample = true) {
  RemeshOptions options;
  options.edge_lengths.everywhere = length;
  options.resample_rims = resample;
  return options;
}

double share_within_bounds(const TriangleMesh& mesh, double length) {
  const std::vector<double> lengths = tests::edge_lengths_of(mesh);
  const auto good = std::count_if(lengths.begin(), lengths.end(), [&](double l) {
    return l > 0.8 * length && l < 4.0 / 3 * length;
  });
  return static_cast<double>(good) / static_cast<double>(lengths.size());
}

/// No triangle looks against the surface it replaces.
void expect_not_turned(const Model& before, const Remeshed& after) {
  const sdf::MeshDistance distance(before.mesh);
  for (std::size_t t = 0; t < after.is_new.size(); ++t) {
    if (!after.is_new[t]) continue;
    const Triangle& corners = after.model.mesh.triangles[t];
    const auto closest = distance.closest(tests::centroid(after.model.mesh, corners));
    const Vec3 was = tests::area_vector(
        before.mesh, before.mesh.triangles[static_cast<std::size_t>(closest.triangle)]);
    ASSERT_GT(tests::area_vector(after.model.mesh, corners).normalized().dot(was.normalized()), 0);
  }
}

/// Edges between two faces, by the coordinates of their ends.
using Place = std::array<double, 3>;
std::set<std::pair<Place, Place>> rims(const Model& model) {
  std::map<std::pair<int, int>, std::set<int>> faces;
  for (std::size_t t = 0; t < model.mesh.triangles.size(); ++t) {
    const Triangle& c = model.mesh.triangles[t];
    for (std::size_t k = 0; k < 3; ++k)
      faces[{std::min(c[k], c[(k + 1) % 3]), std::max(c[k], c[(k + 1) % 3])}].insert(
          model.face_of_triangle[t]);
  }
  const auto place = [&](int p) {
    const Vec3& x = model.mesh.points[static_cast<std::size_t>(p)];
    return Place{x.x(), x.y(), x.z()};
  };
  std::set<std::pair<Place, Place>> result;
  for (const auto& [ends, ids] : faces)
    if (ids.size() > 1) result.insert(std::minmax({place(ends.first), place(ends.second)}));
  return result;
}

TEST(Remesh, CylinderHasEdgesOfTheWantedLengthAndKeepsItsShape) {
  const double radius = 3, length = 12, edge = 0.5;
  const Model model = tests::cylinder(radius, length, 120, 78);
  const Remeshed result = remesh(model, {}, edges_of(edge));
  const TriangleMesh& mesh = result.model.mesh;
  EXPECT_TRUE(tests::closed_and_oriented(mesh));
  EXPECT_EQ(tests::euler_characteristic(mesh), 2);
  EXPECT_TRUE(vessels::self_intersections(mesh).empty());
  EXPECT_GT(share_within_bounds(mesh, edge), 0.95);
  EXPECT_GT(result.after.smallest_angle, 25);
  EXPECT_GT(result.after.mean_smallest_angle, 50);
  expect_not_turned(model, result);
  // A chord L of the circle stays L^2 / (8 R) away from it; a triangle's middle L^2 / (6 R) at
  // most.
  const double bound = result.after.longest_edge * result.after.longest_edge / (6 * radius);
  EXPECT_LT(result.deviation, bound);
  // Its area is smaller by twice the mean distance over R at most.
  EXPECT_LT(std::abs(result.volume_change), 2 * bound / radius);
  // Caps stay in their planes.
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    if (result.model.face_of_triangle[t] == 1) continue;
    for (std::size_t k = 0; k < 3; ++k) {
      const double z = corner(mesh, mesh.triangles[t], k).z();
      EXPECT_NEAR(std::min(std::abs(z), std::abs(z - length)), 0, 1e-12);
    }
  }
}

TEST(Remesh, DeviationFromASphereFallsWithTheSquareOfTheLength) {
  const Model model = tests::one_face(tests::icosphere(5, 5));
  const Remeshed coarse = remesh(model, {}, edges_of(1.2)), fine = remesh(model, {}, edges_of(0.6));
  for (const Remeshed* result : {&coarse, &fine}) {
    EXPECT_EQ(tests::euler_characteristic(result->model.mesh), 2);
    EXPECT_GT(result->after.smallest_angle, 25);
    const double longest = result->after.longest_edge;
    EXPECT_LT(result->deviation, longest * longest / (6 * 5));
  }
  EXPECT_GT(coarse.deviation / fine.deviation, 2.5);
  EXPECT_GT(coarse.volume_change / fine.volume_change, 3);
}

TEST(Remesh, TorusKeepsItsHole) {
  const Model model = tests::one_face(tests::torus(8, 2, 160, 40));
  const Remeshed result = remesh(model, {}, edges_of(0.6));
  EXPECT_TRUE(tests::closed_and_oriented(result.model.mesh));
  EXPECT_EQ(tests::euler_characteristic(result.model.mesh), 0);
  EXPECT_GT(share_within_bounds(result.model.mesh, 0.6), 0.95);
  expect_not_turned(model, result);
  const double area = 4 * std::numbers::pi * std::numbers::pi * 8 * 2;
  EXPECT_NEAR(tests::area_of(result.model.mesh), area, 0.02 * area);  // 2 h^2 / (6 r^2) = 0.03
}

TEST(Remesh, OutsideTheRegionEverythingIsKeptBitByBit) {
  const Model model = tests::cylinder(3, 12, 60, 39);
  std::vector<char> region;
  for (std::size_t t = 0; t < model.mesh.triangles.size(); ++t) {
    const double z = tests::centroid(model.mesh, model.mesh.triangles[t]).z();
    region.push_back(model.face_of_triangle[t] == 1 && z > 4 && z < 8);
  }
  const Remeshed result = remesh(model, region, edges_of(0.15));
  EXPECT_TRUE(tests::closed_and_oriented(result.model.mesh));
  std::size_t kept = 0;
  for (std::size_t t = 0; t < region.size(); ++t) {
    if (region[t]) continue;
    ASSERT_EQ(result.kept_triangle[kept], static_cast<int>(t));
    ASSERT_EQ(result.model.face_of_triangle[kept], model.face_of_triangle[t]);
    for (std::size_t k = 0; k < 3; ++k)
      ASSERT_EQ(corner(result.model.mesh, result.model.mesh.triangles[kept], k),
                corner(model.mesh, model.mesh.triangles[t], k));
    ++kept;
  }
  for (std::size_t t = kept; t < result.kept_triangle.size(); ++t) {
    EXPECT_EQ(result.kept_triangle[t], -1);
    EXPECT_TRUE(result.is_new[t]);
  }
  int last = -1;
  for (std::size_t p = 0; p < result.kept_point.size(); ++p) {
    if (result.kept_point[p] < 0) continue;
    EXPECT_GT(result.kept_point[p], last);
    last = result.kept_point[p];
    EXPECT_EQ(result.model.mesh.points[p], model.mesh.points[static_cast<std::size_t>(last)]);
  }
  EXPECT_GT(result.after.triangles, 2 * result.before.triangles);
}

TEST(Remesh, RimsStayUnlessTheyMayBeResampled) {
  const Model model = tests::cylinder(3, 12, 60, 39);
  const auto before = rims(model);
  EXPECT_EQ(before.size(), 120u);
  EXPECT_EQ(rims(remesh(model, {}, edges_of(0.6, false)).model), before);
  const auto resampled = rims(remesh(model, {}, edges_of(0.6)).model);
  EXPECT_LT(resampled.size(), before.size());
  // Points lie on the old rim: on chords of 60 to the circle.
  for (const auto& [a, b] : resampled) {
    for (const Place& p : {a, b}) {
      EXPECT_LE(std::hypot(p[0], p[1]), 3 + 1e-12);
      EXPECT_GE(std::hypot(p[0], p[1]), 3 * std::cos(std::numbers::pi / 60) - 1e-12);
    }
  }
}

TEST(Remesh, TheSameBitsForAnyNumberOfThreads) {
  const Model model = tests::cylinder(2, 6, 40, 20);
  const Remeshed many = remesh(model, {}, edges_of(0.3));
  const oneapi::tbb::global_control one_thread(oneapi::tbb::global_control::max_allowed_parallelism,
                                               1);
  const Remeshed one = remesh(model, {}, edges_of(0.3));
  EXPECT_EQ(one.model.mesh.points, many.model.mesh.points);
  EXPECT_EQ(one.model.mesh.triangles, many.model.mesh.triangles);
  EXPECT_EQ(one.deviation, many.deviation);
}

TEST(Remesh, AdaptiveEdgesKeepTheDeviationOnATorus) {
  // The larger curvature is 1 / r = 0.5 / mm everywhere: sqrt(6 e / k - 3 e^2) is one length.
  const Model model = tests::one_face(tests::torus(8, 2, 240, 60));
  RemeshOptions options;
  options.edge_lengths.adaptive = Adaptive{0.1, 2, 0.03};
  const double length = std::sqrt(6 * 0.03 / 0.5 - 3 * 0.03 * 0.03);
  const Remeshed result = remesh(model, {}, options);
  EXPECT_NEAR(result.after.mean_edge, length, 0.1 * length);
  // e bounds equilateral triangles of that length; edges are up to 4/3 longer.
  EXPECT_LT(result.deviation, 16.0 / 9 * 0.03);
}

TEST(Remesh, ARegionThatTouchesItselfInAPointStaysWhole) {
  const Model model = tests::one_face(tests::torus(8, 2, 80, 20));
  std::vector<char> region(model.mesh.triangles.size(), 0);
  // Two quadrilateral blocks of the grid that share one corner.
  for (int i = 10; i < 20; ++i)
    for (int j = 2; j < 8; ++j)
      for (const int shift : {0, 10 * 20 + 6})
        for (int k = 0; k < 2; ++k)
          region[static_cast<std::size_t>(2 * (i * 20 + j + shift) + k)] = 1;
  const Remeshed result = remesh(model, region, edges_of(0.3));
  EXPECT_TRUE(tests::closed_and_oriented(result.model.mesh));
  EXPECT_EQ(tests::euler_characteristic(result.model.mesh), 0);
  expect_not_turned(model, result);
}

TEST(Remesh, LengthsThatAreNoneOrFarTooShortAreRefused) {
  const Model model = tests::one_face(tests::icosphere(5, 2));
  const auto code = [&](double length, std::optional<Adaptive> adaptive = {}) {
    RemeshOptions options = edges_of(length);
    options.edge_lengths.adaptive = adaptive;
    try {
      remesh(model, {}, options);
    } catch (const Error& error) {
      return error.code();
    }
    return ExitCode::ok;
  };
  EXPECT_EQ(code(0), ExitCode::usage);
  EXPECT_EQ(code(std::nan("")), ExitCode::usage);
  EXPECT_EQ(code(1, Adaptive{2, 1, 0.1}), ExitCode::usage);
  EXPECT_EQ(code(1, Adaptive{1, 2, 0}), ExitCode::usage);
  // 4 pi 25 mm2 hold 4 pi 25 / (0.433 1e-6) triangles of 1 micrometre.
  EXPECT_EQ(code(1e-3), ExitCode::resources);
  EXPECT_EQ(code(1), ExitCode::ok);
}

/// A ball with a ball of radius `inner` taken out of it, `shift` off the middle.
Model hollow_ball(double inner, double shift) {
  TriangleMesh mesh = tests::icosphere(5, 5);
  const TriangleMesh hole = tests::icosphere(inner, 5, {shift, 0, 0});
  const int first = static_cast<int>(mesh.points.size());
  mesh.points.insert(mesh.points.end(), hole.points.begin(), hole.points.end());
  for (const auto& [a, b, c] : hole.triangles)
    mesh.triangles.push_back({a + first, c + first, b + first});
  return tests::one_face(std::move(mesh));
}

TEST(Remesh, WhereCoarserTrianglesWouldCrossTheOldOnesStay) {
  // Edges of 1.5 mm cut 1.5^2 / 40 = 0.06 mm deep into the wall, which is 0.03 mm thin on one side.
  const Model thin = hollow_ball(4, 0.97);
  ASSERT_TRUE(vessels::self_intersections(thin.mesh).empty());
  const Remeshed result = remesh(thin, {}, edges_of(1.5));
  EXPECT_TRUE(vessels::self_intersections(result.model.mesh).empty());
  EXPECT_TRUE(tests::closed_and_oriented(result.model.mesh));
  std::size_t kept = 0;
  for (std::size_t t = 0; t < result.is_new.size(); ++t) {
    const Vec3 middle = tests::centroid(result.model.mesh, result.model.mesh.triangles[t]);
    if (!result.is_new[t]) {
      ++kept;
      EXPECT_GT(middle.x(), 0);
    }
    const int origin = result.origin[t];
    const Vec3 there =
        tests::centroid(thin.mesh, thin.mesh.triangles[static_cast<std::size_t>(origin)]);
    EXPECT_LT((there - middle).norm(), 0.2);  // its triangles have edges of 0.18 mm
  }
  EXPECT_GT(kept, 0u);
  EXPECT_EQ(kept, result.left);
  EXPECT_GT(result.after.triangles, 300u);

  try {  // thin everywhere
    remesh(hollow_ball(4.97, 0), {}, edges_of(1.5), vessels::LengthUnit::cm);
    FAIL();
  } catch (const Error& error) {
    const std::string line = error.what();
    EXPECT_EQ(line.find("remeshing: "), 0u) << line;
    EXPECT_NE(line.find(" cm"), std::string::npos);
  }
}

TEST(Remesh, RealVessels) {
  struct Case {
    const char* file;
    vessels::LengthUnit unit;
    double edge;
    double deviation;  // mm: thin branches against edges, h^2 / (6 R), and creases of the wall
  };
  for (const Case& one :
       {Case{"coa_patient1/wall_aorta.stl", vessels::LengthUnit::mm, 0.7, 0.15},
        Case{"veingraft_stenosis/capped.vtp", vessels::LengthUnit::cm, 0.8, 0.15},
        Case{"rpa_su201/SU201_2005_RPA1_exterior.vtp", vessels::LengthUnit::mm, 0.3, 0.15}}) {
    const auto path = tests::shared_data(one.file);
    SKIP_WITHOUT(path);
    const Model model = model_of(vessels::read_surface(path, one.unit)).model;
    const Remeshed result = remesh(model, {}, edges_of(one.edge), one.unit);
    const TriangleMesh& mesh = result.model.mesh;
    EXPECT_TRUE(tests::closed_and_oriented(mesh)) << path;
    EXPECT_EQ(tests::euler_characteristic(mesh), 2) << path;
    EXPECT_TRUE(vessels::self_intersections(mesh).empty()) << path;
    EXPECT_GT(share_within_bounds(mesh, one.edge), 0.95) << path;
    EXPECT_GT(result.after.smallest_angle, 20) << path;
    EXPECT_LT(result.deviation, one.deviation) << path;
    EXPECT_LT(std::abs(result.volume_change), 0.01) << path;
    std::set<int> ids(result.model.face_of_triangle.begin(), result.model.face_of_triangle.end());
    EXPECT_EQ(ids.size(), model.faces.size()) << path;
  }
}

}  // namespace
}  // namespace vstent::meshing
