#include "deployment/design_file.hpp"

#include <algorithm>
#include <array>
#include <nlohmann/json.hpp>
#include <stdexcept>

#include "deployment/case.hpp"
#include "stents/catalogue.hpp"
#include "stents/fields.hpp"
#include "vessels/error.hpp"
#include "vessels/json_object.hpp"

namespace vstent::deployment {
namespace {

using nlohmann::json;
using nlohmann::ordered_json;
using stents::Need;
using stents::Provenance;
using stents::Specification;

const stents::Words<Provenance> kProvenances = {{"measured", Provenance::measured},
                                                {"inferred", Provenance::inferred},
                                                {"tunable", Provenance::tunable},
                                                {"remembered", Provenance::remembered}};

/// Fills fields from an object; those that are not there keep what they have.
struct FieldReader {
  vessels::ObjectReader& object;

  template <class Value>
  void take(const std::string& name, const std::optional<Value>& given, Value& value, Need need,
            const char* example) {
    if (given) value = *given;
    object.require(need == Need::optional || value > 0, name, example);
  }
  void length(const std::string& name, double& value, Need need) {
    take(name, object.length(name, need == Need::optional), value, need,
         "a length such as \"0.8mm\"");
  }
  void count(const std::string& name, int& value, Need need) {
    take(name, object.integer(name, need == Need::required ? 1 : 0, 100'000), value, need,
         "a whole number");
  }
  void share(const std::string& name, double& value, Need need) {
    take(name, object.number(name, 0, 1, "from 0 to 1"), value, need, "a number from 0 to 1");
  }
  void degrees(const std::string& name, double& value, Need need) {
    take(name, object.number(name, 0, 90, "an angle from 0 to 90 degrees"), value, need,
         "an angle in degrees");
  }
  void number(const std::string& name, double& value, Need need) {
    take(name, object.number(name, 1e-9, 1e9, "a positive number"), value, need,
         "a positive number");
  }
  void maybe(const std::string& name, std::optional<double>& value) {
    if (const auto given = object.number(name, 1e-12, 1e12, "a positive number")) value = given;
  }
  void flag(const std::string& name, bool& value) { value = object.boolean(name).value_or(value); }
  template <class Value>
  void choice(const std::string& name, Value& value, const stents::Words<Value>& words) {
    value = object.choice(name, words).value_or(value);
  }
  template <class Visit>
  void group(const std::string& name, Visit&& visit) {
    vessels::ObjectReader inner_object = object.object(name);
    FieldReader inner{inner_object};
    visit(inner);
    inner_object.finish();
  }
};

/// Writes every field, so that reading finds no default.
struct FieldWriter {
  ordered_json& object;

