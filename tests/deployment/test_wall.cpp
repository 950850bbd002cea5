// What the wall is made of, and the coarser walls that it grows on.
#include <gtest/gtest.h>

#include <map>
#include <set>

#include "deployment/setup.hpp"
#include "deployment/wall_levels.hpp"
#include "tests/data.hpp"
#include "tests/deployment/whole_run.hpp"
#include "vessels/error.hpp"
#include "vessels/file_arrays.hpp"
#include "vessels/idealised.hpp"

namespace vstent::deployment {
namespace {

using nlohmann::json;

std::size_t at(int i) { return static_cast<std::size_t>(i); }

/// A tube of 30 mm around 5 mm whose open ends are pinned.
WallMesh tube() {
  vessels::IdealisedVessel vessel;
  vessel.length = 30;
  vessel.stenosis_length = 20;
  vessel.bend_angle = 0.7;
  const TriangleMesh mesh = vessels::idealised_vessel(vessel);
  std::map<std::pair<int, int>, int> sides;
  for (const Triangle& t : mesh.triangles)
    for (std::size_t k = 0; k < 3; ++k) ++sides[std::minmax(t[k], t[(k + 1) % 3])];
  WallMesh wall{mesh.points, mesh.triangles, std::vector<char>(mesh.points.size(), 0), {}};
  for (const auto& [edge, count] : sides)
    if (count == 1) wall.pinned[at(edge.first)] = wall.pinned[at(edge.second)] = 1;
  for (std::size_t v = 0; v < mesh.points.size(); ++v) {
    wall.material.youngs_modulus.push_back(1 + static_cast<double>(v));
    wall.material.thickness.push_back(2 + static_cast<double>(v));
  }
  return wall;
}

TEST(CoarseWall, IsATubeOfEvenTrianglesThatFacesOutwards) {
  const WallMesh fine = tube();
  constexpr double kSpacing = 1.5;
  const WallMesh coarse = coarsened(fine, kSpacing);
  std::set<std::pair<int, int>> edges;
  std::set<int> used;
  double shortest = 1e9;
  for (const Triangle& t : coarse.triangles)
    for (std::size_t k = 0; k < 3; ++k) {
      used.insert(t[k]);
      edges.insert(std::minmax(t[k], t[(k + 1) % 3]));
      const double length = (coarse.points[at(t[k])] - coarse.points[at(t[(k + 1) % 3])]).norm();
      shortest = std::min(shortest, length);
      // Every vertex lies within the spacing of its seed, neighbours one fine edge apart.
      EXPECT_LE(length, 2 * kSpacing + 0.6);
    }
  EXPECT_EQ(used.size(), coarse.points.size());
  // Seeds are further apart than the spacing along edges, which zigzag: by up to 2 / sqrt 3 on
  // equilateral triangles, by up to sqrt 2 where the narrowing has made them right-angled.
  EXPECT_GT(shortest, kSpacing / std::sqrt(2.0));
  // Euler's characteristic of an open tube.
  EXPECT_EQ(static_cast<long>(used.size()) - static_cast<long>(edges.size()) +
                static_cast<long>(coarse.triangles.size()),
            0);
  const std::map<std::array<double, 3>, std::size_t> number = [&] {
    std::map<std::array<double, 3>, std::size_t> all;
    for (std::size_t v = 0; v < fine.points.size(); ++v)
      all[{fine.points[v].x(), fine.points[v].y(), fine.points[v].z()}] = v;
    return all;
  }();
  for (std::size_t v = 0; v < coarse.points.size(); ++v) {
    const Vec3& p = coarse.points[v];
    const std::size_t same = number.at({p.x(), p.y(), p.z()});
    EXPECT_EQ(coarse.pinned[v], fine.pinned[same]);
    EXPECT_EQ(coarse.material.youngs_modulus[v], fine.material.youngs_modulus[same]);
    EXPECT_EQ(coarse.material.thickness[v], fine.material.thickness[same]);
  }
}

TEST(CoarseWall, CarriesRigidMotionsExactly) {
  WallMesh fine = tube();
  const WallMesh coarse = coarsened(fine, 1.5);
  std::fill(fine.pinned.begin(), fine.pinned.end(), 0);
  const Eigen::AngleAxisd turn(0.8, Vec3(1, 2, -1).normalized());
  const Vec3 shift(3, -7, 11);
  std::vector<Vec3> moved;
  for (const Vec3& p : coarse.points) moved.push_back(turn * p + shift);
  const std::vector<Vec3> carried = Prolongation(coarse, fine)(moved);
  for (std::size_t v = 0; v < fine.points.size(); ++v)
    EXPECT_LT((carried[v] - (turn * fine.points[v] + shift)).norm(), 1e-10);
}

TEST(CoarseWall, LevelsGoDownToTheCoarsest) {
  EXPECT_TRUE(level_spacings(5000, 0.4).empty());
  for (const std::size_t vertices : {7'000, 30'000, 90'000, 1'000'000}) {
    const std::vector<double> spacings = level_spacings(vertices, 0.2);
    ASSERT_FALSE(spacings.empty());
    // As many vertices as area allows: 1,500 on the coarsest.
    const double ratio = spacings.front() / 0.2;
    EXPECT_NEAR(static_cast<double>(vertices) / (ratio * ratio), 1500, 1e-6 * 1500);
    double finer = 0.2;
    for (std::size_t level = spacings.size(); level-- > 0; finer = spacings[level]) {
      EXPECT_GT(spacings[level] / finer, 1.3);
      EXPECT_LE(spacings[level] / finer, 4);  // three and a little, so that levels stay few
    }
  }
}

Case vein_case(const std::filesystem::path& surface, const json& wall) {
  const json specification = {
      {"vessel", {{"surface", surface.string()}, {"units", "cm"}}},
      {"stent", {{"at", {-5.14, -0.96, 11.02}}, {"length", "3cm"}, {"diameter", "1.6cm"}}},
      {"wall", wall}};
  return parse_case(specification, "test", "/");
}

TEST(WallMaterial, IsThatOfTheVesselFileVertexByVertex) {
  const auto surface = tests::shared_data("veingraft_stenosis/svFSI_var_wall_props.vtp");
  SKIP_WITHOUT(surface);
  const deployment::Setup setup =
      prepare(vein_case(surface, {{"thickness_array", "Thickness"},
                                  {"modulus_array", "Elasticity_modulus"},
                                  {"modulus_unit", "dyn/cm2"}}));
  const vessels::Fields fields = vessels::vertex_fields(setup.surface);
  ASSERT_EQ(setup.material.thickness.size(), setup.region.vertices.size());
  double thinnest = 1e9, thickest = 0;
  for (std::size_t i = 0; i < setup.region.vertices.size(); ++i) {
    const std::size_t v = at(setup.region.vertices[i]);
    EXPECT_DOUBLE_EQ(setup.material.thickness[i], 10 * fields.at("Thickness")[v]);  // cm
    EXPECT_DOUBLE_EQ(setup.material.youngs_modulus[i], 1e-7 * fields.at("Elasticity_modulus")[v]);
    thinnest = std::min(thinnest, setup.material.thickness[i]);
    thickest = std::max(thickest, setup.material.thickness[i]);
  }
  EXPECT_LT(thinnest, 0.8 * thickest);
  EXPECT_TRUE(deploy(setup).converged);
}

TEST(WallMaterial, AnArrayThatIsNotThereIsRefusedWithThoseThatAre) {
  const auto surface = tests::shared_data("veingraft_stenosis/svFSI_var_wall_props.vtp");
  SKIP_WITHOUT(surface);
  try {
    prepare(vein_case(surface, {{"thickness_array", "thickness"}}));
    FAIL() << "accepted";
  } catch (const Error& error) {
    EXPECT_EQ(error.code(), ExitCode::input_file);
    const std::string line = error.what();
    EXPECT_NE(line.find("no point array \"thickness\" (/wall/thickness_array)"), std::string::npos)
        << line;
    EXPECT_NE(line.find("Thickness"), std::string::npos) << line;
  }
}

}  // namespace
}  // namespace vstent::deployment
