#include "xpbd/preconditioner.hpp"

#include <tbb/parallel_for.h>

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <limits>
#include <queue>
#include <utility>

namespace vstent::xpbd {
namespace {

// Neighbourhoods reach this much farther than their centres' spacing.
constexpr double kReach = 1.4;

std::size_t at(int index) { return static_cast<std::size_t>(index); }

Vec3 place(const Slot& s) { return {s.x, s.y, s.z}; }

/// Visits what the layout holds; a batch's filling copies are skipped.
template <class Visit>
void for_each_distance(const Layout& layout, const Visit& visit) {
  for (const DistanceBatch& b : layout.distances)
    for (std::size_t lane = 0; lane < kLanes; ++lane)
      if (lane == 0 || b.i[lane] != b.i[0])
        visit(b.i[lane], b.j[lane], b.rest[lane], b.compliance[lane]);
}

template <class Visit>
void for_each_bending(const Layout& layout, const Visit& visit) {
  for (const BendingBatch& b : layout.bendings)
    for (std::size_t lane = 0; lane < kLanes; ++lane)
      if (lane == 0 || b.vertex[0][lane] != b.vertex[0][0])
        visit(std::array<int, 4>{b.vertex[0][lane], b.vertex[1][lane], b.vertex[2][lane],
                                 b.vertex[3][lane]},
              b.compliance[lane]);
}

/// The Gauss-Newton stiffness as a sum of squares: `visit(vertices, gradient, stiffness)` for
/// every constraint, and for the two directions across a spring under tension. What a compressed
/// spring takes away across itself is left out, which keeps the sum positive.
template <class Visit>
void for_each_stiffness(const Layout& layout, std::span<const Slot> particles, const Visit& visit) {
  const auto x = [&](int k) { return place(particles[at(k)]); };
  for_each_distance(layout, [&](int i, int j, double rest, double compliance) {
    const Vec3 edge = x(j) - x(i);
    const double length = edge.norm();
    if (!(length > 0)) return;
    const std::array<int, 2> v{i, j};
    const Vec3 n = edge / length;
    visit(v, std::array<Vec3, 2>{-n, n}, 1 / compliance);
    const double across = (length - rest) / compliance / length;
    if (!(across > 0)) return;
    const Vec3 a = n.unitOrthogonal(), b = n.cross(a);
    visit(v, std::array<Vec3, 2>{-a, a}, across);
    visit(v, std::array<Vec3, 2>{-b, b}, across);
  });
  for_each_bending(layout, [&](const std::array<int, 4>& v, double compliance) {
    std::array<Vec3, 4> gradient;
    hinge_angle(x(v[0]), x(v[1]), x(v[2]), x(v[3]), &gradient);
    visit(v, gradient, 1 / compliance);
  });
}

/// Neighbours along edges, with their distance.
struct Graph {
  std::vector<std::size_t> first;
  std::vector<std::pair<int, double>> neighbours;
  double mean_edge = 0;
};

Graph make_graph(const Layout& layout, std::span<const Slot> particles) {
  Graph graph;
  graph.first.assign(particles.size() + 1, 0);
  double total = 0;
  for_each_distance(layout, [&](int i, int j, double, double) {
    ++graph.first[at(i) + 1];
    ++graph.first[at(j) + 1];
  });
  for (std::size_t k = 0; k < particles.size(); ++k) graph.first[k + 1] += graph.first[k];
  graph.neighbours.resize(graph.first.back());
  std::vector<std::size_t> next(graph.first.begin(), graph.first.end() - 1);
  for_each_distance(layout, [&](int i, int j, double, double) {
    const double length = (place(particles[at(j)]) - place(particles[at(i)])).norm();
    total += length;
    graph.neighbours[next[at(i)]++] = {j, length};
    graph.neighbours[next[at(j)]++] = {i, length};
  });
  if (graph.first.back() > 0) graph.mean_edge = 2 * total / static_cast<double>(graph.first.back());
  return graph;
}

/// Shortest ways along edges from one vertex, as far as asked.
class Ways {
 public:
  explicit Ways(const Graph& graph)
      : graph_(graph), length_(graph.first.size() - 1, std::numeric_limits<double>::infinity()) {}

