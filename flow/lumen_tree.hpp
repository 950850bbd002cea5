// A lumen as a tree of sections: what a reduced model needs to know of its shape.
#pragma once

#include <array>

#include "flow/network.hpp"
#include "measure/profile.hpp"

namespace vstent::flow {

/// One branch of the centerline with its sections on both surfaces.
struct BranchSections {
  int parent = -1;
  Polyline axis_before, axis_after;         ///< mm; both have a point per section
  std::vector<double> arc;                  ///< mm from the branch's start, on the axis before
  std::array<std::vector<double>, 2> area;  ///< mm2, before and after
  std::array<std::vector<char>, 2> taken;   ///< 1: cut there; 0: from the nearest whole section
};

struct LumenTree {
  std::vector<BranchSections> branches;  ///< parents first; 0 is the root
};

/// Sections at most 0.3 of the branch's mean radius apart. Where a section runs into another branch
/// or the surface is open or capped, its area is that of the nearest whole ones of its branch,
/// linear in diameter between them; a branch without any goes from its parent's to its widest
/// child's, or has the inscribed spheres' where it is an end.
LumenTree cut_tree(const measure::CutSurface& before, const measure::CutSurface& after,
                   const vessels::Centerline& centerline);

enum class When { before = 0, after = 1 };

/// The reduced model of one of the surfaces, without outlets.
Network network_of(const LumenTree& tree, When when, const Blood& blood,
                   const LossModel& losses = {});

/// The same tree, beginning at the end nearest to `inlet` (mm).
vessels::Centerline rooted_at(const vessels::Centerline& centerline, const Vec3& inlet);

/// Branches without children, in order.
template <class Branches>
std::vector<int> leaves(const Branches& branches) {
  std::vector<char> is_parent(branches.size(), 0);
  for (const auto& branch : branches)
    if (branch.parent >= 0) is_parent[static_cast<std::size_t>(branch.parent)] = 1;
  std::vector<int> result;
  for (std::size_t b = 0; b < branches.size(); ++b)
    if (!is_parent[b]) result.push_back(static_cast<int>(b));
  return result;
}

}  // namespace vstent::flow