  void length(const std::string& name, double value, Need) { object[name] = length_text(value); }
  void count(const std::string& name, int value, Need) { object[name] = value; }
  void share(const std::string& name, double value, Need) { object[name] = value; }
  void degrees(const std::string& name, double value, Need) { object[name] = value; }
  void number(const std::string& name, double value, Need) { object[name] = value; }
  void maybe(const std::string& name, const std::optional<double>& value) {
    if (value) object[name] = *value;
  }
  void flag(const std::string& name, bool value) { object[name] = value; }
  template <class Value>
  void choice(const std::string& name, Value value, const stents::Words<Value>& words) {
    for (const auto& [word, meaning] : words) {
      if (meaning == value) object[name] = word;
    }
  }
  template <class Visit>
  void group(const std::string& name, Visit&& visit) {
    ordered_json inner_object = ordered_json::object();
    FieldWriter inner{inner_object};
    visit(inner);
    object[name] = inner_object;
  }
};

template <std::size_t... I>
stents::Parameters parameters_of(std::size_t family, std::index_sequence<I...>) {
  stents::Parameters result;
  ((I == family ? void(result.emplace<I>()) : void()), ...);
  return result;
}

/// Where the file starts from: a preset, or a family's empty parameters.
Specification start_of(vessels::ObjectReader& root) {
  const auto preset = root.text("preset");
  const auto family = root.text("family");
  Specification s;
  std::vector<std::string> families;
  for (std::size_t i = 0; i < std::variant_size_v<stents::Parameters>; ++i) {
    s.pattern =
        parameters_of(i, std::make_index_sequence<std::variant_size_v<stents::Parameters>>());
    families.push_back(stents::family(s));
    if (family == families.back() && !preset) return s;
  }
  const auto listed = [](const std::vector<std::string>& words) {
    std::string line;
    for (const std::string& word : words) line += (line.empty() ? "" : ", ") + word;
    return line;
  };
  if (!preset) {
    root.require(family.has_value(), "family", "one of " + listed(families) + ", or a \"preset\"");
    root.refuse("family", "must be one of " + listed(families) + ", is \"" + *family + "\"");
  }
  const Specification* found = stents::find_preset(*preset);
  if (!found) {
    std::vector<std::string> names;
    for (const Specification& each : stents::catalogue()) names.push_back(each.name);
    root.refuse("preset", "must be one of " + listed(names) + ", is \"" + *preset + "\"");
  }
  if (family && *family != stents::family(*found)) {
    root.refuse("family", *preset + " is of the family " + stents::family(*found));
  }
  return *found;
}

void complete_section(vessels::ObjectReader& root, const json* given,
                      stents::CrossSection& section) {
  const bool says_thickness = given && given->contains("thickness");
  const bool says_edge = given && given->contains("edge_radius");
  if (section.round) {
    if ((says_thickness && section.thickness != section.width) ||
        (says_edge && section.edge_radius != 0.5 * section.width)) {
      root.refuse("section", "a round wire has one width: leave thickness and edge_radius out");
    }
    section.thickness = section.width;
    section.edge_radius = 0.5 * section.width;
    return;
  }
  if (!(section.thickness > 0))
    root.refuse("section/thickness", "is missing: a length such as \"0.08mm\"");
  const double largest = 0.5 * std::min(section.width, section.thickness);
  if (section.edge_radius > largest) {
    root.refuse("section/edge_radius", "must be at most half the width and half the thickness, " +
                                           length_text(largest) + ", is " +
                                           length_text(section.edge_radius));
  }
}

std::vector<stents::Figure> read_figures(vessels::ObjectReader& root, const std::string& source) {
  std::vector<stents::Figure> figures;
  const json* list = root.find("figures");
  if (!list) return figures;
  if (!list->is_array()) root.refuse("figures", "must be a list [ ... ]");
  for (std::size_t i = 0; i < list->size(); ++i) {
    vessels::ObjectReader item((*list)[i], source, root.key("figures") + "/" + std::to_string(i));
    const auto name = item.text("name"), value = item.text("value"), from = item.text("source");
    const auto provenance = item.choice("provenance", kProvenances);
    item.require(name.has_value(), "name", "what the figure is of");
    item.require(provenance.has_value(), "provenance", "how the figure is known");
    item.finish();
    figures.push_back({*name, value.value_or(""), *provenance, from.value_or("")});
  }
  return figures;
}

/// Figures of parameters that differ from the preset's become the file's.
void document_changes(const Specification& before, const std::string& source, Specification& s) {
  const auto old = stents::described(before);
  for (const auto& line : stents::described(s)) {
    if (std::find(old.begin(), old.end(), line) != old.end()) continue;
    const stents::Figure figure{line.first, line.second, Provenance::tunable, "set in " + source};
    const auto known = std::find_if(s.figures.begin(), s.figures.end(),
                                    [&](const auto& f) { return f.name == line.first; });
    if (known == s.figures.end()) {
      s.figures.push_back(figure);
    } else {
      *known = figure;
    }
  }
}

}  // namespace

Specification parse_design(const json& design, const std::string& source) {
  vessels::ObjectReader root(design, source, "");
  if (root.find("surface"))
    root.refuse("surface", "a surface has no parameters to show; `vstent stent` draws it");
  Specification s = start_of(root);
  const Specification before = s;
  s.name = root.text("name").value_or(s.name.empty() ? source : s.name);
  s.description = root.text("description").value_or(s.description);
  // What is counted out has the length that it comes to; a braid is cut to its length.
  const bool counted_out = std::holds_alternative<stents::RingParameters>(s.pattern) ||
                           std::holds_alternative<stents::DiamondParameters>(s.pattern) ||
                           std::holds_alternative<stents::ZParameters>(s.pattern);
  FieldReader reader{root};
  visit_fields(reader, s);
  const bool says_length = root.find("nominal_length") != nullptr;
  complete_section(root, root.find("section"), s.section);
  const bool has_figures = root.find("figures") != nullptr;
  if (has_figures) s.figures = read_figures(root, source);
  root.finish();
  try {
    const auto made = stents::make_design(s);
    if (s.nominal_length == 0 || (counted_out && !says_length))
      s.nominal_length = made->expanded(s.nominal_diameter).length;
  } catch (const std::invalid_argument& error) {
    throw Error(ExitCode::usage, source + ": " + error.what());
  }
  if (!has_figures && !before.figures.empty()) document_changes(before, source, s);
  return s;
}

Specification read_design(const std::filesystem::path& path) {
  return parse_design(vessels::read_json(path), path.string());
}

Specification find_design(const std::string& name_or_path) {
  if (const Specification* preset = stents::find_preset(name_or_path)) return *preset;
  if (std::filesystem::path(name_or_path).extension() == ".json") return read_design(name_or_path);
  std::vector<std::string> names;
  for (const Specification& each : stents::catalogue()) names.push_back(each.name);
  const std::string nearest = vessels::nearest_word(name_or_path, names);
  throw Error(ExitCode::usage,
              "no design is called \"" + name_or_path + "\"" +
                  (nearest.empty() ? "" : "; did you mean \"" + nearest + "\"?") +
                  " (`vstent designs` lists them; a file of one's own ends in .json)");
}

ordered_json to_json(const Specification& specification) {
  ordered_json object;
  object["name"] = specification.name;
  object["description"] = specification.description;
  object["family"] = stents::family(specification);
  FieldWriter writer{object};
  Specification copy = specification;  // fields are visited for reading, too
  visit_fields(writer, copy);
  object["figures"] = ordered_json::array();
  for (const stents::Figure& f : specification.figures) {
    object["figures"].push_back({{"name", f.name},
                                 {"value", f.value},
                                 {"provenance", stents::word(f.provenance)},
                                 {"source", f.source}});
  }
  return object;
}

}  // namespace vstent::deployment
