// Rings in sequence, joined by connectors.
#pragma once

#include "stents/ring_wave.hpp"
#include "stents/specification.hpp"

namespace vstent::stents {

/// Every ring has its own radius R and half width X = pi R / crowns, so that it closes around its
/// circumference, and keeps that radius over its length. Neighbours lie
///   a h_i + span - b h_j
/// apart, with h the rings' lengths and a, b, span as in Connectors. Straight connectors between
/// facing or like crowns run along the axis; offset ones turn the next ring about it, alternately
/// to either side.
class RingDesign : public Design {
 public:
  RingDesign(const RingParameters& parameters, const Specification& specification,
             std::optional<double> length = std::nullopt);

  using Design::expanded;
  Pattern expanded(const RadiusProfile& outer_radius) const override;
  Limits limits() const override { return limits_; }
  Cell cell() const override;

  int rings() const { return rings_; }
  double ring_length(double outer_diameter) const;  ///< mm, between centre lines of crowns
  double pitch(double outer_diameter) const;        ///< mm, from ring to ring

 private:
  struct Placed;  // a ring at one expansion
  double half_width(double radius) const;
  double centre_radius(double outer_diameter) const;
  double span(double left_height, double right_height, double radius_step) const;
  double turn(const Placed& left, const Placed& right, double span) const;
  Member ring_member(const Placed& ring, int index) const;
  void add_connectors(const std::vector<Placed>& rings, int gap, Pattern& pattern) const;
  void derive_limits(const Specification& specification);
  void count_rings(std::optional<double> length);
  Drawing drawing(double radius) const;

  RingParameters parameters_;
  CrossSection section_;
  RingWave wave_;
  Limits limits_;
  double a_ = 0, b_ = 0;  ///< heights of the connectors' ends
  double nominal_height_ = 0;
  double sag_ = 0;
  int rings_ = 0;
  Chords chords_;
};

/// A Z stent is such a sequence: bodies of one ring each, whose bars join like crowns.
RingParameters rings_of(const ZParameters& z);

}  // namespace vstent::stents
