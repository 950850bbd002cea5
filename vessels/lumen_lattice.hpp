// Ways through a lumen: least-cost paths over the nodes of its level set.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "sdf/level_set.hpp"

namespace vstent::vessels {

/// Nodes of a level set's grid inside a lumen, discovered from one start node outwards in order of
/// the cost integral of ds / depth (depth: distance to the wall). Two nodes are linked only where
/// the balls of their depths overlap, so every link, and every path, lies inside the lumen whatever
/// the spacing.
class LumenLattice {
 public:
  explicit LumenLattice(const sdf::LevelSet& lumen) : lumen_(lumen), spacing_(lumen.voxel_size()) {}

  struct Target {
    Vec3 point;    ///< inside the lumen
    double reach;  ///< mm: a node this close to `point` has arrived
  };

  /// Grows from `start` until every target is reached or the lumen is exhausted; the arriving node
  /// per target, -1 for those not reached. \throws Error (resources) beyond `node_limit` nodes
  std::vector<int> grow(const Vec3& start, const std::vector<Target>& targets,
                        std::size_t node_limit);

  std::size_t size() const { return nodes_.size(); }
  int parent(int node) const { return nodes_[static_cast<std::size_t>(node)].parent; }
  double depth(int node) const { return nodes_[static_cast<std::size_t>(node)].depth; }
  double cost(int node) const { return nodes_[static_cast<std::size_t>(node)].cost; }
  Vec3 position(int node) const;
  /// Nodes from the start to `node`.
  std::vector<int> path_to(int node) const;
  /// Settled nodes in the order in which they were, parents before children.
  const std::vector<int>& settled() const { return settled_; }
  /// No neighbour lies deeper: on the lumen's axis, as near as the lattice tells.
  bool is_deepest_of_its_neighbours(int node);

 private:
  struct Node {
    std::array<std::int32_t, 3> index;
    std::int32_t parent;
    float depth;  // mm, positive inside; nodes outside are kept as negative depths, never linked
    bool settled;
    double cost;
  };
  int find_or_add(const std::array<std::int32_t, 3>& index);
  void rehash();

  const sdf::LevelSet& lumen_;
  double spacing_;
  std::vector<int> settled_;
  std::vector<Node> nodes_;
  std::vector<std::int32_t> slots_;  // open addressing; -1 is free
};

/// A rounded end of a lumen that has no opening or cap there: the last inscribed ball of a tree
/// branch.
struct LumenTip {
  Vec3 centre = Vec3::Zero();
  Vec3 outward = Vec3::UnitX();  ///< unit
  double radius = 0;             ///< mm
};
/// Tips of the tree that a closed lumen is: from the farthest point, again and again the point
/// farthest from the inscribed balls of the branches found so far, as long as that is more than 2.5
/// local radii.
std::vector<LumenTip> find_lumen_tips(const sdf::LevelSet& lumen, const Vec3& inside,
                                      std::size_t node_limit);

}  // namespace vstent::vessels
