// A stent design as data: its family's parameters, its dimensions, and where every figure is from.
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "stents/design.hpp"
#include "stents/parameters.hpp"

namespace vstent::stents {

/// measured: published by somebody who measured it, or the maker's own published figure.
/// inferred: follows from published figures, or is of a published model. tunable: chosen so that a
/// published behaviour is met, or freely. remembered: general knowledge that was not checked
/// against a source.
enum class Provenance { measured, inferred, tunable, remembered };

struct Figure {
  std::string name;   ///< of a parameter ("connectors/count") or of what the design does
  std::string value;  ///< as a person reads it, with its unit
  Provenance provenance = Provenance::tunable;
  std::string source;  ///< a citation, or how it was arrived at
};

/// Sleeves of a stent graft, mm thick; 0: none.
struct Cover {
  double inner = 0, outer = 0;
};

using Parameters = std::variant<RingParameters, DiamondParameters, ZParameters, BraidParameters,
                                HelixParameters, CoilParameters>;

/// Diameters are outer. Lengths in mm.
struct Specification {
  std::string name, description;
  Parameters pattern;
  CrossSection section;
  double nominal_diameter = 0;
  double nominal_length = 0;  ///< at nominal diameter
  double crimped_diameter = 0;
  double smallest_use = 0, largest_use = 0;  ///< diameters that it is meant for; 0: not known
  Cover cover = {};
  double recoil = 0;  ///< share of the diameter lost after deflation
  std::optional<double> radial_stiffness =
      {};  ///< N/mm^2: force per mm of length and mm of diameter
  std::optional<double> bending_stiffness = {};  ///< N mm^2, expanded
  std::vector<Figure> figures = {};

  /// How far drawn chords may lie off their arcs: of the width in the pattern's plane, of the
  /// thickness below the cylinder.
  double largest_sag = 0.02;
};

/// "rings", "diamonds", "z", "braid", "helix", "coil"
std::string family(const Specification& specification);

/// Counts out rings, rows, turns so that the length at nominal diameter comes nearest to
/// `length` (mm); without one, to the specification's own. What it came to, Pattern::length says.
/// \throws std::invalid_argument parameters that no stent can have; the message says which and why
std::unique_ptr<const Design> make_design(const Specification& specification,
                                          std::optional<double> length = std::nullopt);

}  // namespace vstent::stents
