#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <stdexcept>

#include "sdf/polyline.hpp"
#include "vessels/check.hpp"
#include "vessels/idealised.hpp"
#include "vessels/lumen_ends.hpp"

namespace vstent::vessels {
namespace {

double enclosed_volume(const TriangleMesh& open) {
  const TriangleMesh mesh = find_lumen_ends(make_surface(open, "generated")).closed;
  double sum = 0;
  for (const Triangle& t : mesh.triangles) {
    sum += mesh.points[static_cast<std::size_t>(t[0])].dot(
        mesh.points[static_cast<std::size_t>(t[1])].cross(
            mesh.points[static_cast<std::size_t>(t[2])]));
  }
  return sum / 6;
}

TEST(IdealisedVessel, EdgesAreAsLongAsAskedFor) {
  IdealisedVessel vessel;
  vessel.stenosis = 0;
  for (const double edge : {0.3, 0.5, 0.9}) {
    vessel.edge_length = edge;
    const CheckReport report = check(make_surface(idealised_vessel(vessel), "tube"));
    EXPECT_TRUE(report.stentable());
    EXPECT_EQ(report.openings.size(), 2U);
    // Whole numbers of edges around and of rows along: each is off by half a count at most.
    const double rounding =
        0.5 * edge / (2 * std::numbers::pi * vessel.radius) + 0.5 * edge / vessel.length;
    EXPECT_NEAR(report.edge_min, edge, 2 * rounding * edge);
    EXPECT_NEAR(report.edge_max, edge, 2 * rounding * edge);
  }
}

TEST(IdealisedVessel, FacesOutwardAndEnclosesTheSolidOfRevolution) {
  IdealisedVessel vessel;
  vessel.edge_length = 0.3;
  double expected = 0;  // pi * integral of r^2, by the midpoint rule
  const int slices = 6000;
  for (int i = 0; i < slices; ++i) {
    const double r = idealised_radius(vessel, vessel.length * (i + 0.5) / slices);
    expected += std::numbers::pi * r * r * vessel.length / slices;
  }
  // Polygons of n corners, turned by half a corner from row to row: they lack at most (pi / n)^2.
  const double corner = 0.5 * vessel.edge_length / vessel.radius;
  for (const double bend : {0.0, 1.0}) {  // Pappus: bending about the centroid keeps the volume
    vessel.bend_angle = bend;
    const double volume = enclosed_volume(idealised_vessel(vessel));
    EXPECT_LT(volume, expected);
    EXPECT_GT(volume, expected * (1 - 2 * corner * corner));
  }
}

TEST(IdealisedVessel, NarrowsAsItsFormulaSays) {
  IdealisedVessel vessel;
  vessel.stenosis = 0.6;
  const double middle = 0.5 * vessel.length;
  EXPECT_DOUBLE_EQ(idealised_radius(vessel, middle), 0.4 * vessel.radius);
  EXPECT_DOUBLE_EQ(idealised_radius(vessel, middle - 0.25 * vessel.stenosis_length),
                   0.7 * vessel.radius);  // halfway down the cosine
  EXPECT_DOUBLE_EQ(idealised_radius(vessel, middle + 0.5 * vessel.stenosis_length), vessel.radius);
  EXPECT_DOUBLE_EQ(idealised_radius(vessel, 0), vessel.radius);
  for (const Vec3& x : idealised_vessel(vessel).points) {
    EXPECT_NEAR(std::hypot(x.x(), x.y()), idealised_radius(vessel, x.z()), 1e-12);
  }
}

TEST(IdealisedVessel, AnEccentricNarrowingLeavesOneSideStraight) {
  IdealisedVessel vessel;
  vessel.eccentricity = 1;
  for (const Vec3& x : idealised_vessel(vessel).points) {
    const double r = idealised_radius(vessel, x.z());
    EXPECT_NEAR(std::hypot(x.x() - (vessel.radius - r), x.y()), r, 1e-12);
    EXPECT_LE(x.x(), vessel.radius + 1e-12);
  }
}

TEST(IdealisedVessel, ABentAxisKeepsItsLengthAndTurnsByItsAngle) {
  IdealisedVessel vessel;
  for (const double bend : {0.0, 0.5, 1.5, 3.0}) {
    vessel.bend_angle = bend;
    const double spacing = 0.1;
    const Polyline axis = idealised_axis(vessel, spacing);
    EXPECT_EQ(axis.front(), Vec3::Zero());
    for (std::size_t i = 1; i < axis.size(); ++i) {
      EXPECT_LE((axis[i] - axis[i - 1]).norm(), spacing * (1 + 1e-12));
    }
    // A chord h of an arc of curvature k is short by (h k)^2 / 24; the arc is half of the axis.
    const double turn = spacing * bend / (0.5 * vessel.length);
    EXPECT_LE(length(axis), vessel.length * (1 + 1e-12));
    EXPECT_GE(length(axis), vessel.length * (1 - turn * turn / 24 - 1e-12));
    const Vec3 last = (axis.back() - axis[axis.size() - 2]).normalized();
    EXPECT_NEAR((last - Vec3(std::sin(bend), 0, std::cos(bend))).norm(), 0, 1e-9);
  }
}

TEST(IdealisedVessel, TheWallOfABentTubeKeepsItsDistanceFromTheAxis) {
  IdealisedVessel vessel;
  vessel.stenosis = 0;
  vessel.bend_angle = 1.5;
  const double spacing = 0.05;
  const Polyline axis = idealised_axis(vessel, spacing);
  const auto s = arc_lengths(axis);
  for (const Vec3& x : idealised_vessel(vessel).points) {
    // Chords cut h^2 k / 8 into the bend.
    const double sagitta = spacing * spacing * (vessel.bend_angle / (0.5 * vessel.length)) / 8;
    EXPECT_NEAR(std::sqrt(nearest_place(axis, s, x).squared_distance), vessel.radius,
                sagitta + 1e-9);
  }
}

TEST(IdealisedVessel, RefusesWhatIsNoVessel) {
  const auto refused = [](auto&& change) {
    IdealisedVessel vessel;
    change(vessel);
    EXPECT_THROW(idealised_vessel(vessel), std::invalid_argument);
  };
  refused([](IdealisedVessel& v) { v.radius = 0; });
  refused([](IdealisedVessel& v) { v.length = std::nan(""); });
  refused([](IdealisedVessel& v) { v.edge_length = -1; });
  refused([](IdealisedVessel& v) { v.stenosis = 1; });
  refused([](IdealisedVessel& v) { v.eccentricity = 1.5; });
  refused([](IdealisedVessel& v) { v.bend_angle = 0.5 * v.length / v.radius; });
}

}  // namespace
}  // namespace vstent::vessels
