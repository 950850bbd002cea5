#include <gtest/gtest.h>

#include <map>

#include "meshing/edit_mesh.hpp"
#include "tests/sdf/meshes.hpp"
#include "tests/sdf/shapes.hpp"
#include "tests/vessels/shapes.hpp"
#include "vessels/check.hpp"

namespace vstent::meshing {
namespace {

EditMesh edited(const TriangleMesh& mesh) {
  return {mesh.points, mesh.triangles, std::vector<int>(mesh.triangles.size(), 1)};
}

TriangleMesh living(const EditMesh& mesh) {
  TriangleMesh result{mesh.points, {}};
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t)
    if (mesh.triangle_lives[t]) result.triangles.push_back(mesh.triangles[t]);
  return result;
}

int euler_characteristic(const EditMesh& mesh) {
  int vertices = 0, edges = 0, triangles = 0;
  for (const char lives : mesh.vertex_lives) vertices += lives;
  for (const char lives : mesh.triangle_lives) triangles += lives;
  for (int h = 0; h < mesh.half_edges(); ++h) edges += mesh.lives(h) && mesh.twin(h) < h;
  return vertices - edges + triangles;
}

/// The slow twin: neighbours found by looking at all triangles.
void expect_consistent(const EditMesh& mesh) {
  std::map<std::pair<int, int>, int> half_edge;
  std::map<int, int> triangles_at;
  for (int h = 0; h < mesh.half_edges(); ++h) {
    if (!mesh.lives(h)) continue;
    ASSERT_TRUE(half_edge.try_emplace({mesh.from(h), mesh.to(h)}, h).second) << "edge given twice";
    ++triangles_at[mesh.from(h)];
  }
  for (const auto& [ends, h] : half_edge) {
    const auto opposite = half_edge.find({ends.second, ends.first});
    ASSERT_EQ(mesh.twin(h), opposite == half_edge.end() ? -1 : opposite->second);
  }
  std::vector<int> ring;
  for (std::size_t v = 0; v < mesh.points.size(); ++v) {
    if (!mesh.vertex_lives[v]) continue;
    mesh.leaving(static_cast<int>(v), ring);
    ASSERT_EQ(static_cast<int>(ring.size()), triangles_at[static_cast<int>(v)]);
    for (const int h : ring) ASSERT_EQ(mesh.from(h), static_cast<int>(v));
  }
}

/// The link condition by sets: the ends of the edge have exactly the two apices in common.
bool may_collapse(const EditMesh& mesh, int h) {
  if (mesh.twin(h) < 0 || mesh.on_border(mesh.from(h))) return false;
  std::vector<int> ring;
  int common = 0;
  for (std::size_t v = 0; v < mesh.points.size(); ++v) {
    const int x = static_cast<int>(v);
    if (!mesh.vertex_lives[v] || x == mesh.from(h) || x == mesh.to(h)) continue;
    common += mesh.joined(mesh.from(h), x, ring) && mesh.joined(x, mesh.to(h), ring);
  }
  for (const int top : {mesh.apex(h), mesh.apex(mesh.twin(h))}) {
    mesh.leaving(top, ring);
    if (ring.size() <= (mesh.on_border(top) ? 1u : 3u)) return false;
  }
  return common == 2;
}

TEST(EditMesh, RandomOperationsKeepItAManifold) {
  for (const TriangleMesh& start : {tests::icosphere(1, 1), tests::tube(1, 3, 8, 6)}) {
    EditMesh mesh = edited(start);
    const int characteristic = euler_characteristic(mesh);
    tests::Random random(7);
    int splits = 0, flips = 0, collapses = 0;
    std::vector<int> ring;
    for (int i = 0; i < 600; ++i) {
      const int h = static_cast<int>(random(0, mesh.half_edges()));
      if (!mesh.lives(h)) continue;
      const int g = mesh.twin(h);
      const double choice = random(0, 3.2);
      if (choice < 1) {
        mesh.split(h, 0.5 * (mesh.at(mesh.from(h)) + mesh.at(mesh.to(h))));
        ++splits;
      } else if (choice < 2) {
        if (g < 0 || mesh.joined(mesh.apex(h), mesh.apex(g), ring)) continue;
        mesh.flip(h);
        ++flips;
      } else if (may_collapse(mesh, h)) {
        mesh.collapse(h);
        ++collapses;
      }
      expect_consistent(mesh);
      if (::testing::Test::HasFatalFailure()) return;
    }
    EXPECT_GT(std::min({splits, flips, collapses}), 50);
    EXPECT_EQ(euler_characteristic(mesh), characteristic);
    EXPECT_TRUE(vessels::topology(living(mesh)).non_manifold_edges.empty());
    EXPECT_TRUE(vessels::topology(living(mesh)).inconsistent_edges.empty());
  }
}

}  // namespace
}  // namespace vstent::meshing
