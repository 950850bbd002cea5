#include <gtest/gtest.h>

#include "meshing/edited_region.hpp"
#include "meshing/quality.hpp"
#include "meshing/smooth.hpp"
#include "tests/meshing/models.hpp"
#include "tests/sdf/meshes.hpp"
#include "tests/sdf/shapes.hpp"
#include "vessels/error.hpp"

namespace vstent::meshing {
namespace {

/// A capped tube of radius 3 whose wall points, but for the rims', are off by up to 0.05 mm.
Model rough_cylinder() {
  TriangleMesh mesh = tests::tube(3, 12, 60, 39);
  tests::Random random(5);
  for (Vec3& p : mesh.points)
    if (p.z() > 0.1 && p.z() < 11.9) p.head<2>() *= 1 + random(-0.05, 0.05) / 3;
  return model_of(vessels::make_surface(mesh, "rough")).model;
}

double roughness(const Model& model) {
  double sum = 0, count = 0;
  for (const Vec3& p : model.mesh.points) {
    if (p.z() < 2 || p.z() > 10) continue;
    sum += std::pow(p.head<2>().norm() - 3, 2);
    ++count;
  }
  return std::sqrt(sum / count);
}

TEST(Smooth, TaubinTakesTheRoughnessAndKeepsTheVolume) {
  const Model rough = rough_cylinder();
  const Smoothed result = smooth(rough, {});
  EXPECT_LT(roughness(result.model), 0.5 * roughness(rough));
  EXPECT_LT(std::abs(result.volume_change), 0.005);
  EXPECT_NEAR(result.volume_change,
              enclosed_volume(result.model.mesh) / enclosed_volume(rough.mesh) - 1, 1e-15);
  EXPECT_LT(result.largest_move, 0.1);  // no farther than the roughness itself
  EXPECT_EQ(result.held, 0u);
  EXPECT_EQ(result.model.mesh.triangles, rough.mesh.triangles);
  for (std::size_t p = 0; p < rough.mesh.points.size(); ++p) {
    const double z = rough.mesh.points[p].z();
    if (z == 0 || z == 12) {
      EXPECT_EQ(result.model.mesh.points[p], rough.mesh.points[p]);
    }
  }
}

TEST(Smooth, StaysWithinItsRegion) {
  const Model rough = rough_cylinder();
  std::vector<char> region;
  for (const Triangle& t : rough.mesh.triangles)
    region.push_back(tests::centroid(rough.mesh, t).z() > 6);
  const Smoothed result = smooth(rough, region);
  std::vector<char> inside(rough.mesh.points.size(), 1);
  for (std::size_t t = 0; t < region.size(); ++t)
    for (const int p : rough.mesh.triangles[t])
      if (!region[t]) inside[static_cast<std::size_t>(p)] = 0;
  std::size_t moved = 0;
  for (std::size_t p = 0; p < inside.size(); ++p) {
    const bool same = result.model.mesh.points[p] == rough.mesh.points[p];
    moved += !same;
    if (!inside[p]) {
      EXPECT_TRUE(same);
    }
  }
  EXPECT_GT(moved, 500u);
}

TEST(Smooth, LaplacianThatShrinksTooMuchIsRefused) {
  const Model ball = tests::one_face(tests::icosphere(3, 4));
  SmoothOptions options;
  options.taubin = false;
  options.iterations = 30;
  try {
    smooth(ball, {}, options);
    FAIL();
  } catch (const Error& error) {
    EXPECT_NE(std::string(error.what()).find("smoothing would change the volume by -"),
              std::string::npos)
        << error.what();
  }
  // With the limit lifted the volume really falls, by what the refusal said.
  options.volume_limit = 1;
  EXPECT_LT(smooth(ball, {}, options).volume_change, -0.005);
  EXPECT_LT(std::abs(smooth(ball, {}).volume_change), 0.005);
}

TEST(EditedRegion, IsWhatMovedAndAMarginAlongEdges) {
  const tests::TemporaryFolder folder;
  const vessels::Surface plain = vessels::make_surface(tests::tube(3, 12, 60, 39), "plain");
  std::vector<double> displacement(3 * plain.mesh.points.size(), 0);
  for (std::size_t p = 0; p < plain.mesh.points.size(); ++p)
    if (std::abs(plain.mesh.points[p].z() - 6) < 1) displacement[3 * p] = 0.1;
  const std::vector<char> still(plain.mesh.points.size(), 0);
  const auto write = [&](const std::string& name, const vessels::Fields& fields) {
    vessels::write_surface(plain, plain.mesh.points, still, folder / name, fields);
    return vessels::read_surface(folder / name, vessels::LengthUnit::mm);
  };
  const vessels::Surface stented = write("stented.vtp", {{"Displacement", displacement}});
  const Model model = model_of(stented).model;
  for (const double margin : {0.0, 2.0}) {
    const std::vector<char> region = edited_region(stented, model, margin);
    ASSERT_EQ(region.size(), model.mesh.triangles.size());
    for (std::size_t t = 0; t < region.size(); ++t) {
      // Edges along z are the shortest way: rings 12/38 mm apart, the last moved ones at 15 and 23.
      double nearest = 1e9;
      for (std::size_t k = 0; k < 3; ++k)
        nearest = std::min(nearest,
                           std::abs(tests::corner(model.mesh, model.mesh.triangles[t], k).z() - 6));
      const bool expected = nearest <= 12.0 / 38 * 3 + margin + 1e-9;
      EXPECT_EQ(region[t] != 0, expected) << nearest;
    }
  }
  const auto refusal = [&](const vessels::Surface& surface) {
    try {
      edited_region(surface, model, 1);
    } catch (const Error& error) {
      return std::string(error.what());
    }
    return std::string();
  };
  EXPECT_NE(refusal(plain).find("no point array Displacement"), std::string::npos);
  const vessels::Surface unmoved =
      write("unmoved.vtp", {{"Displacement", std::vector<double>(displacement.size(), 0)}});
  EXPECT_NE(refusal(unmoved).find("nothing moved"), std::string::npos);
}

}  // namespace
}  // namespace vstent::meshing
