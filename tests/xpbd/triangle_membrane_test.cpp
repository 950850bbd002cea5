// The neo-Hookean membrane against its definition in three dimensions, against plane-stress
// elasticity, and against central differences.
#include <gtest/gtest.h>

#include <cmath>

#include "tests/xpbd/shapes.hpp"
#include "xpbd/kernels.hpp"
#include "xpbd/layout.hpp"
#include "xpbd/membrane_law.hpp"
#include "xpbd/triangle_stiffness.hpp"

namespace vstent::tests {
namespace {

using xpbd::Sheet;

constexpr xpbd::MembraneModel kModel = xpbd::MembraneModel::neo_hookean;

double bulk_over_shear(double nu) { return 2 * (1 + nu) / (3 * (1 - 2 * nu)); }

/// The solid's energy over its shear modulus, at principal stretches.
double solid_energy(double a, double b, double c, double bulk) {
  const double j = a * b * c;
  return 0.5 * ((a * a + b * b + c * c) / std::cbrt(j * j) - 3) + 0.5 * bulk * (j - 1) * (j - 1);
}

/// With the thickness that makes it least, by golden sections of its logarithm.
double thin_energy(double a, double b, double bulk) {
  const double golden = 0.5 * (std::sqrt(5.0) - 1);
  double low = -4, high = 4;
  for (int k = 0; k < 90; ++k) {
    const double left = high - golden * (high - low), right = low + golden * (high - low);
    const bool lower =
        solid_energy(a, b, std::exp(left), bulk) < solid_energy(a, b, std::exp(right), bulk);
    (lower ? high : low) = lower ? right : left;
  }
  return solid_energy(a, b, std::exp(0.5 * (low + high)), bulk);
}

auto law_at(double a, double b, double bulk) {
  return xpbd::stretch_of_sheet<xpbd::OneTriangle>(a * a + b * b - 2, (a * a - 1) * (b * b - 1),
                                                   bulk);
}

TEST(MembraneLaw, IsTheSolidsEnergyWithTheThicknessFree) {
  for (const double nu : {0.0, 0.3, 0.45, 0.499})
    for (const double a : {0.3, 0.9, 1.0, 1.02, 1.7, 4.0})
      for (const double b : {0.3, 0.8, 1.0, 1.1, 2.5}) {
        const double bulk = bulk_over_shear(nu), expected = thin_energy(a, b, bulk);
        // Golden sections end within 1e-8 of the minimum; the energy there is flat.
        EXPECT_NEAR(law_at(a, b, bulk).energy, expected, 1e-11 * (1 + expected) * (1 + bulk))
            << nu << ' ' << a << ' ' << b;
      }
}

// The energy of small strains is their square: no rounding of numbers near 1 is left in it.
TEST(MembraneLaw, KeepsItsDigitsNearRest) {
  const double nu = 0.45, e = 1e-9;
  // Plane stress in units of the shear modulus: (e1^2 + e2^2) + nu / (1 - nu) (e1 + e2)^2.
  const auto law =
      xpbd::stretch_of_sheet<xpbd::OneTriangle>(2 * e + 4 * e, 2 * e * 4 * e, bulk_over_shear(nu));
  EXPECT_NEAR(law.energy / (e * e * (5 + 9 * nu / (1 - nu))), 1, 1e-7);
}

TEST(MembraneLaw, GivesItsOwnDerivatives) {
  const double step = 1e-6;
  for (const double nu : {0.0, 0.45, 0.499})
    for (const double a : {0.6, 1.0, 2.5})
      for (const double b : {0.7, 1.0, 1.3}) {
        const double bulk = bulk_over_shear(nu);
        const auto law = law_at(a, b, bulk);
        const double by_a =
            (law_at(a + step, b, bulk).energy - law_at(a - step, b, bulk).energy) / (2 * step);
        EXPECT_NEAR(law.inverse_square * (1 - law.pressure * b * b) * a, by_a, 1e-8 * (1 + bulk));
      }
}

// Whatever the triangles' shapes are: an even strain is represented exactly.
TEST(TriangleMembrane, HasTheModuliOfAnIsotropicSheetOnAnyTriangles) {
  Mesh mesh = make_patch(9, 9, 0.5);
  std::mt19937 random(3);
  for (Vec3& p : mesh.points) {
    const Vec3 jolt = 0.12 * random_vector(random);
    p += Vec3(jolt.x(), jolt.y(), 0);
    p.x() *= 2;
  }
  double area = 0;
  for (const Triangle& t : mesh.triangles) {
    const auto x = [&](std::size_t k) { return mesh.points[static_cast<std::size_t>(t[k])]; };
    area += 0.5 * (x(1) - x(0)).cross(x(2) - x(0)).norm();
  }
  for (const double nu : {0.0, 0.3, 0.45}) {
    const auto sheet = xpbd::make_sheet(
        mesh.points, mesh.triangles, {},
        xpbd::Membrane{
            .youngs_modulus = 2, .thickness = 0.3, .poisson_ratio = nu, .model = kModel});
    ASSERT_EQ(sheet.triangles.size(), mesh.triangles.size());
    EXPECT_TRUE(sheet.distances.empty());
    const double strain = 1e-5;
    const auto density = [&](double exx, double eyy, double exy) {
      auto places = mesh.points;
      for (Vec3& p : places)
        p = Vec3(p.x() + strain * (exx * p.x() + exy * p.y()),
                 p.y() + strain * (exy * p.x() + eyy * p.y()), 0);
      return energy_at(sheet, places) / (area * strain * strain);
    };
    const double c11 = 0.6 / (1 - nu * nu), c12 = nu * c11, c66 = 0.6 / (2 * (1 + nu));
    EXPECT_NEAR(density(1, 0, 0), c11 / 2, 1e-4 * c11);
    EXPECT_NEAR(density(0, 1, 0), c11 / 2, 1e-4 * c11);
    EXPECT_NEAR(density(1, 1, 0) - density(1, 0, 0) - density(0, 1, 0), c12, 1e-4 * c11);
    EXPECT_NEAR(density(0, 0, 1), 2 * c66, 1e-4 * c11);
  }
}

TEST(TriangleMembrane, SqueezedFlatStaysFinite) {
  const std::vector<Vec3> points{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
  const std::vector<Triangle> triangles{{0, 1, 2}};
  const auto sheet = xpbd::make_sheet(points, triangles, {}, xpbd::Membrane{.model = kModel});
  for (const Vec3& third : {Vec3(0.5, 0, 0), Vec3(0, 0, 0), Vec3(1, 0, 0), Vec3(0.3, 1e-9, 0)}) {
    xpbd::Solver solver(sheet);
    solver.set_positions(std::vector<Vec3>{points[0], points[1], third});
    const auto balance = solver.balance({}, 0);
    EXPECT_TRUE(std::isfinite(balance.energy));
    EXPECT_TRUE(std::isfinite(balance.residual_max));
    solver.step({}, {});
    for (const Vec3& p : solver.positions()) EXPECT_TRUE(p.allFinite());
  }
}

struct OneElement {
  xpbd::TriangleBatch batch;
  std::array<Vec3, 3> corners;

  explicit OneElement(std::mt19937& random) {
    std::vector<Vec3> points{{0, 0, 0}, {1, 0.2, 0}, {0.3, 0.8, 0}};
    const std::vector<Triangle> triangles{{0, 1, 2}};
    const auto sheet = xpbd::make_sheet(points, triangles, {}, xpbd::Membrane{.model = kModel});
    const xpbd::Layout layout = xpbd::make_layout(sheet);
    batch = layout.triangles.front();
    for (std::size_t v = 0; v < 3; ++v) {
      const auto vertex =
          static_cast<std::size_t>(layout.original[static_cast<std::size_t>(batch.vertex[v][0])]);
      // Stretched by a third, so that stress pulls every way and nothing is left out.
      corners[v] = 1.35 * points[vertex] + 0.1 * random_vector(random);
    }
  }

  std::array<Vec3, 3> forces(const std::array<Vec3, 3>& at) const {
    std::vector<xpbd::Slot> places(3), force(3);
    xpbd::TriangleBatch one = batch;
    for (std::size_t v = 0; v < 3; ++v) {
      one.vertex[v].fill(static_cast<int>(v));
      places[v] = {at[v].x(), at[v].y(), at[v].z(), 0};
    }
    xpbd::kernels().add_elastic_forces({{}, {}, std::span(&one, 1), {}}, places.data(),
                                       force.data());
    std::array<Vec3, 3> result;
    for (std::size_t v = 0; v < 3; ++v) result[v] = {force[v].x, force[v].y, force[v].z};
    return result;
  }
};

TEST(TriangleStiffness, IsTheDerivativeOfTheForces) {
  std::mt19937 random(12);
  for (int trial = 0; trial < 20; ++trial) {
    const OneElement element(random);
    const auto stiffness = xpbd::measure_stiffness(element.batch, 0, element.corners);
    ASSERT_GT(stiffness.stress[0], 0);
    ASSERT_GT(stiffness.stress[1], 0);
    for (std::size_t moved = 0; moved < 3; ++moved)
      for (int axis = 0; axis < 3; ++axis) {
        auto ahead = element.corners, behind = element.corners;
        ahead[moved][axis] += 1e-6;
        behind[moved][axis] -= 1e-6;
        const auto force_ahead = element.forces(ahead), force_behind = element.forces(behind);
        for (std::size_t v = 0; v < 3; ++v) {
          const Vec3 measured = (force_behind[v] - force_ahead[v]) / 2e-6;
          Vec3 given = stiffness.strains[v].transpose() * stiffness.strains[moved].col(axis);
          for (std::size_t m = 0; m < 2; ++m)
            given[axis] +=
                stiffness.stress[m] * stiffness.shares[m][v] * stiffness.shares[m][moved];
          EXPECT_LT((measured - given).norm(), 1e-7) << trial;
        }
      }
  }
}

// Slivers have no strain worth measuring: they are springs, and the sheet's stiffness is bounded.
TEST(TriangleMembrane, LeavesSliversToSprings) {
  const std::vector<Vec3> points{{0, 0, 0}, {1, 0, 0}, {0.5, 1e-3, 0}, {0.5, -0.8, 0}};
  const std::vector<Triangle> triangles{{0, 1, 2}, {1, 0, 3}};
  const auto sheet = xpbd::make_sheet(points, triangles, {}, xpbd::Membrane{.model = kModel});
  ASSERT_EQ(sheet.triangles.size(), 1u);
  EXPECT_EQ(sheet.distances.size(), 3u);
  for (const auto& d : sheet.distances) {
    EXPECT_TRUE(d.i == 2 || d.j == 2 || d.rest_length == 1);
    EXPECT_LE(d.stiffness, 10);
  }
}

}  // namespace
}  // namespace vstent::tests
