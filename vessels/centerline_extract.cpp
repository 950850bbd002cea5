#include <algorithm>
#include <cmath>
#include <numeric>

#include "sdf/polyline.hpp"
#include "vessels/centerline.hpp"
#include "vessels/centerline_tree.hpp"
#include "vessels/error.hpp"
#include "vessels/lumen_ends.hpp"
#include "vessels/lumen_lattice.hpp"
#include "vessels/text.hpp"

namespace vstent::vessels {
namespace {

constexpr double kNodesPerSmallestRadius = 4.0;  // of an end; a stenosis may need more and gets it
constexpr int kRefinements = 5;  // halvings of the spacing before a lumen counts as closed
constexpr std::size_t kNodeLimit = 5'000'000;
constexpr std::size_t kInsideCandidates = 2000;  // tried for a point inside a closed lumen
constexpr double kParting = 0.05;  // of the local radius: farther apart, two ways have parted
constexpr double kRunUp =
    3.0;  // radii before the parting of lattice paths where a way is searched anew
constexpr double kNodesPerRadius = 5.0;  // of the tree that is smoothed
constexpr double kSmoothing = 0.45;      // width of the smoothing, in local radii

[[noreturn]] void fail(const Surface& surface, const std::string& what) {
  throw Error(ExitCode::geometry, surface.path + ": " + what);
}

/// A point inside the lumen, half a radius behind the end.
Vec3 behind(const LumenEnd& end) { return end.centre - 0.5 * end.radius * end.outward; }

/// A way from the inlet to an end: lattice nodes to start with, then the centred line.
struct Way {
  std::size_t end = 0;
  std::vector<int> nodes;
  Polyline lattice_line;  // their positions
  Polyline line;          // centred, from the inlet's centre to the end's
  std::vector<int> tree_nodes;
};

/// The lattice's ways to every end but the inlet; no nodes for an end that it does not reach.
std::vector<Way> ways_through(LumenLattice& lattice, const LumenEnds& lumen, std::size_t inlet,
                              double spacing) {
  std::vector<LumenLattice::Target> targets;
  std::vector<Way> ways;
  for (std::size_t e = 0; e < lumen.ends.size(); ++e) {
    if (e == inlet) continue;
    const LumenEnd& end = lumen.ends[e];
    targets.push_back({behind(end), std::max(0.3 * end.radius, spacing)});
    ways.push_back({e, {}, {}, {}, {}});
  }
  const std::vector<int> arrivals = lattice.grow(behind(lumen.ends[inlet]), targets, kNodeLimit);
  for (std::size_t w = 0; w < ways.size(); ++w) {
    if (arrivals[w] < 0) continue;
    ways[w].nodes = lattice.path_to(arrivals[w]);
    for (const int node : ways[w].nodes) ways[w].lattice_line.push_back(lattice.position(node));
  }
  return ways;
}

/// The ways at the coarsest spacing that reaches all ends.
std::vector<Way> lattice_ways(const Surface& surface, const LumenEnds& lumen, std::size_t inlet) {
  double smallest = lumen.ends.front().radius;
  for (const LumenEnd& end : lumen.ends) smallest = std::min(smallest, end.radius);
  const ClosedLumen closed(lumen.closed);
  double spacing = smallest / kNodesPerSmallestRadius;
  std::string unreached;
  std::vector<Way> ways;
  for (int refinement = 0; refinement <= kRefinements; ++refinement, spacing *= 0.5) {
    LumenLattice lattice(closed, spacing);
    try {
      ways = ways_through(lattice, lumen, inlet, spacing);
    } catch (const Error&) {
      if (refinement == 0) throw;
      break;  // the coarser lattices say what is wrong
    }
    unreached.clear();
    for (const Way& way : ways) {
      if (!way.nodes.empty()) continue;
      unreached += (unreached.empty() ? "" : ", ") + place(lumen.ends[way.end].centre);
    }
    if (unreached.empty()) return ways;
  }
  fail(surface, "the lumen is not connected from the inlet at " + place(lumen.ends[inlet].centre) +
                    " mm to the end at " + unreached + " mm, at a spacing of " +
                    number(spacing * 2.0) + " mm");
}

/// A smooth first guess from a lattice path: the staircase goes, the ends are put on.
Polyline guess_from(const Polyline& lattice_line, const Vec3& first, const Vec3& last) {
  Polyline line{first};
  line.insert(line.end(), lattice_line.begin(), lattice_line.end());
  line.push_back(last);
  const double spacing = lattice_line.size() > 1
                             ? length(lattice_line) / static_cast<double>(lattice_line.size() - 1)
                             : 0.25 * length(line);
  return vstent::smooth(resample(line, 0.0, length(line), spacing), spacing);
}

Polyline part(const Polyline& line, double from, double to) {
  const std::vector<double> s = arc_lengths(line);
  Polyline piece{point_at(line, s, from)};
  for (std::size_t i = 0; i < line.size(); ++i) {
    if (s[i] > from && s[i] < to) piece.push_back(line[i]);
  }
  piece.push_back(point_at(line, s, to));
  return piece;
}

/// The nodes two lattice paths of one tree have in common, from the start.
std::size_t shared_nodes(const std::vector<int>& a, const std::vector<int>& b) {
  std::size_t n = 0;
  while (n < a.size() && n < b.size() && a[n] == b[n]) ++n;
  return n;
}

/// For closed lumens without caps: tips of the tree take the place of ends.
void add_tips(const Surface& surface, LumenEnds& lumen) {
  double volume = 0;
  double area = 0;
  for (const Triangle& t : lumen.closed.triangles) {
    const Vec3& a = lumen.closed.points[static_cast<std::size_t>(t[0])];
    const Vec3& b = lumen.closed.points[static_cast<std::size_t>(t[1])];
    const Vec3& c = lumen.closed.points[static_cast<std::size_t>(t[2])];
    volume += a.dot(b.cross(c)) / 6.0;
    area += 0.5 * (b - a).cross(c - a).norm();
  }
  const double radius = area > 0 ? 2.0 * std::abs(volume) / area : 0.0;  // exact for a long tube
  if (!(radius > 0)) fail(surface, "no centerline: the surface encloses no volume");
  const ClosedLumen closed(lumen.closed);

  // The deepest of points a radius behind the wall that lies inside: a search from there meets the
  // whole lumen.
  std::vector<std::pair<double, Vec3>> candidates;
  const std::size_t stride = 1 + lumen.closed.triangles.size() / kInsideCandidates;
  for (std::size_t t = 0; t < lumen.closed.triangles.size(); t += stride) {
    const Triangle& corners = lumen.closed.triangles[t];
    const Vec3& a = lumen.closed.points[static_cast<std::size_t>(corners[0])];
    const Vec3& b = lumen.closed.points[static_cast<std::size_t>(corners[1])];
    const Vec3& c = lumen.closed.points[static_cast<std::size_t>(corners[2])];
    const Vec3 normal = (b - a).cross(c - a);
    if (!(normal.norm() > 0)) continue;
    const Vec3 x = (a + b + c) / 3.0 - radius * normal.normalized();
    candidates.emplace_back(closed.distance.closest(x).distance, x);
  }
  std::stable_sort(candidates.begin(), candidates.end(),
                   [](const auto& a, const auto& b) { return a.first > b.first; });
  const auto inside = std::find_if(candidates.begin(), candidates.end(),
                                   [&](const auto& x) { return closed.encloses(x.second); });
  if (inside == candidates.end()) fail(surface, "no centerline: no point found inside");
  for (const LumenTip& tip : find_lumen_tips(closed, radius / 5.0, inside->second, kNodeLimit)) {
    const bool known = std::any_of(lumen.ends.begin(), lumen.ends.end(), [&](const LumenEnd& end) {
      return (end.centre - tip.centre).norm() < 1.5 * (end.radius + tip.radius);
    });
    if (!known) lumen.ends.push_back({tip.centre, tip.outward, tip.radius, false});
  }
}

}  // namespace

Centerline extract_centerline(const Surface& surface, const ExtractionOptions& options) {
  LumenEnds lumen = find_lumen_ends(surface);
  if (lumen.ends.size() < 2) add_tips(surface, lumen);
  if (lumen.ends.size() < 2) {
    fail(surface, "no centerline: of openings, caps and tips " + std::to_string(lumen.ends.size()) +
                      " found, two are needed");
  }
  const auto widest_first = [&](std::size_t a, std::size_t b) {
    return lumen.ends[a].radius > lumen.ends[b].radius;
  };
  std::vector<std::size_t> order(lumen.ends.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::stable_sort(order.begin(), order.end(), widest_first);
  std::size_t inlet = order.front();
  if (options.inlet) {
    for (const std::size_t e : order) {
      if ((lumen.ends[e].centre - *options.inlet).norm() <
          (lumen.ends[inlet].centre - *options.inlet).norm()) {
        inlet = e;
      }
    }
  }

  std::vector<Way> ways = lattice_ways(surface, lumen, inlet);
  const sdf::MeshDistance& wall = *lumen.wall;
  const auto depth = [&](const Vec3& x) { return wall.closest(x).distance; };
  const Vec3 start = lumen.ends[inlet].centre;

  // The longest way first; every further one from a run-up before the place where its lattice path
  // leaves the others'.
  std::vector<std::size_t> by_length(ways.size());
  std::iota(by_length.begin(), by_length.end(), std::size_t{0});
  std::stable_sort(by_length.begin(), by_length.end(), [&](std::size_t a, std::size_t b) {
    return length(ways[a].lattice_line) > length(ways[b].lattice_line);
  });
  AxisTree tree;
  for (std::size_t rank = 0; rank < ways.size(); ++rank) {
    Way& way = ways[by_length[rank]];
    const Vec3 end = lumen.ends[way.end].centre;
    const Polyline guess = guess_from(way.lattice_line, start, end);
    if (rank == 0) {
      way.line = centre(guess, wall);
      int node = -1;
      for (const Vec3& x : adaptive_stations(way.line, wall, 1.0 / kNodesPerRadius)) {
        node = tree.add(x, depth(x), node);
        way.tree_nodes.push_back(node);
      }
      continue;
    }
    const Way* trunk = nullptr;
    std::size_t shared = 0;
    for (std::size_t earlier = 0; earlier < rank; ++earlier) {
      const Way& candidate = ways[by_length[earlier]];
      const std::size_t common = shared_nodes(candidate.nodes, way.nodes);
      if (!trunk || common > shared) {
        trunk = &candidate;
        shared = common;
      }
    }
    const std::vector<double> trunk_s = arc_lengths(trunk->line);
    const std::vector<double> guess_s = arc_lengths(guess);
    const Vec3 last_shared = way.lattice_line[std::max<std::size_t>(shared, 1) - 1];
    const double parting = vstent::nearest_place(trunk->line, trunk_s, last_shared).arc_length;
    const double run_up =
        std::max(0.0, parting - kRunUp * depth(point_at(trunk->line, trunk_s, parting)));
    const double guess_parting = vstent::nearest_place(guess, guess_s, last_shared).arc_length;

    Polyline first_guess = part(trunk->line, run_up, std::max(parting, run_up + 1e-9));
    const Polyline rest = part(guess, guess_parting, guess_s.back());
    first_guess.insert(first_guess.end(), rest.begin() + 1, rest.end());
    const Polyline centred = centre(first_guess, wall);
    way.line = run_up > 0 ? part(trunk->line, 0.0, run_up) : Polyline{};
    way.line.insert(way.line.end(), centred.begin() + (run_up > 0 ? 1 : 0), centred.end());

    // Where the two ways are a share of the radius apart, and stay so.
    const std::vector<double> centred_s = arc_lengths(centred);
    std::size_t last_common = 0;
    for (std::size_t i = 0; i < centred.size(); ++i) {
      const double apart =
          std::sqrt(vstent::nearest_place(trunk->line, trunk_s, centred[i]).squared_distance);
      if (apart < kParting * depth(centred[i])) last_common = i;
    }
    if (last_common + 1 >= centred.size()) last_common = centred.size() - 2;
    const double fork_s =
        vstent::nearest_place(trunk->line, trunk_s, centred[last_common]).arc_length;
    int fork = trunk->tree_nodes.front();
    for (const int node : trunk->tree_nodes) {
      if ((tree.points[static_cast<std::size_t>(node)] - point_at(trunk->line, trunk_s, fork_s))
              .norm() <
          (tree.points[static_cast<std::size_t>(fork)] - point_at(trunk->line, trunk_s, fork_s))
              .norm()) {
        fork = node;
      }
    }
    for (const int node : trunk->tree_nodes) {
      way.tree_nodes.push_back(node);
      if (node == fork) break;
    }
    const Vec3 fork_point = tree.points[static_cast<std::size_t>(fork)];
    const double leaves = vstent::nearest_place(centred, centred_s, fork_point).arc_length;
    const Vec3 offset = fork_point - point_at(centred, centred_s, leaves);
    const double blend = 2.0 * depth(fork_point);
    const Polyline stations = adaptive_stations(centred, wall, 1.0 / kNodesPerRadius, leaves);
    double travelled = 0;
    int node = fork;
    for (std::size_t i = 1; i < stations.size(); ++i) {
      travelled += (stations[i] - stations[i - 1]).norm();
      const double t = std::clamp(1.0 - travelled / blend, 0.0, 1.0);
      const Vec3 x =
          stations[i] + (i + 1 < stations.size() ? t * t * (3.0 - 2.0 * t) : 0.0) * offset;
      node = tree.add(x, depth(x), node);
      way.tree_nodes.push_back(node);
    }
  }

  smooth(tree, kSmoothing);
  double smallest = depth(start);
  for (std::size_t n = 0; n < tree.points.size(); ++n) {
    tree.radii[n] = depth(tree.points[n]);
    smallest = std::min(smallest, tree.radii[n]);
  }
  const double spacing = options.point_spacing > 0 ? options.point_spacing : 0.2 * smallest;
  Centerline result = evenly_spaced(branches_of(tree), spacing);
  for (CenterlineBranch& branch : result.branches) {
    for (std::size_t i = 0; i < branch.points.size(); ++i)
      branch.radii[i] = depth(branch.points[i]);
  }
  return result;
}

}  // namespace vstent::vessels
