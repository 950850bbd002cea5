// What presets are written with: dimensions, and the origin of every figure.
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "stents/specification.hpp"

namespace vstent::stents::presets {

struct Origin {
  Provenance provenance;
  std::string source;
};

Origin measured(std::string source);
Origin inferred(std::string source);
Origin tunable(std::string source);
Origin remembered();

/// Names of parameters by their origin.
using Origins = std::vector<std::pair<Origin, std::vector<std::string>>>;

/// Gives every parameter its figure; what `origins` does not name was chosen for the catalogue.
Specification documented(Specification s, const Origins& origins, std::vector<Figure> behaviour);

CrossSection wire(double diameter);
CrossSection strut(double width, double thickness, double edge_radius);

std::vector<Specification> coronary();
std::vector<Specification> peripheral();  ///< large vessels, braids

}  // namespace vstent::stents::presets
