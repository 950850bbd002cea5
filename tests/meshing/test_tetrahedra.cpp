#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "meshing/quality.hpp"
#include "meshing/tetrahedra.hpp"
#include "tests/meshing/blocks.hpp"

namespace vstent::meshing {
namespace {

using tests::block;
using tests::Block;

std::string fault(const Block& b) { return check_partition(b.mesh, b.model.mesh.triangles).fault; }

TEST(Tetrahedra, RegularAndCornerTetrahedraHaveTheirAngles) {
  const std::array<double, 2> regular =
      dihedral_range({1, 1, 1}, {1, -1, -1}, {-1, 1, -1}, {-1, -1, 1});
  const double degrees = 180 / std::numbers::pi;
  EXPECT_NEAR(regular[0], std::acos(1.0 / 3) * degrees, 1e-12);
  EXPECT_NEAR(regular[1], std::acos(1.0 / 3) * degrees, 1e-12);
  const std::array<double, 2> corner = dihedral_range({0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1});
  EXPECT_NEAR(corner[0], std::acos(1 / std::sqrt(3)) * degrees, 1e-12);
  EXPECT_NEAR(corner[1], 90, 1e-12);
  const std::array<double, 2> flat = dihedral_range({0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {1, 1, 0});
  EXPECT_EQ(flat[0], 0);
  EXPECT_EQ(flat[1], 180);
}

TEST(Tetrahedra, FacetsFaceOutward) {
  const TetMesh mesh{{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}}, {{0, 1, 2, 3}}};
  EXPECT_DOUBLE_EQ(signed_volume(mesh, mesh.tetrahedra[0]), 1.0 / 6);
  const Vec3 middle = Vec3::Constant(0.25);
  for (int k = 0; k < 4; ++k) {
    const Triangle f = facet(mesh.tetrahedra[0], k);
    const auto at = [&](std::size_t i) { return mesh.points[static_cast<std::size_t>(f[i])]; };
    EXPECT_GT((at(1) - at(0)).cross(at(2) - at(0)).dot(at(0) - middle), 0) << k;
  }
}

TEST(Tetrahedra, ACubeOfCubesIsAPartition) {
  const Block b = block(3, 0.5);
  const Partition partition = check_partition(b.mesh, b.model.mesh.triangles);
  EXPECT_EQ(partition.fault, "");
  for (std::size_t t = 0; t < b.model.mesh.triangles.size(); ++t) {
    const Tetrahedron& behind = b.mesh.tetrahedra[static_cast<std::size_t>(partition.behind[t])];
    for (const int v : b.model.mesh.triangles[t])
      EXPECT_NE(std::find(behind.begin(), behind.end(), v), behind.end());
  }
  const TetQuality q = quality(b.mesh);
  EXPECT_NEAR(q.volume, 1.5 * 1.5 * 1.5, 1e-13);  // 162 sums, each rounded to 4e-16
  // Each has three mutually orthogonal edges in a row: dihedral angles 45, 60 and 90 degrees.
  EXPECT_NEAR(q.smallest_dihedral, 45, 1e-10);
  EXPECT_NEAR(q.largest_dihedral, 90, 1e-10);
  EXPECT_NEAR(q.dihedral_median, 45, 1e-10);
  EXPECT_EQ(q.below_10, 0u);
  EXPECT_DOUBLE_EQ(q.smallest_edge, 0.5);
  EXPECT_DOUBLE_EQ(q.largest_edge, 0.5 * std::sqrt(3));
  EXPECT_NEAR(q.mean_edge, 0.5 * (3 + 2 * std::sqrt(2) + std::sqrt(3)) / 6, 1e-12);
}

TEST(Tetrahedra, EveryKindOfDamageIsNamed) {
  const Block whole = block(2, 1);
  const auto damaged = [&](auto&& damage) {
    Block b = whole;
    damage(b);
    return fault(b);
  };
  const auto has = [](const std::string& text, const std::string& part) {
    return text.find(part) != std::string::npos;
  };
  EXPECT_PRED2(has, damaged([](Block& b) { b.mesh.tetrahedra.clear(); }), "no tetrahedra");
  EXPECT_PRED2(
      has, damaged([](Block& b) { std::swap(b.mesh.tetrahedra[5][0], b.mesh.tetrahedra[5][1]); }),
      "1 inverted tetrahedron");
  EXPECT_PRED2(has, damaged([](Block& b) { b.mesh.tetrahedra[5][3] = b.mesh.tetrahedra[5][2]; }),
               "1 flat tetrahedron");
  EXPECT_PRED2(has, damaged([](Block& b) { b.mesh.tetrahedra[5][3] = 99; }), "names point 99");
  EXPECT_PRED2(has, damaged([](Block& b) { b.mesh.points.emplace_back(0, 0, 0.5); }),
               "1 point belong to no tetrahedron");
  EXPECT_PRED2(has, damaged([](Block& b) { b.mesh.points[3].x() = std::nan(""); }), "not finite");
  EXPECT_PRED2(has, damaged([](Block& b) { b.model.mesh.triangles.pop_back(); }),
               "1 facets lie open");
  EXPECT_PRED2(has, damaged([](Block& b) {
                 b.model.mesh.triangles.push_back({0, 1, 13});
               }),
               "1 of the surface's triangles are missing");
  EXPECT_PRED2(has, damaged([](Block& b) {
                 std::swap(b.model.mesh.triangles[7][0], b.model.mesh.triangles[7][1]);
               }),
               "1 facets are turned");
  EXPECT_PRED2(has, damaged([](Block& b) { b.mesh.tetrahedra.push_back(b.mesh.tetrahedra[5]); }),
               "more than two sides");
  EXPECT_PRED2(has,
               damaged([](Block& b) { b.mesh.tetrahedra.erase(b.mesh.tetrahedra.begin() + 20); }),
               "lie open");
  // The middle point pushed out of the cube: elements overlap, none is missing.
  EXPECT_PRED2(has, damaged([](Block& b) { b.mesh.points.back() = Vec3(5, 1, 1); }), "inverted");
  // Two cubes side by side.
  EXPECT_PRED2(has, damaged([](Block& b) {
                 const int first = static_cast<int>(b.mesh.points.size());
                 const Block copy = b;
                 for (const Vec3& p : copy.mesh.points) b.mesh.points.push_back(p + Vec3(9, 0, 0));
                 for (Tetrahedron t : copy.mesh.tetrahedra) {
                   for (int& v : t) v += first;
                   b.mesh.tetrahedra.push_back(t);
                 }
                 for (Triangle t : copy.model.mesh.triangles) {
                   for (int& v : t) v += first;
                   b.model.mesh.triangles.push_back(t);
                 }
               }),
               "falls into 2 pieces");
}

TEST(Tetrahedra, ASurfaceEnclosesItsVolumeWhereverItIs) {
  Block b = block(2, 1);
  EXPECT_DOUBLE_EQ(enclosed_volume(b.model.mesh), 8);
  for (Vec3& p : b.model.mesh.points) p += Vec3(1000, -2000, 500);
  EXPECT_DOUBLE_EQ(enclosed_volume(b.model.mesh), 8);
}

}  // namespace
}  // namespace vstent::meshing
