// Ways through a lumen: least-cost paths over the nodes of a lattice.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "sdf/mesh_distance.hpp"

namespace vstent::vessels {

/// A closed surface and the distances to it, seen from a point inside.
struct ClosedLumen {
  explicit ClosedLumen(const TriangleMesh& closed) : mesh(closed), distance(closed) {}
  bool encloses(const Vec3& x) const { return distance.winding_number(x) > 0.5; }

  const TriangleMesh& mesh;
  sdf::MeshDistance distance;
};

/// Nodes of a cubic lattice inside a lumen, discovered from one start node outwards in order of
/// the cost integral of ds / depth (depth: distance to the surface). Two nodes are linked only
/// where the balls of their depths overlap: no surface passes between them, so every link, and
/// every path, lies on the start's side of it whatever the spacing.
class LumenLattice {
 public:
  /// \throws Error (resources) when the spacing is too fine to number the nodes
  LumenLattice(const ClosedLumen& lumen, double spacing);

  struct Target {
    Vec3 point;    ///< inside the lumen
    double reach;  ///< mm: a node this close to `point` has arrived
  };

  /// Grows from `start` until every target is reached or the lumen is exhausted; the arriving node
  /// per target, -1 for those not reached: all of them when the start lies outside or the lumen is
  /// too narrow there for the spacing. \throws Error (resources) beyond `node_limit` nodes
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
  /// No neighbour in the lumen lies deeper: on its axis, as near as the lattice tells.
  bool is_deepest_of_its_neighbours(int node);

 private:
  struct Node {
    std::array<std::int32_t, 3> index;
    std::int32_t parent;
    std::int32_t triangle;  // the nearest
    float depth;            // mm, unsigned: nodes outside are met, but never linked
    double cost;
    bool settled;
  };
  std::size_t slot_of(const std::array<std::int32_t, 3>& index) const;  // its own or a free one
  /// `hint`: a triangle that is near
  int find_or_add(const std::array<std::int32_t, 3>& index, int hint);
  void rehash();

  const ClosedLumen& lumen_;
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
std::vector<LumenTip> find_lumen_tips(const ClosedLumen& lumen, double spacing, const Vec3& inside,
                                      std::size_t node_limit);

}  // namespace vstent::vessels
