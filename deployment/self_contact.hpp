// What the wall did to itself, or to a vessel beside its own.
#pragma once

#include "deployment/setup.hpp"
#include "xpbd/self_collision.hpp"

namespace vstent::deployment {

struct SelfContact {
  int places = 0;              ///< vertices, and pairs of edges, that other wall pushes
  double least_clearance = 0;  ///< mm between walls that push each other; 0 where none do
  double force = 0;            ///< N, sum over both sides
  double pushed_aside = 0;  ///< mm that the wall further from the stent's axis has moved, at most
  int against_held = 0;     ///< places where that wall is held
};

/// `positions`: of the patch's vertices; `pushes` count them.
SelfContact self_contact(const Setup& setup, std::span<const xpbd::Push> pushes,
                         std::span<const Vec3> positions, const Polyline& axis);

/// What a person should know of it; empty: nothing.
std::vector<std::string> warnings_of(const SelfContact& contact);

}  // namespace vstent::deployment
