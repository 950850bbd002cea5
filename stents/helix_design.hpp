// A sinusoidal wire wound as a helix, its turns joined at crowns.
#pragma once

#include <functional>
#include <optional>

#include "stents/design.hpp"
#include "stents/specification.hpp"

namespace vstent::stents {

/// Crowns of a strand: peaks (distal) lie at z = s j, valleys at s (j + 1/2) - h, j = 0, 1, .. by
/// units; half waves between them are cosines that keep their lengths at every expansion. Rising
/// ones are longer than falling ones, on average of the strut length, so that both are equally wide
/// when crimped. Peak j is joined to valley j + d of the turn beyond it, d
/// the half-odd number nearest to the units between neighbouring turns, across an axial gap g:
///     h = s d - g.
/// Straight joints keep their length, curved ones their gap, so the pitch follows the waves'
/// height. Where d is those units, crowns face each other exactly. With an end ring the first and
/// last turn run out flat: waves grow from that height over one turn, as short as they are at
/// nominal.
class HelixDesign final : public Design {
 public:
  /// \throws std::invalid_argument a pitch below that of crowns that touch, naming it; joints that
  /// are too short; a limit in mm where waves do not fit
  HelixDesign(const HelixParameters& parameters, const Specification& specification,
              std::optional<double> length_mm);

  Pattern expanded(const RadiusProfile& outer_radius) const override;
  using Design::expanded;
  Limits limits() const override { return limits_; }
  Cell cell() const override { return Cell::open; }

  /// Of a uniform helix: axial advance per unit, height between peaks and valleys, mm; angle per
  /// unit, rad; by how much rising half waves are wider than falling ones, of their mean.
  struct Winding {
    double advance = 0, height = 0, unit_angle = 0, skew = 0;
  };
  Winding winding(double outer_diameter) const;

 private:
  struct Crown {
    double angle = 0, z = 0;
  };
  using Radius = std::function<double(double z)>;  ///< of the centre line
  std::vector<PatternPoint> half_wave(const Crown& a, const Crown& b, const Radius& radius) const;
  double wave_length(const Crown& a, const Crown& b, const Radius& radius) const;
  Crown between(const Crown& a, const Crown& b, double length_a, double length_b, double guess,
                const Radius& radius) const;
  Winding winding_at(double radius) const;
  void balance_struts(double nominal, double crimped, Winding& winding);
  double unit_angle(double skew) const;
  double gap(double radius, double skew) const;
  std::vector<Crown> crowns(const Radius& radius) const;
  void add_joints(const std::vector<Crown>& crowns, const std::vector<int>& places,
                  const Radius& radius, Pattern& pattern) const;
  double centre(double outer_radius) const { return outer_radius - 0.5 * section_.thickness; }

  HelixParameters parameters_;
  CrossSection section_;
  Limits limits_;
  double reach_ = 0;                 ///< units from a peak to the valley that it is joined to
  bool facing_ = false;              ///< exactly
  double rising_ = 0, falling_ = 0;  ///< mm, half waves
  int pieces_ = 0;                   ///< chords of half a wave
  double joint_gap_ = 0, joint_length_ = 0;  ///< mm; of straight joints the length counts
  int first_peak_ = 0, last_peak_ = 0;       ///< that are not flattened
  int last_valley_ = 0;                      ///< the wire ends at last_valley_ + 1/2
  /// Lengths (mm) of the half waves on either side of flattened valleys, then of flattened peaks.
  std::vector<std::pair<double, double>> valley_struts_, peak_struts_;
};

}  // namespace vstent::stents
