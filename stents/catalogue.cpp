#include "stents/catalogue.hpp"

#include <algorithm>
#include <array>
#include <map>
#include <stdexcept>

#include "stents/fields.hpp"
#include "stents/presets.hpp"

namespace vstent::stents {
namespace presets {

Origin measured(std::string source) { return {Provenance::measured, std::move(source)}; }
Origin inferred(std::string source) { return {Provenance::inferred, std::move(source)}; }
Origin tunable(std::string source) { return {Provenance::tunable, std::move(source)}; }
Origin remembered() {
  return {Provenance::remembered, "general knowledge, not checked against a source"};
}

Specification documented(Specification s, const Origins& origins, std::vector<Figure> behaviour) {
  std::map<std::string, Origin> origin_of;
  for (const auto& [origin, names] : origins) {
    for (const std::string& name : names) origin_of.emplace(name, origin);
  }
  for (const auto& [name, value] : described(s)) {
    const auto found = origin_of.find(name);
    const Origin origin =
        found == origin_of.end() ? tunable("chosen for this catalogue") : found->second;
    s.figures.push_back({name, value, origin.provenance, origin.source});
    if (found != origin_of.end()) origin_of.erase(found);
  }
  if (!origin_of.empty())
    throw std::logic_error(s.name + ": no parameter " + origin_of.begin()->first);
  s.figures.insert(s.figures.end(), behaviour.begin(), behaviour.end());
  return s;
}

CrossSection wire(double diameter) { return {true, diameter, diameter, 0.5 * diameter}; }
CrossSection strut(double width, double thickness, double edge_radius) {
  return {false, width, thickness, edge_radius};
}

}  // namespace presets

const std::vector<Specification>& catalogue() {
  static const std::vector<Specification> designs = [] {
    std::vector<Specification> all = presets::coronary();
    for (Specification& s : presets::peripheral()) all.push_back(std::move(s));
    return all;
  }();
  return designs;
}

const Specification* find_preset(const std::string& name) {
  const auto& presets = catalogue();
  const auto found = std::find_if(presets.begin(), presets.end(),
                                  [&](const Specification& s) { return s.name == name; });
  return found == presets.end() ? nullptr : &*found;
}

std::string_view word(Provenance provenance) {
  constexpr std::array kWords = {"measured", "inferred", "tunable", "remembered"};
  return kWords[static_cast<std::size_t>(provenance)];
}

}  // namespace vstent::stents
