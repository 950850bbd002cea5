#include "flow/lumen_tree.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>

#include "sdf/polyline.hpp"
#include "vessels/centerline_tree.hpp"

namespace vstent::flow {
namespace {

constexpr double kSpacing = 0.3;  // of the branch's mean radius
constexpr double kMmPerCm = 10;

vessels::CenterlinePath alone(const vessels::CenterlineBranch& branch) {
  return {branch.points, branch.radii, std::vector<int>(branch.points.size(), branch.id),
          arc_lengths(branch.points)};
}

/// Areas are filled in linear in diameter between whole sections, constant beyond the outermost.
std::vector<double> filled(const std::vector<double>& arc, const std::vector<double>& area,
                           const std::vector<char>& taken) {
  std::vector<double> known_arc, known_diameter;
  for (std::size_t i = 0; i < arc.size(); ++i) {
    if (!taken[i]) continue;
    known_arc.push_back(arc[i]);
    known_diameter.push_back(std::sqrt(area[i]));
  }
  std::vector<double> result(area);
  for (std::size_t i = 0; i < arc.size(); ++i) {
    if (taken[i]) continue;
    const auto above = std::upper_bound(known_arc.begin(), known_arc.end(), arc[i]);
    double diameter;
    if (above == known_arc.begin()) {
      diameter = known_diameter.front();
    } else if (above == known_arc.end()) {
      diameter = known_diameter.back();
    } else {
      const auto j = static_cast<std::size_t>(above - known_arc.begin());
      const double share = (arc[i] - known_arc[j - 1]) / (known_arc[j] - known_arc[j - 1]);
      diameter = (1 - share) * known_diameter[j - 1] + share * known_diameter[j];
    }
    result[i] = diameter * diameter;
  }
  return result;
}

bool has_section(const BranchSections& branch, std::size_t when) {
  const std::vector<char>& taken = branch.taken[when];
  return std::any_of(taken.begin(), taken.end(), [](char c) { return c != 0; });
}

BranchSections cut_branch(const measure::CutSurface& before, const measure::CutSurface& after,
                          bool same_triangles, const vessels::Centerline& centerline,
                          const vessels::CenterlineBranch& branch) {
  const vessels::CenterlinePath way = alone(branch);
  const double mean_radius = std::accumulate(branch.radii.begin(), branch.radii.end(), 0.0) /
                             static_cast<double>(branch.radii.size());
  const measure::Profile profile =
      measure::sample_profile(before, after, same_triangles, centerline, way, 0,
                              way.arc_length.back(), kSpacing * mean_radius);
  BranchSections result;
  result.parent = branch.parent;
  result.axis_before = profile.axis_before;
  result.axis_after = profile.axis_after;
  for (const measure::Station& s : profile.stations) {
    result.arc.push_back(s.arc_length);
    for (const bool later : {false, true}) {
      const bool whole = later ? s.whole_after() : s.whole_before();
      result.taken[later].push_back(whole);
      result.area[later].push_back(whole ? (later ? s.after : s.before)->area : 0);
    }
  }
  for (std::size_t k = 0; k < 2; ++k)
    if (has_section(result, k))
      result.area[k] = filled(result.arc, result.area[k], result.taken[k]);
  return result;
}

/// Between two forks there may be no room for a section: the diameter is then linear from the
/// parent's last to the first of the widest child; at a vessel's end it is that of the inscribed
/// spheres.
void bridge(LumenTree& tree, const vessels::Centerline& centerline, std::size_t when) {
  for (std::size_t b = 0; b < tree.branches.size(); ++b) {
    BranchSections& branch = tree.branches[b];
    if (has_section(branch, when)) continue;
    std::optional<double> first, last;
    if (branch.parent >= 0)
      first = std::sqrt(tree.branches[static_cast<std::size_t>(branch.parent)].area[when].back());
    bool leaf = true;
    for (const BranchSections& child : tree.branches) {
      if (child.parent != static_cast<int>(b)) continue;
      leaf = false;
      if (has_section(child, when))
        last = std::max(last.value_or(0), std::sqrt(child.area[when].front()));
    }
    const vessels::CenterlineBranch& line = centerline.branches[b];
    const std::vector<double> along = arc_lengths(line.points);
    for (std::size_t i = 0; i < branch.arc.size(); ++i) {
      const double share = branch.arc[i] / branch.arc.back();
      const double inscribed =
          std::sqrt(std::numbers::pi) * value_at(line.radii, along, branch.arc[i]);
      const double diameter = leaf || (!first && !last)
                                  ? inscribed
                                  : (1 - share) * first.value_or(last.value_or(0)) +
                                        share * last.value_or(first.value_or(0));
      branch.area[when][i] = diameter * diameter;
    }
  }
}

/// Joins of a tree of branches, as a graph of its points.
struct PointGraph {
  std::vector<Vec3> points;
  std::vector<double> radii;
  std::vector<std::vector<std::size_t>> joined;

