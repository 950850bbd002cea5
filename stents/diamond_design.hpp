// Closed diamonds: rows of zig-zag welded crown to crown, or joined there by bridges.
#pragma once

#include "stents/specification.hpp"

namespace vstent::stents {

/// Struts are straight on the unrolled cylinder: with N crowns, a row at centre radius R is
/// sqrt(l^2 - (pi R / N)^2) long, and largest at R = N l / pi. The nodes between two rows share a
/// radius; where it changes along the stent, struts climb their cone.
class DiamondDesign : public Design {
 public:
  DiamondDesign(const DiamondParameters& parameters, const Specification& specification,
                std::optional<double> length = std::nullopt);

  using Design::expanded;
  Pattern expanded(const RadiusProfile& outer_radius) const override;
  Limits limits() const override { return limits_; }
  Cell cell() const override { return Cell::closed; }

  int rows() const { return rows_; }
  double row_length(double outer_diameter) const;  ///< mm, between centre lines of crowns

 private:
  double centre_radius(double outer_diameter) const;
  double row_length(double proximal_radius, double distal_radius) const;

  DiamondParameters parameters_;
  CrossSection section_;
  Limits limits_;
  int rows_ = 0;
  int chords_ = 1;  // per strut
};

}  // namespace vstent::stents