  template <class Visit>
  void from(int start, double reach, const Visit& visit) {
    relax(start, 0);
    while (!open_.empty()) {
      const auto [length, vertex] = open_.top();
      open_.pop();
      if (length > length_[at(vertex)]) continue;
      visit(vertex, length);
      for (std::size_t k = graph_.first[at(vertex)]; k < graph_.first[at(vertex) + 1]; ++k) {
        const auto& [neighbour, edge] = graph_.neighbours[k];
        if (length + edge < reach) relax(neighbour, length + edge);
      }
    }
    for (int vertex : touched_) length_[at(vertex)] = std::numeric_limits<double>::infinity();
    touched_.clear();
  }

 private:
  void relax(int vertex, double length) {
    if (!(length < length_[at(vertex)])) return;
    if (std::isinf(length_[at(vertex)])) touched_.push_back(vertex);
    length_[at(vertex)] = length;
    open_.emplace(length, vertex);
  }

  using Entry = std::pair<double, int>;
  const Graph& graph_;
  std::vector<double> length_;
  std::vector<int> touched_;
  std::priority_queue<Entry, std::vector<Entry>, std::greater<>> open_;
};

/// Six-vectors on a few nodes: what a constraint's gradient is to the neighbourhoods' motions.
struct Stencil {
  std::vector<int> nodes;
  std::vector<std::array<double, 6>> gradient;

  void clear() {
    nodes.clear();
    gradient.clear();
  }
  void add(int node, double weight, const Vec3& force, const Vec3& arm) {
    const auto found = std::find(nodes.begin(), nodes.end(), node);
    const auto k = static_cast<std::size_t>(found - nodes.begin());
    if (found == nodes.end()) {
      nodes.push_back(node);
      gradient.push_back({});
    }
    const Vec3 torque = arm.cross(force);
    for (int axis = 0; axis < 3; ++axis) {
      gradient[k][at(axis)] += weight * force[axis];
      gradient[k][at(axis) + 3] += weight * torque[axis];
    }
  }
};

/// The neighbourhoods' stiffness: 6x6 blocks, of each pair the one below the diagonal.
class NodeMatrix {
 public:
  using Block = std::array<double, 36>;

  explicit NodeMatrix(std::size_t nodes) : columns_(nodes) {}

  void add(const Stencil& s, double stiffness) {
    for (std::size_t a = 0; a < s.nodes.size(); ++a)
      for (std::size_t b = 0; b < s.nodes.size(); ++b) {
        if (s.nodes[a] < s.nodes[b]) continue;
        Block& block = find(s.nodes[a], s.nodes[b]);
        for (std::size_t c = 0; c < 6; ++c)
          for (std::size_t r = 0; r < 6; ++r)
            block[6 * c + r] += stiffness * s.gradient[a][r] * s.gradient[b][c];
      }
  }

  Eigen::SparseMatrix<double> lower() const {
    const auto size = static_cast<Eigen::Index>(6 * columns_.size());
    std::vector<Eigen::Triplet<double>> entries;
    for (std::size_t column = 0; column < columns_.size(); ++column) {
      double largest = 0;
      for (const auto& [row, block] : columns_[column])
        if (row == static_cast<int>(column))
          for (std::size_t k = 0; k < 6; ++k) largest = std::max(largest, block[7 * k]);
      // Where everything is held nothing is stiff; a floor keeps the factors finite.
      const double floor = largest > 0 ? 1e-5 * largest : 1;
      for (int k = 0; k < 6; ++k) {
        const int r = 6 * static_cast<int>(column) + k;
        entries.emplace_back(r, r, floor);
      }
      for (const auto& [row, block] : columns_[column])
        for (int c = 0; c < 6; ++c)
          for (int r = 0; r < 6; ++r)
            if (row > static_cast<int>(column) || r >= c)
              entries.emplace_back(6 * row + r, 6 * static_cast<int>(column) + c,
                                   block[at(6 * c + r)]);
    }
    Eigen::SparseMatrix<double> matrix(size, size);
    matrix.setFromTriplets(entries.begin(), entries.end());
    return matrix;
  }

