#include "measure/side_branches.hpp"

#include <algorithm>
#include <cmath>
#include <set>

#include "measure/corners.hpp"
#include "measure/loop.hpp"
#include "sdf/polyline.hpp"
#include "sdf/signed_mesh_distance.hpp"

namespace vstent::measure {
namespace {

using vessels::Section;

struct Ostium {
  Section section;
  Vec3 normal;  // along the branch, away from the parent
  double radius = 0;
};

std::optional<Ostium> find_ostium(const CutSurface& before, const vessels::CenterlineBranch& branch,
                                  const vessels::CenterlinePath& way) {
  const std::vector<double> arc = arc_lengths(branch.points);
  const auto inside_parent = [&](const Vec3& x) {
    const PolylinePlace place = nearest_place(way.points, way.arc_length, x);
    const double radius = value_at(way.radii, way.arc_length, place.arc_length);
    return place.squared_distance <= radius * radius;
  };
  std::size_t leaves = 0;
  while (leaves < branch.points.size() && inside_parent(branch.points[leaves])) ++leaves;
  if (leaves >= branch.points.size()) return std::nullopt;

  // The branch's own radius: the median over two diameters from there on.
  std::vector<double> radii;
  for (std::size_t i = leaves; i < arc.size() && arc[i] - arc[leaves] <= 4 * branch.radii[leaves];
       ++i)
    radii.push_back(branch.radii[i]);
  std::nth_element(radii.begin(), radii.begin() + static_cast<std::ptrdiff_t>(radii.size() / 2),
                   radii.end());
  const double radius = radii[radii.size() / 2];
  if (!(radius > 0)) return std::nullopt;

  const std::vector<Vec3> along = tangents(branch.points);
  for (int step = 5; step <= 30; ++step) {
    const double s = arc[leaves] + 0.1 * step * radius;
    if (s > arc.back()) break;
    const auto vertex =
        static_cast<std::size_t>(std::lower_bound(arc.begin(), arc.end(), s) - arc.begin());
    const Vec3 normal = along[std::min(vertex, along.size() - 1)];
    auto section = before.section(point_at(branch.points, arc, s), normal, 3 * radius);
    if (section && section->equivalent_diameter <= 1.5 * 2 * radius)
      return Ostium{*std::move(section), normal, radius};
  }
  return std::nullopt;
}

/// Share (%) of the outline's inside, sampled on a grid, from which the stent lies ahead.
std::optional<double> coverage(const Section& ostium, const Vec3& towards_parent,
                               const Polyline& axis, const TriangleMesh& stent,
                               const sdf::BoxTree& stent_tree) {
  const Vec3 u = towards_parent.unitOrthogonal(), v = towards_parent.cross(u);
  const std::vector<double> arc = arc_lengths(axis);
  const PolylinePlace nearest = nearest_place(axis, arc, ostium.centroid);
  const Vec3 to_axis = point_at(axis, arc, nearest.arc_length) - ostium.centroid;
  const double facing = towards_parent.dot(to_axis.normalized());
  if (!(facing > 0.1)) return std::nullopt;
  const double limit = to_axis.norm() / facing;

  double half = 0;
  for (const Vec3& x : ostium.outline) half = std::max(half, (x - ostium.centroid).norm());
  const auto inside = [&](double a, double b) {
    bool in = false;
    for (std::size_t i = 0; i < ostium.outline.size(); ++i) {
      const Vec3 p = ostium.outline[i] - ostium.centroid;
      const Vec3 q = ostium.outline[(i + 1) % ostium.outline.size()] - ostium.centroid;
      const double pa = p.dot(u), pb = p.dot(v), qa = q.dot(u), qb = q.dot(v);
      if ((pb > b) != (qb > b) && pa + (b - pb) * (qa - pa) / (qb - pb) > a) in = !in;
    }
    return in;
  };
  constexpr int kAcross = 100;  // a hundredth of the diameter, thinner than any strut over it
  int counted = 0, covered = 0;
  for (int i = 0; i < kAcross; ++i) {
    for (int j = 0; j < kAcross; ++j) {
      const double a = half * (2 * (i + 0.5) / kAcross - 1);
      const double b = half * (2 * (j + 0.5) / kAcross - 1);
      if (!inside(a, b)) continue;
      ++counted;
      covered += std::isfinite(sdf::first_crossing(
          stent, stent_tree, ostium.centroid + a * u + b * v, towards_parent, limit));
    }
  }
  if (counted == 0) return std::nullopt;
  return 100.0 * covered / counted;
}

double symmetry(const Section& section) { return section.min_diameter / section.max_diameter; }

}  // namespace

std::vector<SideBranch> measure_side_branches(const CutSurface& before, const CutSurface& after,
                                              bool same_triangles, const Profile& profile,
                                              const vessels::Centerline& centerline,
                                              const vessels::CenterlinePath& way,
                                              const TriangleMesh& stent) {
  const std::set<int> own(way.branch_of_point.begin(), way.branch_of_point.end());
  std::vector<SideBranch> result;
  const sdf::BoxTree stent_tree = sdf::triangle_tree(stent);
  const std::vector<Station>& stations = profile.stations;
  for (const vessels::CenterlineBranch& branch : centerline.branches) {
    if (own.contains(branch.id) || !own.contains(branch.parent) || branch.points.size() < 3)
      continue;
    SideBranch side;
    side.branch = branch.id;
    const std::optional<Ostium> ostium = find_ostium(before, branch, way);
    // Centerlines may run along the parent for long; the ostium says where the branch leaves it.
    const Vec3 root = ostium ? ostium->section.centroid : branch.points.front();
    side.arc_length = nearest_place(way.points, way.arc_length, root).arc_length;
    const double place = (side.arc_length - stations.front().arc_length) / profile.spacing;
    const auto last = static_cast<double>(stations.size() - 1);
    if (place < 0 || place > last) continue;
    side.in_stent = stations[static_cast<std::size_t>(std::lround(place))].in_stent;
    if (ostium) {
      side.symmetry_before = symmetry(ostium->section);
      Vec3 centre = ostium->section.centroid, normal = ostium->normal;
      if (same_triangles) {
        const Loop from = loop(carried(ostium->section, before.surface.mesh.points));
        const Loop to = loop(carried(ostium->section, after.surface.mesh.points));
        side.ostium_before = from.area_vector.norm();
        side.ostium_after = to.area_vector.norm();
        centre = to.centroid;
        // The outline may run either way around.
        normal =
            to.area_vector.normalized() * (from.area_vector.dot(ostium->normal) < 0 ? -1.0 : 1.0);
      } else {
        side.ostium_before = ostium->section.area;
      }
      if (const auto section = after.section(centre, normal, 3 * ostium->radius)) {
        if (!same_triangles) side.ostium_after = section->area;
        side.symmetry_after = symmetry(*section);
        if (!stent.triangles.empty())
          side.coverage = coverage(*section, -normal, profile.axis_after, stent, stent_tree);
      }
    }
    result.push_back(std::move(side));
  }
  return result;
}

}  // namespace vstent::measure
