// A pattern as joints and the pieces of metal between them, and how the pieces keep their lengths
// while the stent bends.
#pragma once

#include <stdexcept>

#include "stents/bent_tube.hpp"
#include "stents/pattern.hpp"

namespace vstent::stents {

/// Points at which a member turns back along the axis; the middle of a flat crown.
std::vector<int> crowns_of(const Member& member);

/// A part of a member between two joints: half a wave of a ring, a wire from crossing to crossing,
/// a whole connector. Points first .. last of the member, counted on past the end of a closed one.
struct Piece {
  int member = 0, first = 0, last = 0;
  int joint_a = 0, joint_b = 0;
  double length = 0;      ///< mm, of its centre line on the straight stent
  bool flexible = false;  ///< a curved connector: it may change its shape, but not its length
};

/// Joints are crowns, ends of members, welds and crossings, and places in between where a piece
/// would span more than a quarter turn. Members that touch at a joint share it.
struct StrutNetwork {
  int joints = 0;
  std::vector<Piece> pieces;
};
StrutNetwork strut_network(const Pattern& pattern);

/// Pieces from one plane across the axis to another that close into a circumference, in order
/// around it: a ring of struts, or the wires between two rows of crossings.
using Row = std::vector<int>;
std::vector<Row> rows_of(const Pattern& pattern, const StrutNetwork& network);

/// The bend is too tight for struts of their length.
struct Infeasible : std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// The members with their joints moved on the tube so that every piece that is not flexible has its
/// length: per row one height and widths X_k = sqrt(l_k^2 - (lambda_k h)^2) that close the
/// circumference, then Newton steps of least displacement that make all lengths exact.
/// \throws Infeasible where lambda_k h > l_k for some strut of a row, at the height that closes it
std::vector<Member> conformed(const Pattern& pattern, const StrutNetwork& network,
                              const BentTube& tube);

/// The largest curvature (1/mm) that every row can follow, at most `limit`.
double largest_feasible_curvature(const Pattern& pattern, const StrutNetwork& network,
                                  double limit);

}  // namespace vstent::stents
