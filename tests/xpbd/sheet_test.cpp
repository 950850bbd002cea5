// Hinge angles, constraint gradients and the sheet's elastic constants (V4, V13).
#include <gtest/gtest.h>

#include "tests/xpbd/shapes.hpp"

namespace vstent::tests {
namespace {

using xpbd::hinge_angle;

std::array<Vec3, 4> random_hinge(std::mt19937& random) {
  const auto shake = [&] { return Vec3(0.25 * random_vector(random)); };
  return {Vec3(0, 0, 0) + shake(), Vec3(1, 0, 0) + shake(), Vec3(0.5, 0.9, 0) + shake(),
          Vec3(0.5, -0.9, 0) + shake()};
}

TEST(Hinge, GradientMatchesCentralDifferences) {
  std::mt19937 random(1);
  for (int n = 0; n < 200; ++n) {
    std::array<Vec3, 4> p = random_hinge(random), gradient;
    hinge_angle(p[0], p[1], p[2], p[3], &gradient);
    for (std::size_t v = 0; v < 4; ++v)
      for (int axis = 0; axis < 3; ++axis) {
        const double eps = 1e-6;
        auto q = p;
        q[v][axis] += eps;
        const double above = hinge_angle(q[0], q[1], q[2], q[3]);
        q[v][axis] -= 2 * eps;
        const double below = hinge_angle(q[0], q[1], q[2], q[3]);
        // Third derivative of order 1/height^3, times eps^2, plus rounding 1e-16 / eps.
        EXPECT_NEAR(gradient[v][axis], (above - below) / (2 * eps), 1e-7);
      }
  }
}

TEST(Hinge, GradientsCarryNoForceAndNoTorque) {
  std::mt19937 random(2);
  for (int n = 0; n < 100; ++n) {
    std::array<Vec3, 4> p = random_hinge(random), gradient;
    hinge_angle(p[0], p[1], p[2], p[3], &gradient);
    Vec3 force = Vec3::Zero(), torque = Vec3::Zero();
    for (std::size_t v = 0; v < 4; ++v) {
      force += gradient[v];
      torque += p[v].cross(gradient[v]);
    }
    EXPECT_LT(force.norm(), 1e-12);
    EXPECT_LT(torque.norm(), 1e-12);
  }
}

TEST(Hinge, DoesNotPullAlongItsEdge) {
  std::mt19937 random(3);
  for (int n = 0; n < 100; ++n) {
    std::array<Vec3, 4> p = random_hinge(random), gradient;
    hinge_angle(p[0], p[1], p[2], p[3], &gradient);
    for (const Vec3& g : gradient)
      EXPECT_LT(std::abs(g.dot(p[1] - p[0])), 1e-12 * g.norm() * (p[1] - p[0]).norm());
  }
}

TEST(Hinge, IsUnmovedByRigidMotion) {
  std::mt19937 random(3);
  for (int n = 0; n < 100; ++n) {
    auto p = random_hinge(random);
    const double angle = hinge_angle(p[0], p[1], p[2], p[3]);
    const Eigen::Quaterniond turn = random_rotation(random);
    const Vec3 shift = 1e3 * random_vector(random);
    for (Vec3& x : p) x = turn * x + shift;
    EXPECT_NEAR(hinge_angle(p[0], p[1], p[2], p[3]), angle, 1e-9);  // 1e3 * 1e-16 over unit edges
  }
}

TEST(Hinge, ChangesSignThroughFlatAndReachesPi) {
  for (double angle : {-3.0, -1.0, -1e-7, 0.0, 1e-7, 1.0, 3.0}) {
    // wing_b swings away from the normal (+z) for positive angles.
    const Vec3 wing_b(0.5, -std::cos(angle), -std::sin(angle));
    EXPECT_NEAR(hinge_angle({0, 0, 0}, {1, 0, 0}, {0.5, 1, 0}, wing_b), angle, 1e-14);
  }
  EXPECT_NEAR(std::abs(hinge_angle({0, 0, 0}, {1, 0, 0}, {0.5, 1, 0}, {0.5, 1, 0})),
              std::numbers::pi, 1e-14);
}

TEST(MakeSheet, HasOneDistancePerEdgeAndOneHingePerInteriorEdge) {
  const Mesh mesh = make_patch(6, 5, 0.5);
  const auto sheet = xpbd::make_sheet(mesh.points, mesh.triangles, mesh.pinned, xpbd::Membrane{});
  const auto edges = mesh.points.size() + mesh.triangles.size() - 1;  // Euler, a disc
  const auto rim = 2 * edges - 3 * mesh.triangles.size();
  EXPECT_EQ(sheet.distances.size(), edges);
  EXPECT_EQ(sheet.bendings.size(), edges - rim);
  for (const auto& b : sheet.bendings) EXPECT_NEAR(b.rest_angle, 0, 1e-15);
}

TEST(MakeSheet, OrientsHingesByTheTriangles) {
  const std::vector<Vec3> octahedron{{1, 0, 0},  {-1, 0, 0}, {0, 1, 0},
                                     {0, -1, 0}, {0, 0, 1},  {0, 0, -1}};
  const std::vector<Triangle> outward{{0, 2, 4}, {2, 1, 4}, {1, 3, 4}, {3, 0, 4},
                                      {2, 0, 5}, {1, 2, 5}, {3, 1, 5}, {0, 3, 5}};
  const auto sheet =
      xpbd::make_sheet(octahedron, outward, std::vector<char>(6, 0), xpbd::Membrane{});
  ASSERT_EQ(sheet.bendings.size(), 12u);
  for (const auto& b : sheet.bendings) EXPECT_NEAR(b.rest_angle, std::acos(1.0 / 3), 1e-14);
}

TEST(MakeSheet, GivesSliversNoHingeAndBoundedStiffness) {
  const std::vector<Vec3> points{{0, 0, 0},    {1, 0, 0},      {0.5, 0, 0}, {0.5, 1, 0},
                                 {0.5, -1, 0}, {0.5, 1e-3, 0}, {0.5, 1, 0}};
  const std::vector<Triangle> triangles{{0, 1, 3}, {1, 0, 4}, {0, 2, 1},
                                        {2, 5, 3}, {3, 6, 0}, {1, 1, 4}};
  const auto sheet =
      xpbd::make_sheet(points, triangles, std::vector<char>(points.size(), 0), xpbd::Membrane{});
  for (const auto& d : sheet.distances) {
    EXPECT_TRUE(std::isfinite(d.stiffness));
    EXPECT_LE(d.stiffness, 10.0);
  }
  for (const auto& b : sheet.bendings) EXPECT_TRUE(std::isfinite(b.stiffness));
}

TEST(Membrane, HasTheModuliOfAnIsotropicSheetWithPoissonOneThird) {
  const Mesh mesh = make_patch(21, 25, 0.5);
  const xpbd::Membrane membrane{.youngs_modulus = 2, .thickness = 0.3};
  const auto sheet = xpbd::make_sheet(mesh.points, mesh.triangles, mesh.pinned, membrane);
  const double area = static_cast<double>(mesh.triangles.size()) * std::sqrt(3.0) / 4 * 0.25;
  const double strain = 1e-5;
  const auto density = [&](double exx, double eyy, double exy) {
    auto places = mesh.points;
    for (Vec3& p : places)
      p = Vec3(p.x() + strain * (exx * p.x() + exy * p.y()),
               p.y() + strain * (exy * p.x() + eyy * p.y()), 0);
    return energy_at(sheet, places) / (area * strain * strain);
  };
  // E t = 0.6 and nu = 1/3: C11 = E t / (1 - nu^2), C12 = nu C11, C66 = E t / (2 (1 + nu)). An
  // affine strain is the lattice's equilibrium, so the energies are exact up to the strain itself;
  // V13 asks for 1 %.
  const double et = 0.6, c11 = 1.125 * et, c12 = c11 / 3, c66 = 0.375 * et;
  EXPECT_NEAR(density(1, 0, 0), c11 / 2, 0.001 * c11);
  EXPECT_NEAR(density(0, 1, 0), c11 / 2, 0.001 * c11);
  EXPECT_NEAR(density(1, 1, 0) - density(1, 0, 0) - density(0, 1, 0), c12, 0.001 * c11);
  EXPECT_NEAR(density(0, 0, 1), 2 * c66, 0.001 * c11);  // engineering shear 2
}

TEST(Membrane, BendsToACylinderWithThePlatesModulus) {
  const Mesh mesh = make_patch(41, 41, 0.25);
  const xpbd::Membrane membrane{.youngs_modulus = 1, .thickness = 0.5, .poisson_ratio = 0.45};
  auto sheet = xpbd::make_sheet(mesh.points, mesh.triangles, mesh.pinned, membrane);
  sheet.distances
      .clear();  // rolling a triangle changes lengths by (h / R)^2 / 24; only the angles count here
  const double plate = 0.125 / (12 * (1 - 0.45 * 0.45));
  const double area =
      static_cast<double>(sheet.bendings.size()) * 2 / 3 * std::sqrt(3.0) / 4 * 0.0625;
  for (const bool along_x : {true, false}) {
    const double radius = 20;
    auto places = mesh.points;
    for (Vec3& p : places) {
      double& rolled = along_x ? p.x() : p.y();
      p.z() = radius * (1 - std::cos(rolled / radius));
      rolled = radius * std::sin(rolled / radius);
    }
    const double expected = 0.5 * plate / (radius * radius) * area;
    // The rim's hinges are missing, in unequal numbers by direction: 2 rows of 41.
    EXPECT_NEAR(energy_at(sheet, places) / expected, 1, along_x ? 0.02 : 0.05);
  }
}

class WallModel : public testing::TestWithParam<xpbd::MembraneModel> {};
INSTANTIATE_TEST_SUITE_P(All, WallModel,
                         testing::Values(xpbd::MembraneModel::springs,
                                         xpbd::MembraneModel::neo_hookean),
                         [](const auto& model) {
                           return model.param == xpbd::MembraneModel::springs ? "Springs"
                                                                              : "NeoHookean";
                         });

TEST_P(WallModel, IsAtRestAtRestAndUnmovedByRigidMotion) {
  const Mesh mesh = make_tube({.length = 10, .narrowing = 0.4, .jitter = 0.2});
  xpbd::Sheet sheet = xpbd::make_sheet(mesh.points, mesh.triangles, mesh.pinned,
                                       xpbd::Membrane{.model = GetParam()});
  EXPECT_LT(energy_at(sheet, mesh.points), 1e-20);
  std::mt19937 random(5);
  auto bent = mesh.points;
  for (Vec3& p : bent) p += 0.1 * random_vector(random);
  const double energy = energy_at(sheet, bent);
  const Eigen::Quaterniond turn = random_rotation(random);
  for (Vec3& p : bent) p = turn * p + Vec3(300, -200, 1000);
  EXPECT_NEAR(energy_at(sheet, bent) / energy, 1, 1e-9);

  xpbd::scale_masses(sheet, 1, 0.5);
  xpbd::Solver solver(sheet);
  for (int step = 0; step < 200; ++step) solver.step({}, {.iterations = 3});
  for (std::size_t i = 0; i < mesh.points.size(); ++i)
    EXPECT_LT((solver.positions()[i] - mesh.points[i]).norm(), 1e-11);
}

TEST(MakeSheet, AMembraneMayChangeFromPlaceToPlace) {
  const Mesh mesh = make_patch(9, 7, 1.0);
  const xpbd::Membrane even{.youngs_modulus = 2, .thickness = 0.5};
  const xpbd::Sheet reference = xpbd::make_sheet(mesh.points, mesh.triangles, {}, even);
  std::vector<double> modulus(mesh.points.size(), 2.0), thickness(mesh.points.size(), 0.5);
  const auto varied = [&] {
    return xpbd::make_sheet(mesh.points, mesh.triangles, {},
                            xpbd::VariableMembrane{modulus, thickness, even});
  };
  const xpbd::Sheet same = varied();
  ASSERT_EQ(same.distances.size(), reference.distances.size());
  for (std::size_t k = 0; k < same.distances.size(); ++k)
    EXPECT_EQ(same.distances[k].stiffness, reference.distances[k].stiffness);
  // Stretching goes with E t, bending with E t^3, of the mean of an edge's ends.
  for (std::size_t v = 0; v < mesh.points.size(); ++v) {
    thickness[v] *= 1 + 0.1 * mesh.points[v].x();
    modulus[v] *= 1 + 0.2 * mesh.points[v].y();
  }
  const xpbd::Sheet other = varied();
  const auto mid = [&](int i, int j) {
    return Vec3(0.5 * (mesh.points[static_cast<std::size_t>(i)] +
                       mesh.points[static_cast<std::size_t>(j)]));
  };
  for (std::size_t k = 0; k < other.distances.size(); ++k) {
    const auto& d = other.distances[k];
    const Vec3 at = mid(d.i, d.j);
    EXPECT_NEAR(d.stiffness / reference.distances[k].stiffness,
                (1 + 0.1 * at.x()) * (1 + 0.2 * at.y()), 1e-12);
  }
  for (std::size_t k = 0; k < other.bendings.size(); ++k) {
    const auto& b = other.bendings[k];
    const Vec3 at = mid(b.edge_a, b.edge_b);
    EXPECT_NEAR(b.stiffness / reference.bendings[k].stiffness,
                std::pow(1 + 0.1 * at.x(), 3) * (1 + 0.2 * at.y()), 1e-12);
  }
}

}  // namespace
}  // namespace vstent::tests