  std::size_t add(const Vec3& point, double radius) {
    points.push_back(point);
    radii.push_back(radius);
    joined.emplace_back();
    return points.size() - 1;
  }
  void join(std::size_t a, std::size_t b) {
    joined[a].push_back(b);
    joined[b].push_back(a);
  }
};

PointGraph graph_of(const vessels::Centerline& centerline) {
  PointGraph graph;
  std::vector<std::size_t> last(centerline.branches.size());
  for (const vessels::CenterlineBranch& branch : centerline.branches) {
    // A branch begins on the last point of its parent.
    std::size_t before = branch.parent < 0 ? graph.add(branch.points[0], branch.radii[0])
                                           : last[static_cast<std::size_t>(branch.parent)];
    for (std::size_t i = 1; i < branch.points.size(); ++i) {
      const std::size_t point = graph.add(branch.points[i], branch.radii[i]);
      graph.join(before, point);
      before = point;
    }
    last[static_cast<std::size_t>(branch.id)] = before;
  }
  return graph;
}

}  // namespace

LumenTree cut_tree(const measure::CutSurface& before, const measure::CutSurface& after,
                   const vessels::Centerline& centerline) {
  const TriangleMesh &a = before.surface.mesh, &b = after.surface.mesh;
  const bool same = a.triangles == b.triangles && a.points.size() == b.points.size();
  LumenTree tree;
  for (const vessels::CenterlineBranch& branch : centerline.branches)
    tree.branches.push_back(cut_branch(before, after, same, centerline, branch));
  for (const std::size_t when : {0u, 1u}) bridge(tree, centerline, when);
  return tree;
}

Network network_of(const LumenTree& tree, When when, const Blood& blood, const LossModel& model) {
  Network network;
  network.blood = blood;
  for (const BranchSections& sections : tree.branches) {
    Branch branch;
    branch.parent = sections.parent;
    for (const double s : sections.arc) branch.lumen.arc.push_back(s / kMmPerCm);
    for (const double a : sections.area[static_cast<std::size_t>(when)])
      branch.lumen.area.push_back(a / (kMmPerCm * kMmPerCm));
    branch.losses = losses_along(branch.lumen, blood, model);
    network.branches.push_back(std::move(branch));
  }
  return network;
}

vessels::Centerline rooted_at(const vessels::Centerline& centerline, const Vec3& inlet) {
  const PointGraph graph = graph_of(centerline);
  std::size_t root = 0;
  double nearest = std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i < graph.points.size(); ++i) {
    if (graph.joined[i].size() != 1) continue;
    const double distance = (graph.points[i] - inlet).norm();
    if (distance < nearest) nearest = distance, root = i;
  }
  if (root == 0) return centerline;
  vessels::AxisTree tree;
  struct Step {
    std::size_t point, from;
    int parent;
  };
  std::vector<Step> open{{root, root, -1}};
  for (std::size_t k = 0; k < open.size(); ++k) {
    const Step step = open[k];
    const int node = tree.add(graph.points[step.point], graph.radii[step.point], step.parent);
    for (const std::size_t next : graph.joined[step.point])
      if (next != step.from) open.push_back({next, step.point, node});
  }
  return vessels::branches_of(tree);
}

}  // namespace vstent::flow
