// One wire wound as a coil.
#pragma once

#include <optional>

#include "stents/design.hpp"
#include "stents/specification.hpp"

namespace vstent::stents {

/// A wire of length l at angle b from the circumference has n = l cos b / (2 pi R) turns and is
/// L = l sin b = n p long. As it opens it unwinds, and sin b goes with R^e: at e = 0 the angle and
/// so the length stay, at e = 1 the wire only unbends and keeps its torsion sin b cos b / R (to
/// first order in b). e follows from `lengthening`; a spine keeps the length, e = 0.
class CoilDesign final : public Design {
 public:
  /// Turns are counted out so that the length at nominal is `length_mm`.
  /// \throws std::invalid_argument turns that touch when crimped
  CoilDesign(const CoilParameters& parameters, const Specification& specification,
             std::optional<double> length_mm);

  Pattern expanded(const RadiusProfile& outer_radius) const override;
  using Design::expanded;
  Limits limits() const override { return limits_; }
  /// Turns follow a bend one by one.
  Cell cell() const override { return Cell::open; }

  double turns(double outer_diameter) const;

 private:
  double sine(double radius) const;

  double wire_length_ = 0, nominal_radius_ = 0, nominal_sine_ = 0, exponent_ = 0;
  int pieces_ = 0;
  bool spine_ = false;
  CrossSection section_;
  Limits limits_;
};

}  // namespace vstent::stents
