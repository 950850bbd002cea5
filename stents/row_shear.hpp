// A row of struts around the circumference, sheared by a bend so that every strut keeps its length.
#pragma once

#include <functional>
#include <optional>
#include <vector>

namespace vstent::stents {

/// A piece of a row, scaled by `width` around the axis and by `height` along it.
struct RowPiece {
  struct Step {
    double x2, z2, r2;  ///< squares of the components around, along and away from the axis, mm^2
  };
  std::vector<Step> steps;
  double length = 0, span = 0, angle = 0;  ///< mm; rad; rad, of its middle

  /// The square of the width factor that keeps the length at this height factor; negative where
  /// there is none.
  double squared_width(double height) const;
  /// The height factor at which it would have to be axial.
  double tallest() const;
};

struct RowGeometry {
  std::vector<RowPiece> pieces;
  double low = 0, height = 0;  ///< mm
  double links = 0;            ///< mm of straight connectors that every crown carries as its share
};

/// Stretch of the axial direction on the bend, at an angle.
using Stretch = std::function<double(double angle)>;

struct RowSolution {
  double height = 1;                 ///< common factor on the axis
  std::vector<double> heights;       ///< of each piece on the axis: with links it varies
  std::vector<double> displacement;  ///< rad, of the joint where each piece begins
};

/// Widths X_k = sqrt(l_k^2 - (lambda_k h)^2) at the one height h at which they close the
/// circumference; none where some lambda_k h would exceed l_k.
std::optional<RowSolution> solve_row(const RowGeometry& row, const Stretch& stretch);

}  // namespace vstent::stents