 private:
  Block& find(int row, int column) {
    auto& blocks = columns_[at(column)];
    for (auto& [r, block] : blocks)
      if (r == row) return block;
    return blocks.emplace_back(row, Block{}).second;
  }

  std::vector<std::vector<std::pair<int, Block>>> columns_;
};

}  // namespace

Preconditioner::Preconditioner(const Layout& layout, std::span<const Slot> particles,
                               double spacing)
    : inverse_(particles.size()), first_share_(particles.size() + 1, 0) {
  if (spacing > 0) spread_nodes(layout, particles, spacing);
}

void Preconditioner::spread_nodes(const Layout& layout, std::span<const Slot> particles,
                                  double spacing) {
  const Graph graph = make_graph(layout, particles);
  const double apart = spacing * graph.mean_edge;
  Ways ways(graph);
  std::vector<char> covered(particles.size(), 0);
  std::vector<std::vector<Share>> by_particle(particles.size());
  for (int v = 0; v < static_cast<int>(particles.size()); ++v) {
    if (covered[at(v)]) continue;
    const int node = static_cast<int>(centres_.size());
    centres_.push_back(place(particles[at(v)]));
    ways.from(v, kReach * apart, [&](int u, double length) {
      if (length < apart) covered[at(u)] = 1;
      const double t = 1 - std::pow(length / (kReach * apart), 2);
      by_particle[at(u)].push_back({node, static_cast<float>(t * t)});
    });
  }
  for (std::size_t k = 0; k < particles.size(); ++k) {
    float total = 0;
    for (const Share& s : by_particle[k]) total += s.weight;
    for (Share& s : by_particle[k]) s.weight /= total;
    shares_.insert(shares_.end(), by_particle[k].begin(), by_particle[k].end());
    first_share_[k + 1] = shares_.size();
  }
  list_members();
  motions_.assign(centres_.size(), Motion{});
  load_.resize(static_cast<Eigen::Index>(6 * centres_.size()));
}

void Preconditioner::list_members() {
  first_member_.assign(centres_.size() + 1, 0);
  for (const Share& s : shares_) ++first_member_[at(s.node) + 1];
  for (std::size_t k = 0; k < centres_.size(); ++k) first_member_[k + 1] += first_member_[k];
  members_.resize(shares_.size());
  std::vector<std::size_t> next(first_member_.begin(), first_member_.end() - 1);
  for (std::size_t k = 0; k + 1 < first_share_.size(); ++k)
    for (const Share& s : shares(k))
      members_[next[at(s.node)]++] = {static_cast<int>(k), s.weight};
}

void Preconditioner::measure_near(const Layout& layout, std::span<const Slot> particles,
                                  std::span<const double> own) {
  std::vector<Eigen::Matrix3d> blocks(particles.size(), Eigen::Matrix3d::Zero());
  for_each_stiffness(
      layout, particles,
      [&](std::span<const int> vertices, std::span<const Vec3> gradient, double stiffness) {
        // (sum_v g_v . u_v)^2 is at most the sum of (g_v . u_v)^2 / share_v for any shares that sum
        // to 1; shares by |g_v| spread it where it is.
        double total = 0;
        for (const Vec3& g : gradient) total += g.norm();
        for (std::size_t k = 0; k < vertices.size(); ++k)
          if (const double norm = gradient[k].norm(); norm > 0)
            blocks[at(vertices[k])] +=
                stiffness * total / norm * gradient[k] * gradient[k].transpose();
      });
  for (std::size_t k = 0; k < blocks.size(); ++k) {
    Eigen::Matrix3d& d = blocks[k];
    // A flat, slack neighbourhood holds nothing across it.
    d.diagonal().array() += own[k] + 1e-3 * d.trace();
    if (!(d.trace() > 0)) d.setIdentity();
    const Eigen::Matrix3d i = d.inverse();
    inverse_[k] = {i(0, 0), i(1, 1), i(2, 2), i(0, 1), i(0, 2), i(1, 2)};
  }
}

void Preconditioner::measure_far(const Layout& layout, std::span<const Slot> particles,
                                 std::span<const Hold> holds) {
  if (centres_.empty()) return;
  holds_.assign(holds.begin(), holds.end());
  places_.clear();
  for (const Slot& s : particles) places_.push_back(place(s));
  NodeMatrix nodes(centres_.size());
  Stencil stencil;
  for_each_stiffness(
      layout, particles,
      [&](std::span<const int> vertices, std::span<const Vec3> gradient, double stiffness) {
        stencil.clear();
        for (std::size_t k = 0; k < vertices.size(); ++k) {
          const std::size_t v = at(vertices[k]);
          const Vec3 free = holds_[v].free_part(gradient[k]);
          if (free.isZero(0)) continue;
          for (const Share& s : shares(v))
            stencil.add(s.node, s.weight, free, places_[v] - centres_[at(s.node)]);
        }
        nodes.add(stencil, stiffness);
      });
  factors_.compute(nodes.lower());
  if (getenv("VERB")) fprintf(stderr, "nodes %zu nnz %ld min pivot %g max %g info %d\n", centres_.size(), long(factors_.matrixL().nestedExpression().nonZeros()), factors_.vectorD().minCoeff(), factors_.vectorD().maxCoeff(), int(factors_.info()));
}

Vec3 Preconditioner::near_move(std::size_t particle, const Vec3& f) const {
  const auto& m = inverse_[particle];
  return {m[0] * f.x() + m[3] * f.y() + m[4] * f.z(), m[3] * f.x() + m[1] * f.y() + m[5] * f.z(),
          m[4] * f.x() + m[5] * f.y() + m[2] * f.z()};
}

void Preconditioner::pull(std::span<const Slot> residuals) {
  if (centres_.empty()) return;
  tbb::parallel_for(std::size_t{0}, centres_.size(), [&](std::size_t node) {
    Vec3 force = Vec3::Zero(), torque = Vec3::Zero();
    for (std::size_t k = first_member_[node]; k < first_member_[node + 1]; ++k) {
      const auto& [particle, weight] = members_[k];
      const Vec3 f = holds_[at(particle)].free_part(place(residuals[at(particle)])) *
                     static_cast<double>(weight);
      force += f;
      torque += (places_[at(particle)] - centres_[node]).cross(f);
    }
    for (int axis = 0; axis < 3; ++axis) {
      load_[static_cast<Eigen::Index>(6 * node) + axis] = force[axis];
      load_[static_cast<Eigen::Index>(6 * node) + axis + 3] = torque[axis];
    }
  });
  answer_ = factors_.solve(load_);
  for (std::size_t node = 0; node < centres_.size(); ++node)
    for (std::size_t k = 0; k < 6; ++k)
      motions_[node][k] = answer_[static_cast<Eigen::Index>(6 * node + k)];
}

Vec3 Preconditioner::far_move(std::size_t particle) const {
  Vec3 move = Vec3::Zero();
  for (const Share& s : shares(particle)) {
    const Motion& m = motions_[at(s.node)];
    const Vec3 turn(m[3], m[4], m[5]);
    move += s.weight * (Vec3(m[0], m[1], m[2]) + turn.cross(places_[particle] - centres_[at(s.node)]));
  }
  return centres_.empty() ? move : holds_[particle].free_part(move);
}

}  // namespace vstent::xpbd
