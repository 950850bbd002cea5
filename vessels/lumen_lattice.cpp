#include "vessels/lumen_lattice.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <queue>
#include <string>

#include "vessels/error.hpp"
#include "vessels/text.hpp"

namespace vstent::vessels {
namespace {

std::size_t hash(const std::array<std::int32_t, 3>& index) {
  auto key = static_cast<std::uint64_t>(static_cast<std::uint32_t>(index[0]));
  key = key * 0x9E3779B97F4A7C15u + static_cast<std::uint32_t>(index[1]);
  key = key * 0x9E3779B97F4A7C15u + static_cast<std::uint32_t>(index[2]);
  key ^= key >> 29;
  return static_cast<std::size_t>(key * 0xBF58476D1CE4E5B9u >> 16);
}

struct Step {
  std::array<std::int32_t, 3> offset;
  double length;  // in spacings
};

const std::vector<Step>& neighbour_steps() {
  static const std::vector<Step> kSteps = [] {
    std::vector<Step> steps;
    for (int i = -1; i <= 1; ++i) {
      for (int j = -1; j <= 1; ++j) {
        for (int k = -1; k <= 1; ++k) {
          if (i || j || k) steps.push_back({{i, j, k}, std::sqrt(i * i + j * j + k * k)});
        }
      }
    }
    return steps;
  }();
  return kSteps;
}

std::array<std::int32_t, 3> neighbour_of(const std::array<std::int32_t, 3>& index,
                                         const Step& step) {
  return {index[0] + step.offset[0], index[1] + step.offset[1], index[2] + step.offset[2]};
}

bool balls_overlap(double radius, double other_radius, double distance) {
  // The margin covers depths rounded to float: balls that only touch do so on the surface.
  return radius + other_radius > (1.0 + 1e-6) * distance;
}

}  // namespace

LumenLattice::LumenLattice(const ClosedLumen& lumen, double spacing)
    : lumen_(lumen), spacing_(spacing) {
  double farthest = 0;
  for (const Vec3& x : lumen.mesh.points) farthest = std::max(farthest, x.cwiseAbs().maxCoeff());
  if (!(farthest / spacing < 1 << 30)) {
    throw Error(ExitCode::resources, "centerline: " + number(farthest) +
                                         " mm from the origin cannot be numbered in steps of " +
                                         number(spacing) + " mm; move the surface to the origin");
  }
}

Vec3 LumenLattice::position(int node) const {
  const auto& index = nodes_[static_cast<std::size_t>(node)].index;
  return spacing_ * Vec3(index[0], index[1], index[2]);
}

bool LumenLattice::is_deepest_of_its_neighbours(int node) {
  const Node self = nodes_[static_cast<std::size_t>(node)];
  return std::all_of(neighbour_steps().begin(), neighbour_steps().end(), [&](const Step& step) {
    const int neighbour = find_or_add(neighbour_of(self.index, step), self.triangle);
    return depth(neighbour) <= self.depth ||
           !balls_overlap(self.depth, depth(neighbour), step.length * spacing_);
  });
}

std::vector<int> LumenLattice::path_to(int node) const {
  std::vector<int> path;
  for (; node >= 0; node = parent(node)) path.push_back(node);
  std::reverse(path.begin(), path.end());
  return path;
}

std::size_t LumenLattice::slot_of(const std::array<std::int32_t, 3>& index) const {
  std::size_t slot = hash(index) % slots_.size();
  while (slots_[slot] >= 0 && nodes_[static_cast<std::size_t>(slots_[slot])].index != index) {
    slot = slot + 1 == slots_.size() ? 0 : slot + 1;
  }
  return slot;
}

void LumenLattice::rehash() {
  slots_.assign(std::max<std::size_t>(1024, 4 * nodes_.size()), -1);
  for (std::size_t n = 0; n < nodes_.size(); ++n) {
    slots_[slot_of(nodes_[n].index)] = static_cast<std::int32_t>(n);
  }
}

int LumenLattice::find_or_add(const std::array<std::int32_t, 3>& index, int hint) {
  if (2 * (nodes_.size() + 1) > slots_.size()) rehash();
  const std::size_t slot = slot_of(index);
  if (slots_[slot] >= 0) return slots_[slot];
  const Vec3 x = spacing_ * Vec3(index[0], index[1], index[2]);
  // The hint's distance bounds the search; when nothing lies nearer, it is the distance.
  const auto corner = [&](std::size_t k) {
    return lumen_.mesh
        .points[static_cast<std::size_t>(lumen_.mesh.triangles[static_cast<std::size_t>(hint)][k])];
  };
  const double bound =
      (x - sdf::closest_point_on_triangle(x, corner(0), corner(1), corner(2))).norm();
  const auto closest = lumen_.distance.closest(x, bound);
  const bool nearer = closest.triangle >= 0;
  nodes_.push_back({index, -1, nearer ? closest.triangle : hint,
                    static_cast<float>(nearer ? closest.distance : bound),
                    std::numeric_limits<double>::infinity(), false});
  slots_[slot] = static_cast<std::int32_t>(nodes_.size()) - 1;
  return slots_[slot];
}

std::vector<int> LumenLattice::grow(const Vec3& start, const std::vector<Target>& targets,
                                    std::size_t node_limit) {
  nodes_.clear();
  slots_.clear();
  settled_.clear();

  std::vector<int> arrivals(targets.size(), -1);
  if (!lumen_.encloses(start)) return arrivals;
  int first = -1;
  const auto nearest = lumen_.distance.closest(start);
  const Vec3 corner = (start / spacing_).array().floor();
  for (int c = 0; c < 8; ++c) {
    const int node = find_or_add({static_cast<std::int32_t>(corner.x()) + (c & 1),
                                  static_cast<std::int32_t>(corner.y()) + (c >> 1 & 1),
                                  static_cast<std::int32_t>(corner.z()) + (c >> 2 & 1)},
                                 nearest.triangle);
    const bool linked =
        balls_overlap(nearest.distance, depth(node), (position(node) - start).norm());
    if (linked && (first < 0 || depth(node) > depth(first))) first = node;
  }
  if (first < 0) return arrivals;

  struct Entry {
    double cost;
    int node;
    bool operator>(const Entry& other) const {
      return cost != other.cost ? cost > other.cost : node > other.node;
    }
  };
  std::priority_queue<Entry, std::vector<Entry>, std::greater<>> front;
  nodes_[static_cast<std::size_t>(first)].cost = 0;
  front.push({0, first});
  std::size_t waiting = targets.size();
  while (!front.empty()) {
    const Entry entry = front.top();
    front.pop();
    const Node node = nodes_[static_cast<std::size_t>(entry.node)];
    if (node.settled) continue;
    nodes_[static_cast<std::size_t>(entry.node)].settled = true;
    settled_.push_back(entry.node);
    const Vec3 x = position(entry.node);
    for (std::size_t t = 0; t < targets.size(); ++t) {
      if (arrivals[t] >= 0 || (x - targets[t].point).norm() > targets[t].reach) continue;
      arrivals[t] = entry.node;
      --waiting;
    }
    if (waiting == 0 && !targets.empty()) break;
    if (nodes_.size() > node_limit) {
      throw Error(ExitCode::resources,
                  "centerline: the lumen has more than " + std::to_string(node_limit) +
                      " lattice nodes at a spacing of " + number(spacing_) + " mm");
    }
    for (const Step& step : neighbour_steps()) {
      const int neighbour = find_or_add(neighbour_of(node.index, step), node.triangle);
      Node& next = nodes_[static_cast<std::size_t>(neighbour)];
      const double length = step.length * spacing_;
      if (next.settled || !balls_overlap(node.depth, next.depth, length)) continue;
      const double cost = node.cost + 0.5 * length * (1.0 / node.depth + 1.0 / next.depth);
      if (cost >= next.cost) continue;
      next.cost = cost;
      next.parent = entry.node;
      front.push({cost, neighbour});
    }
  }
  return arrivals;
}

std::vector<LumenTip> find_lumen_tips(const ClosedLumen& lumen, double spacing, const Vec3& inside,
                                      std::size_t node_limit) {
  constexpr double kCovered = 1.2;   // of its radius: as far as a branch's inscribed ball reaches
  constexpr double kShortest = 2.5;  // local radii of a branch beyond what is covered
  LumenLattice lattice(lumen, spacing);
  const auto axis_nodes = [&] {
    std::vector<int> nodes;
    for (const int node : std::vector<int>(lattice.settled())) {
      if (lattice.is_deepest_of_its_neighbours(node)) nodes.push_back(node);
    }
    return nodes;
  };
  const auto farthest = [&](const std::vector<int>& nodes, const auto& distance) {
    int best = -1;
    for (const int node : nodes) {
      if (best < 0 || distance(node) > distance(best)) best = node;
    }
    return best;
  };
  const auto tip_at = [&](int node, const Vec3& towards_tree) {
    return LumenTip{lattice.position(node), (lattice.position(node) - towards_tree).normalized(),
                    lattice.depth(node)};
  };

  lattice.grow(inside, {}, node_limit);
  std::vector<int> axis = axis_nodes();
  if (axis.empty()) return {};
  const int first = farthest(axis, [&](int node) { return lattice.cost(node); });
  lattice.grow(Vec3(lattice.position(first)), {}, node_limit);
  axis = axis_nodes();

  std::vector<char> covered(lattice.size(), 0);
  std::vector<double> beyond(lattice.size(), 0.0);  // cost since the way left the covered nodes
  const int start = lattice.settled().front();
  std::vector<LumenTip> tips;
  std::vector<int> branch{start};
  while (true) {
    for (const int ball : branch) {
      const Vec3 centre = lattice.position(ball);
      const double reach = kCovered * lattice.depth(ball);
      for (const int node : lattice.settled()) {
        const auto n = static_cast<std::size_t>(node);
        if (!covered[n] && (lattice.position(node) - centre).squaredNorm() < reach * reach) {
          covered[n] = 1;
        }
      }
    }
    for (const int node : lattice.settled()) {
      const auto n = static_cast<std::size_t>(node);
      const int parent = lattice.parent(node);
      beyond[n] = covered[n] || parent < 0 ? 0.0
                                           : beyond[static_cast<std::size_t>(parent)] +
                                                 lattice.cost(node) - lattice.cost(parent);
    }
    const int tip =
        farthest(axis, [&](int node) { return beyond[static_cast<std::size_t>(node)]; });
    if (beyond[static_cast<std::size_t>(tip)] < kShortest) return tips;
    branch = lattice.path_to(tip);
    const auto before = [&](std::size_t from, bool forward) {  // a radius along the branch
      const double radius = lattice.depth(branch[from]);
      std::size_t i = from;
      const std::size_t last = forward ? branch.size() - 1 : 0;
      while (i != last &&
             (lattice.position(branch[i]) - lattice.position(branch[from])).norm() < radius) {
        i = forward ? i + 1 : i - 1;
      }
      return lattice.position(branch[i]);
    };
    if (tips.empty()) tips.push_back(tip_at(start, before(0, true)));
    tips.push_back(tip_at(tip, before(branch.size() - 1, false)));
  }
}

}  // namespace vstent::vessels
