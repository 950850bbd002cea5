#include <gtest/gtest.h>
#include <oneapi/tbb/global_control.h>

#include <cmath>
#include <numbers>

#include "meshing/cap.hpp"
#include "meshing/layers.hpp"
#include "meshing/quality.hpp"
#include "tests/meshing/models.hpp"
#include "tests/vessels/shapes.hpp"
#include "vessels/check.hpp"
#include "vessels/error.hpp"
#include "vessels/idealised.hpp"

namespace vstent::meshing {
namespace {

using vessels::LengthUnit;

/// A wall with its openings capped: face 1 and one face for each cap.
Model capped(TriangleMesh wall) {
  Model model;
  model.mesh = std::move(wall);
  model.face_of_triangle.assign(model.mesh.triangles.size(), 1);
  model.faces = {{1, "wall", false}};
  for (const Opening& opening : find_openings(model.mesh)) {
    close(model.mesh, opening, LengthUnit::mm);
    const int id = static_cast<int>(model.faces.size()) + 1;
    model.faces.push_back({id, "cap" + std::to_string(id), true});
    model.face_of_triangle.resize(model.mesh.triangles.size(), id);
  }
  return model;
}

/// The core of a convex vessel, filled by a fan from its middle: no mesher needed.
TetMesh fan(const TriangleMesh& core) {
  TetMesh mesh{core.points, {}};
  Vec3 middle = Vec3::Zero();
  for (const Vec3& p : core.points) middle += p / static_cast<double>(core.points.size());
  mesh.points.push_back(middle);
  for (const Triangle& t : core.triangles)
    mesh.tetrahedra.push_back({t[0], t[2], t[1], static_cast<int>(core.points.size())});
  return mesh;
}

double volume(const TetMesh& mesh) { return quality(mesh).volume; }

constexpr int kAround = 48;

TEST(Layers, InATubeHaveTheirClosedForm) {
  // Rings of points on a cylinder: moved along the radius they are an affine image of themselves.
  const TriangleMesh wall = vessels::idealised_vessel({2, 12, 0, 0, 4, 0, 0.3});
  const Model model = capped(wall);
  const Layers layers = grow_layers(model, {3, 0.4, 2.0}, LengthUnit::mm);
  EXPECT_TRUE(layers.warnings.empty());
  EXPECT_EQ(layers.thinned, 0u);
  EXPECT_DOUBLE_EQ(layers.smallest, 0.4);
  EXPECT_DOUBLE_EQ(layers.largest, 0.4);
  // At the ends the outermost triangles, from chord to arc, lean by 2 (1 - cos(pi / 42)) mm over
  // 0.26 mm: the way in the cap's plane is longer by 1 / cos of that, 2.4e-4.
  const double lean = 3e-4;
  const double all = enclosed_volume(model.mesh), shrunk = 0.8 * 0.8;
  EXPECT_NEAR(enclosed_volume(layers.core), shrunk * all, lean * (1 - shrunk) * all);
  EXPECT_NEAR(volume(layers.mesh), (1 - shrunk) * all, lean * (1 - shrunk) * all);
  // Each layer is twice as thick as its neighbour outside: levels at 0, 1, 3 and 7 sevenths.
  std::map<double, std::size_t> levels;
  for (const Vec3& p : layers.mesh.points) {
    const double depth = (2 - p.head<2>().norm()) / 0.4 * 7;
    if (depth > 7.5) continue;  // inside the caps
    ++levels[std::round(depth)];
    const bool end = p.z() < 0.1 || p.z() > 11.9;
    EXPECT_NEAR(depth, std::round(depth), end ? 7 * lean : 1e-9);
  }
  const std::size_t points = wall.points.size();
  EXPECT_EQ(levels,
            (std::map<double, std::size_t>{{0, points}, {1, points}, {3, points}, {7, points}}));
  EXPECT_EQ(layers.mesh.tetrahedra.size(), 3 * 3 * wall.triangles.size());

  const TetMesh whole = joined(layers, fan(layers.core));
  EXPECT_EQ(check_partition(whole, layers.model.mesh.triangles).fault, "");
  EXPECT_NEAR(volume(whole), all, 1e-12 * all);
}

TEST(Layers, KeepTheWallAndStayInTheCapsPlane) {
  TriangleMesh tube = tests::tube(2, 12, kAround, 46);
  for (Vec3& p : tube.points) p.z() += 0.5 * p.x();  // cut obliquely
  const Model model = capped(tube);
  const Layers layers = grow_layers(model, {4, 0.5, 1.2}, LengthUnit::mm);
  EXPECT_EQ(layers.thinned, 0u);
  const Model& grown = layers.model;
  // Walls: the same triangles, the same coordinates.
  const std::vector<Triangle> before = triangles_of(model, 1), after = triangles_of(grown, 1);
  ASSERT_EQ(before.size(), after.size());
  for (std::size_t t = 0; t < before.size(); ++t) {
    for (std::size_t k = 0; k < 3; ++k)
      EXPECT_EQ(tests::corner(model.mesh, before[t], k), tests::corner(grown.mesh, after[t], k));
  }
  for (const auto& [cap, z] : {std::pair{2, -1.0}, {3, -1.0}}) {
    const double height = tests::corner(model.mesh, triangles_of(model, cap)[0], 0).z() -
                          0.5 * tests::corner(model.mesh, triangles_of(model, cap)[0], 0).x();
    for (const Triangle& t : triangles_of(grown, cap)) {
      for (std::size_t k = 0; k < 3; ++k) {
        const Vec3 p = tests::corner(grown.mesh, t, k);
        EXPECT_NEAR(p.z() - 0.5 * p.x(), height, 1e-12) << z;
      }
    }
    EXPECT_NEAR(tests::area_of(grown, cap), tests::area_of(model, cap), 1e-11);
    EXPECT_GT(triangles_of(grown, cap).size(), 4u * 2u * kAround);  // the rings, and what is inside
  }
  const TetMesh whole = joined(layers, fan(layers.core));
  EXPECT_EQ(check_partition(whole, grown.mesh.triangles).fault, "");
}

TEST(Layers, ThinOutWhereTheLumenIsNarrow) {
  // 80 % of 4 mm lost: 0.8 mm are left, while 0.6 mm are asked for from either side.
  const Model model = capped(vessels::idealised_vessel({2, 24, 1.0, 0.8, 8, 0.3, 0.35}));
  const Layers layers = grow_layers(model, {3, 0.6, 1.25}, LengthUnit::mm);
  ASSERT_EQ(layers.warnings.size(), 1u);
  EXPECT_NE(layers.warnings[0].find("thinner than asked for"), std::string::npos);
  EXPECT_GT(layers.thinned, 0u);
  EXPECT_LT(layers.thinned, layers.model.mesh.points.size());
  // A quarter of the way across, along directions that lean by 20 degrees at most.
  EXPECT_LE(layers.smallest, 0.2 / std::cos(0.35));
  EXPECT_GT(layers.smallest, 0.05);
  EXPECT_DOUBLE_EQ(layers.largest, 0.6);
  for (const Tetrahedron& t : layers.mesh.tetrahedra) ASSERT_GT(signed_volume(layers.mesh, t), 0);
  EXPECT_TRUE(vessels::self_intersections(layers.core).empty());
  EXPECT_TRUE(vessels::topology(layers.core).boundary_loops.empty());
  const double all = enclosed_volume(model.mesh);
  EXPECT_NEAR(volume(layers.mesh) + enclosed_volume(layers.core), all, 1e-11 * all);
}

TEST(Layers, AreByDefaultHalfAnEdgeThickInside) {
  const Model model = capped(tests::tube(2, 12, kAround, 46));
  const Layers layers = grow_layers(model, {2, 0, 1.25}, LengthUnit::mm);
  // Edges around, along and across: those of the mesh, evenly everywhere but at the rims.
  const double around = 2 * 2 * std::sin(std::numbers::pi / kAround), along = 12.0 / 45;
  const double mean = (around + along + std::hypot(around, along)) / 3;
  EXPECT_NEAR(layers.median, 0.5 * mean * (1 + 1 / 1.25), 1e-12);
}

TEST(Layers, AreTheSameForAnyNumberOfThreads) {
  const Model model = capped(vessels::idealised_vessel({2, 16, 0.5, 0.7, 6, 0, 0.5}));
  const Layers many = grow_layers(model, {3, 0.5, 1.25}, LengthUnit::mm);
  const oneapi::tbb::global_control one(oneapi::tbb::global_control::max_allowed_parallelism, 1);
  const Layers single = grow_layers(model, {3, 0.5, 1.25}, LengthUnit::mm);
  EXPECT_EQ(many.mesh.points, single.mesh.points);
  EXPECT_EQ(many.mesh.tetrahedra, single.mesh.tetrahedra);
}

TEST(Layers, FiguresOutOfRangeAreRefused) {
  const Model model = capped(tests::tube(2, 12, 12, 10));
  EXPECT_THROW(grow_layers(model, {0, 0.4, 1.25}, LengthUnit::mm), Error);
  EXPECT_THROW(grow_layers(model, {3, -1, 1.25}, LengthUnit::mm), Error);
  EXPECT_THROW(grow_layers(model, {3, 0.4, 0.1}, LengthUnit::mm), Error);
  EXPECT_THROW(grow_layers(model, {3, std::nan(""), 1.25}, LengthUnit::mm), Error);
}

}  // namespace
}  // namespace vstent::meshing
