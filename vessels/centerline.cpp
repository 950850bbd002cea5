#include "vessels/centerline.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "sdf/polyline.hpp"
#include "vessels/error.hpp"
#include "vessels/lumen_ends.hpp"

namespace vstent::vessels {

std::vector<CenterlinePath> paths(const Centerline& centerline, int branch) {
  const auto& branches = centerline.branches;
  const std::size_t count = branches.size();
  std::vector<std::vector<int>> children(count);
  std::vector<int> roots;
  for (const CenterlineBranch& b : branches) {
    (b.parent < 0 ? roots : children[static_cast<std::size_t>(b.parent)]).push_back(b.id);
  }
  const auto mean_radius = [&](int id) {
    const auto& radii = branches[static_cast<std::size_t>(id)].radii;
    double sum = 0;
    for (const double radius : radii) sum += radius;
    return radii.empty() ? 0.0 : sum / static_cast<double>(radii.size());
  };
  for (auto& list : children) {
    std::stable_sort(list.begin(), list.end(),
                     [&](int a, int b) { return mean_radius(a) > mean_radius(b); });
  }

  std::vector<std::vector<int>> ways;
  std::vector<std::vector<int>> stack;
  for (auto root = roots.rbegin(); root != roots.rend(); ++root) stack.push_back({*root});
  while (!stack.empty()) {
    std::vector<int> way = std::move(stack.back());
    stack.pop_back();
    const auto& next = children[static_cast<std::size_t>(way.back())];
    if (next.empty()) {
      if (branch < 0 || std::find(way.begin(), way.end(), branch) != way.end()) {
        ways.push_back(std::move(way));
      }
      continue;
    }
    for (auto child = next.rbegin(); child != next.rend(); ++child) {
      stack.push_back(way);
      stack.back().push_back(*child);
    }
  }

  std::vector<CenterlinePath> result;
  for (const std::vector<int>& way : ways) {
    CenterlinePath path;
    for (const int id : way) {
      const CenterlineBranch& b = branches[static_cast<std::size_t>(id)];
      for (std::size_t i = path.points.empty() ? 0 : 1; i < b.points.size(); ++i) {
        path.points.push_back(b.points[i]);
        path.radii.push_back(i < b.radii.size() ? b.radii[i] : 0.0);
        path.branch_of_point.push_back(id);
      }
    }
    path.arc_length = arc_lengths(path.points);
    result.push_back(std::move(path));
  }
  return result;
}

CenterlinePlace nearest_place(const Centerline& centerline, const Vec3& point) {
  CenterlinePlace nearest;
  nearest.distance = std::numeric_limits<double>::infinity();
  for (const CenterlineBranch& branch : centerline.branches) {
    const std::vector<double> s = arc_lengths(branch.points);
    const PolylinePlace place = vstent::nearest_place(branch.points, s, point);
    const double distance = std::sqrt(place.squared_distance);
    if (distance >= nearest.distance) continue;
    nearest.branch = branch.id;
    nearest.arc_length = place.arc_length;
    nearest.point = point_at(branch.points, s, place.arc_length);
    nearest.radius = branch.radii.empty() ? 0.0 : value_at(branch.radii, s, place.arc_length);
    nearest.distance = distance;
  }
  return nearest;
}

void fill_radii(Centerline& centerline, const Surface& surface) {
  const auto unknown = [](const CenterlineBranch& branch) {
    return std::find(branch.radii.begin(), branch.radii.end(), 0.0) != branch.radii.end();
  };
  if (std::none_of(centerline.branches.begin(), centerline.branches.end(), unknown)) return;
  const auto wall = find_lumen_ends(surface).wall;
  for (CenterlineBranch& branch : centerline.branches) {
    for (std::size_t i = 0; i < branch.radii.size(); ++i) {
      if (branch.radii[i] == 0) branch.radii[i] = wall->closest(branch.points[i]).distance;
    }
  }
}

void write_centerline(const Centerline& centerline, LengthUnit unit,
                      const std::filesystem::path& path) {
  std::vector<Polyline> lines;
  std::vector<double> radii;
  std::vector<double> branch_of_point;
  std::vector<int> ids;
  std::vector<int> parents;
  for (const CenterlineBranch& branch : centerline.branches) {
    lines.push_back(branch.points);
    radii.insert(radii.end(), branch.radii.begin(), branch.radii.end());
    branch_of_point.insert(branch_of_point.end(), branch.points.size(), branch.id);
    ids.push_back(branch.id);
    parents.push_back(branch.parent);
  }
  write_polylines(lines, {{"MaximumInscribedSphereRadius", radii}, {"BranchId", branch_of_point}},
                  {{"BranchId", ids}, {"ParentId", parents}}, path, 1.0 / millimetres_per(unit));
}

}  // namespace vstent::vessels
