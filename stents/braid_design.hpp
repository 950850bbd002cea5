// Wires wound both ways that run over and under each other.
#pragma once

#include <optional>

#include "stents/design.hpp"
#include "stents/specification.hpp"

namespace vstent::stents {

/// n wires each way cross in rows, half a wire spacing of turn apart, at the mean radius R +- a,
/// a = (d + gap) / 2; the outer radius is R + a + d / 2. From crossing to crossing wires keep their
/// length (inner and outer ones on average, so every wire on the whole), the weave's rise and fall
/// included. Without that, L(R) = sqrt(l^2 - (2 pi R turns)^2).
/// Wires run over 1 (plain) or 2 (twill) crossings, then under as many. Rows turn a little to and
/// fro where that takes wires of one way further than the other's.
class BraidDesign final : public Design {
 public:
  /// Rows are counted out so that the length at nominal comes nearest to `length_mm`.
  /// \throws std::invalid_argument wires that do not fit beside each other, naming the diameter
  BraidDesign(const BraidParameters& parameters, const Specification& specification,
              std::optional<double> length_mm);

  Pattern expanded(const RadiusProfile& outer_radius) const override;
  using Design::expanded;
  Limits limits() const override { return limits_; }
  Cell cell() const override { return Cell::closed; }

  int rows() const { return rows_; }
  /// Of the rows at this mean radius: axial distance and half the turn between them, mm.
  struct Lattice {
    double height = 0, half_width = 0;
  };
  Lattice lattice(double outer_diameter) const;

  /// Whether wire j of a way (+1 or -1) is the outer one in row i.
  bool runs_over(int way, int row, int wire) const;

 private:
  struct RowShape {
    double height = 0;  ///< mm
    double twist = 0;   ///< rad, by which the next row turns against the one before
  };
  using Radius = std::function<double(double u)>;  ///< mean radius at a share of a row
  std::vector<PatternPoint> segment(int way, bool from_over, bool to_over, const Radius& radius,
                                    const RowShape& shape) const;
  double mean_length(int way, bool changes, const Radius& radius, const RowShape& shape) const;
  double kept_length(bool changes) const { return changes ? change_length_ : stay_length_; }
  RowShape row_shape(int row, const Radius& radius, RowShape guess) const;
  double to_mean(double outer_radius) const { return outer_radius - amplitude_ - 0.5 * wire_; }

  int wires_ = 0, over_ = 1, rows_ = 0;
  double wire_ = 0, amplitude_ = 0;                  ///< mm
  double stay_length_ = 0, change_length_ = 0;       ///< mm, crossing to crossing
  std::vector<double> stay_shares_, change_shares_;  ///< where segments are drawn
  RowShape nominal_row_;
  CrossSection section_;
  Limits limits_;
};

}  // namespace vstent::stents
