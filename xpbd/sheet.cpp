#include "xpbd/sheet.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cassert>
#include <cmath>
#include <cstdint>
#include <numbers>

namespace vstent::xpbd {
namespace {

/// One side of an edge: the triangle's far corner, and whether the triangle runs low -> high along
/// the edge.
struct Side {
  std::uint64_t edge;  // low vertex in the upper half, high vertex in the lower
  int wing;
  bool ascending;
  bool sliver;
  double area;
};

/// An edge of the mesh with the (one or more) triangles on it.
struct MeshEdge {
  int low, high;
  std::span<const Side> sides;
  double squared_length;
  double area, smaller_area, sliver_area;  // of all its triangles, the smaller, and the slivers
};

// A needle's short edge and the hinges beside it would be thousands of times stiffer than the rest
// of the mesh and hold up the whole sheet for a place of a few microns. Area weights therefore stop
// at these shapes; triangles that a mesher would call acceptable (height over a quarter of the
// edge, edges within a factor 3) are not touched.
constexpr double kStiffestAspect = 10;   // (A1 + A2) / l^2; 0.87 for two equilateral triangles
constexpr double kFlattestHinge = 0.25;  // height / l of the flatter of the two triangles
// A triangle of less height over its longest edge has no angle worth holding: a micron's motion
// would swing it.
constexpr double kSliver = 0.1;

bool is_sliver(const Vec3& ab, const Vec3& ac) {
  const double longest = std::max({ab.squaredNorm(), ac.squaredNorm(), (ac - ab).squaredNorm()});
  return !(ab.cross(ac).norm() > kSliver * longest);
}

std::vector<Side> sorted_sides(std::span<const Vec3> points, std::span<const Triangle> triangles) {
  std::vector<Side> sides;
  sides.reserve(3 * triangles.size());
  for (const Triangle& t : triangles) {
    if (t[0] == t[1] || t[1] == t[2] || t[2] == t[0]) continue;
    const auto corner_at = [&](std::size_t k) { return points[static_cast<std::size_t>(t[k])]; };
    const Vec3 ab = corner_at(1) - corner_at(0), ac = corner_at(2) - corner_at(0);
    const double area = 0.5 * ab.cross(ac).norm();
    const bool sliver = is_sliver(ab, ac);
    for (int k = 0; k < 3; ++k) {
      const auto corner = static_cast<std::size_t>(k);
      const int from = t[corner], to = t[(corner + 1) % 3];
      const auto low = static_cast<std::uint64_t>(std::min(from, to));
      const auto high = static_cast<std::uint64_t>(std::max(from, to));
      sides.push_back({low << 32 | high, t[(corner + 2) % 3], from < to, sliver, area});
    }
  }
  std::sort(sides.begin(), sides.end(), [](const Side& a, const Side& b) {
    return a.edge != b.edge ? a.edge < b.edge : a.wing < b.wing;
  });
  return sides;
}

bool has_hinge(const MeshEdge& edge) {
  return edge.sides.size() == 2 && edge.sides[0].wing != edge.sides[1].wing &&
         !edge.sides[0].sliver && !edge.sides[1].sliver;
}

/// `stiffness_of(edge)` gives {distance, bending}; no distance where it is 0.
template <class StiffnessOf>
Sheet build(std::span<const Vec3> points, std::span<const Triangle> triangles,
            std::span<const char> pinned, const StiffnessOf& stiffness_of) {
  assert(pinned.empty() || pinned.size() == points.size());
  Sheet sheet;
  sheet.positions.assign(points.begin(), points.end());
  sheet.inverse_mass.assign(points.size(), 1.0);
  for (std::size_t i = 0; i < pinned.size(); ++i)
    if (pinned[i]) sheet.inverse_mass[i] = 0;

  const std::vector<Side> sides = sorted_sides(points, triangles);
  sheet.distances.reserve(sides.size() / 2 + 1);
  sheet.bendings.reserve(sides.size() / 2 + 1);
  const auto point = [&](int i) -> const Vec3& { return points[static_cast<std::size_t>(i)]; };
  for (std::size_t first = 0, last = 0; first < sides.size(); first = last) {
    while (last < sides.size() && sides[last].edge == sides[first].edge) ++last;
    MeshEdge edge{static_cast<int>(sides[first].edge >> 32),
                  static_cast<int>(sides[first].edge & 0xffffffffu),
                  std::span(sides).subspan(first, last - first),
                  0,
                  0,
                  sides[first].area,
                  0};
    for (const Side& side : edge.sides) {
      edge.area += side.area;
      edge.smaller_area = std::min(edge.smaller_area, side.area);
      if (side.sliver) edge.sliver_area += side.area;
    }
    edge.squared_length = (point(edge.high) - point(edge.low)).squaredNorm();
    const UniformStiffness stiffness = stiffness_of(edge);
    if (stiffness.distance > 0)
      sheet.distances.push_back(
          {edge.low, edge.high, std::sqrt(edge.squared_length), stiffness.distance});
    if (!has_hinge(edge)) continue;
    const std::size_t forward = edge.sides[0].ascending ? 0 : 1;
    BendingConstraint hinge{
        edge.low, edge.high,        edge.sides[forward].wing, edge.sides[1 - forward].wing,
        0,        stiffness.bending};
    hinge.rest_angle = hinge_angle(point(hinge.edge_a), point(hinge.edge_b), point(hinge.wing_a),
                                   point(hinge.wing_b));
    sheet.bendings.push_back(hinge);
  }
  return sheet;
}

}  // namespace

Sheet make_sheet(std::span<const Vec3> points, std::span<const Triangle> triangles,
                 std::span<const char> pinned, const Membrane& membrane) {
  const std::vector<double> modulus(points.size(), membrane.youngs_modulus);
  const std::vector<double> thickness(points.size(), membrane.thickness);
  return make_sheet(points, triangles, pinned, VariableMembrane{modulus, thickness, membrane});
}

Sheet make_sheet(std::span<const Vec3> points, std::span<const Triangle> triangles,
                 std::span<const char> pinned, const VariableMembrane& membrane) {
  assert(membrane.youngs_modulus.size() == points.size());
  assert(membrane.thickness.size() == points.size());
  const double nu = membrane.membrane.poisson_ratio;
  const double limit = membrane.membrane.bending_thickness;
  const bool springs = membrane.membrane.model == MembraneModel::springs;
  const auto mean = [](std::span<const double> values, const auto&... vertices) {
    return (values[static_cast<std::size_t>(vertices)] + ...) / sizeof...(vertices);
  };
  Sheet sheet = build(points, triangles, pinned, [&](const MeshEdge& edge) {
    const double modulus = mean(membrane.youngs_modulus, edge.low, edge.high);
    const double thickness = mean(membrane.thickness, edge.low, edge.high);
    const double stretching = modulus * thickness;
    const double area = springs ? edge.area : edge.sliver_area;
    if (!(edge.squared_length > 0)) return UniformStiffness{stretching * kStiffestAspect, 0};
    const double aspect = std::min(area / edge.squared_length, kStiffestAspect);
    if (!(edge.smaller_area > 0)) return UniformStiffness{stretching * aspect, 0};
    const double bent = limit > 0 ? std::min(limit, thickness) : thickness;
    const double bending = modulus * bent * bent * bent / (12 * (1 - nu * nu));
    const double flatness =
        std::min(1.0, 2 * edge.smaller_area / edge.squared_length / kFlattestHinge);
    return UniformStiffness{stretching * aspect,
                            bending * flatness * flatness * edge.squared_length / edge.area};
  });
  if (springs) return sheet;
  for (const Triangle& t : triangles) {
    const auto point = [&](std::size_t k) { return points[static_cast<std::size_t>(t[k])]; };
    const Vec3 ab = point(1) - point(0), ac = point(2) - point(0);
    if (is_sliver(ab, ac)) continue;
    const double base = ab.norm();
    sheet.triangles.push_back({t, base, ab.dot(ac) / base, ab.cross(ac).norm() / base,
                               mean(membrane.youngs_modulus, t[0], t[1], t[2]) *
                                   mean(membrane.thickness, t[0], t[1], t[2]),
                               nu});
  }
  return sheet;
}

Sheet make_sheet(std::span<const Vec3> points, std::span<const Triangle> triangles,
                 std::span<const char> pinned, const UniformStiffness& stiffness) {
  return build(points, triangles, pinned, [&](const MeshEdge&) { return stiffness; });
}

void support(Sheet& sheet, std::span<const Triangle> triangles, double modulus) {
  std::vector<double> area(sheet.positions.size(), 0.0);
  const auto point = [&](int v) { return sheet.positions[static_cast<std::size_t>(v)]; };
  for (const Triangle& t : triangles) {
    const double third = (point(t[1]) - point(t[0])).cross(point(t[2]) - point(t[0])).norm() / 6;
    for (const int v : t) area[static_cast<std::size_t>(v)] += third;
  }
  for (std::size_t v = 0; v < area.size(); ++v)
    if (sheet.inverse_mass[v] > 0 && area[v] > 0)
      sheet.attachments.push_back({static_cast<int>(v), sheet.positions[v], modulus * area[v]});
}

double hinge_angle(const Vec3& edge_a, const Vec3& edge_b, const Vec3& wing_a, const Vec3& wing_b,
                   std::array<Vec3, 4>* gradient) {
  const Vec3 edge = edge_b - edge_a;
  const Vec3 a = wing_a - edge_a;
  const Vec3 b = wing_b - edge_a;
  const Vec3 normal_a = edge.cross(a);
  const Vec3 normal_b = b.cross(edge);
  const double length = edge.norm();
  if (gradient) {
    gradient->fill(Vec3::Zero());
    const double squared_a = normal_a.squaredNorm(), squared_b = normal_b.squaredNorm();
    if (squared_a > 0 && squared_b > 0) {
      const Vec3 at_wing_a = -length / squared_a * normal_a;
      const Vec3 at_wing_b = -length / squared_b * normal_b;
      const double along_a = a.dot(edge) / (length * length);
      const double along_b = b.dot(edge) / (length * length);
      *gradient = {-(1 - along_a) * at_wing_a - (1 - along_b) * at_wing_b,
                   -along_a * at_wing_a - along_b * at_wing_b, at_wing_a, at_wing_b};
    }
  }
  return std::atan2(0.0 - length * normal_a.dot(b), normal_a.dot(normal_b));
}

}  // namespace vstent::xpbd
