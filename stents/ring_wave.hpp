// Half a wave of a ring, unrolled: a strut between the tips of two crowns, whose length stays while
// the ring opens.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "stents/parameters.hpp"

namespace vstent::stents {

/// How finely curves are drawn, mm: chords lie at most `sag` off their arc, and reach at most
/// `step` around the circumference.
struct Drawing {
  double sag = 0, step = 0;
};

/// Chords of half a wave: `bend` from a crown's tip to where its bend ends, `straight` between the
/// bends. A sinusoid bends up to its middle.
struct Chords {
  int bend = 0, straight = 0;
};
Chords finer(const Chords& a, const Chords& b);

/// Runs from (0, -height / 2) to (half_width, height / 2). With t = pi/2 - phi, phi the angle of
/// the straight from the axis: zig-zag: half width = straight cos(t) + 2 crown sin(t) / t,
///          height = straight sin(t) + 2 crown (1 - cos(t)) / t, crowns of radius crown / t.
/// sinusoid: z = -height / 2 cos(pi x / half width); strut length = 2 half width / pi sqrt(1 + m^2)
///          E(m / sqrt(1 + m^2)), m = pi height / (2 half width), E the complete elliptic integral.
class RingWave {
 public:
  /// \throws std::invalid_argument lengths that make no strut
  explicit RingWave(const RingParameters& parameters);

  double strut_length() const { return straight_ + 2 * crown_ + sinusoid_; }
  double smallest_half_width() const;  ///< below it a zig-zag's crowns close to loops
  double largest_half_width() const { return strut_length(); }
  double height(double half_width) const;
  double crown_radius(double half_width) const;  ///< at its tip; 0: a sharp corner

  Chords chords(double half_width, const Drawing& drawing) const;
  std::vector<Eigen::Vector2d> points(double half_width, const Chords& chords,
                                      const Drawing& drawing) const;

 private:
  double opening(double half_width) const;    ///< t of a zig-zag
  double steepness(double half_width) const;  ///< m of a sinusoid

  double straight_ = 0, crown_ = 0, sinusoid_ = 0;
};

}  // namespace vstent::stents
