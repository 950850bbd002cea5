#include "deployment/case.hpp"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <fstream>
#include <functional>
#include <nlohmann/json.hpp>
#include <set>
#include <sstream>

#include "vessels/error.hpp"

namespace vstent::deployment {
namespace {

using nlohmann::json;
using vessels::LengthUnit;

/// A key as the person wrote it: on the command line the last part of the path is the option's
/// name.
std::string named(const std::string& source, const std::string& key) {
  if (source != kCommandLine) return source + ": " + key;
  const std::string last = key.substr(key.rfind('/') + 1);
  return source + ": " + (last == "surface" ? last : last == "preset" ? "--wall" : "--" + last);
}

[[noreturn]] void fail(const std::string& source, const std::string& key, const std::string& what) {
  throw Error(ExitCode::usage, named(source, key) + ": " + what);
}

std::string shortest(double value) {
  char text[40];
  const auto end = std::to_chars(text, text + sizeof text, value).ptr;
  return {text, end};
}

std::size_t edit_distance(const std::string& a, const std::string& b) {
  std::vector<std::size_t> row(b.size() + 1);
  for (std::size_t j = 0; j <= b.size(); ++j) row[j] = j;
  for (std::size_t i = 1; i <= a.size(); ++i) {
    std::size_t diagonal = row[0];
    row[0] = i;
    for (std::size_t j = 1; j <= b.size(); ++j) {
      const std::size_t above = row[j];
      row[j] = std::min({above + 1, row[j - 1] + 1, diagonal + (a[i - 1] == b[j - 1] ? 0 : 1)});
      diagonal = above;
    }
  }
  return row.back();
}

/// Reads one JSON object key by key, and at the end refuses the keys nobody asked for.
class ObjectReader {
 public:
  ObjectReader(const json& object, std::string source, std::string prefix)
      : object_(object), source_(std::move(source)), prefix_(std::move(prefix)) {
    if (!object.is_object())
      fail(source_, prefix_.empty() ? "/" : prefix_, "must be an object { ... }");
  }

  const json* find(const std::string& key) {
    known_.insert(key);
    const auto found = object_.find(key);
    return found == object_.end() || found->is_null() ? nullptr : &*found;
  }
  std::string key(const std::string& name) const { return prefix_ + "/" + name; }
  [[noreturn]] void refuse(const std::string& name, const std::string& what) const {
    fail(source_, key(name), what);
  }

  std::optional<std::string> text(const std::string& name) {
    const json* value = find(name);
    if (!value) return std::nullopt;
    if (!value->is_string()) refuse(name, "must be text, is " + value->dump());
    return value->get<std::string>();
  }

  /// A positive length with its unit, such as "11mm"; in mm.
  std::optional<double> length(const std::string& name, bool zero_allowed = false) {
    const json* value = find(name);
    if (!value) return std::nullopt;
    if (!value->is_string())
      refuse(name, "must be a length with its unit, such as \"11mm\", is " + value->dump());
    const double millimetres = parse(value->get<std::string>(), name);
    if (!(millimetres > 0) && !(zero_allowed && millimetres == 0)) {
      refuse(name, "must be positive, is " + value->get<std::string>());
    }
    return millimetres;
  }

  std::optional<double> number(const std::string& name, double low, double high,
                               const std::string& allowed) {
    const json* value = find(name);
    if (!value) return std::nullopt;
    if (!value->is_number()) refuse(name, "must be a number " + allowed + ", is " + value->dump());
    const double number = value->get<double>();
    if (!(number >= low && number <= high))
      refuse(name, "must be " + allowed + ", is " + value->dump());
    return number;
  }

  std::optional<int> integer(const std::string& name, int low, int high) {
    const json* value = find(name);
    if (!value) return std::nullopt;
    const std::string allowed =
        "a whole number from " + std::to_string(low) + " to " + std::to_string(high);
    if (!value->is_number_integer()) refuse(name, "must be " + allowed + ", is " + value->dump());
    const auto number = value->get<std::int64_t>();
    if (number < low || number > high) refuse(name, "must be " + allowed + ", is " + value->dump());
    return static_cast<int>(number);
  }

  template <class Value>
  std::optional<Value> choice(const std::string& name,
                              const std::vector<std::pair<std::string, Value>>& choices) {
    const auto given = text(name);
    if (!given) return std::nullopt;
    std::string allowed;
    for (const auto& [word, value] : choices) {
      if (word == *given) return value;
      allowed += (allowed.empty() ? "" : ", ") + word;
    }
    refuse(name, "must be one of " + allowed + ", is \"" + *given + "\"");
  }

  ObjectReader object(const std::string& name) {
    static const json empty = json::object();
    const json* value = find(name);
    return {value ? *value : empty, source_, key(name)};
  }

  void require(bool present, const std::string& name, const std::string& what) const {
    if (!present) refuse(name, "is missing: " + what);
  }

  void finish() const {
    for (const auto& [name, value] : object_.items()) {
      if (known_.contains(name)) continue;
      std::string nearest;
      std::size_t best = 4;
      for (const std::string& known : known_) {
        const std::size_t distance = edit_distance(name, known);
        if (distance < best) best = distance, nearest = known;
      }
      refuse(name, "unknown key" +
                       (nearest.empty() ? std::string() : "; did you mean \"" + nearest + "\"?"));
    }
  }

  double parse(const std::string& given, const std::string& name) const {
    if (!given.empty() && !std::isalpha(static_cast<unsigned char>(given.back()))) {
      refuse(name, "needs a unit (mm, cm or m), is \"" + given + "\"");
    }
    return vessels::parse_length(given, LengthUnit::mm, named(source_, key(name)));
  }

 private:
  const json& object_;
  std::string source_, prefix_;
  std::set<std::string> known_;
};

const std::vector<std::pair<std::string, Shape>> kShapes = {
    {"tube", Shape::tube}, {"capsule", Shape::capsule}, {"paper", Shape::paper}};
const std::vector<std::pair<std::string, stents::Cell>> kCells = {{"open", stents::Cell::open},
                                                                  {"closed", stents::Cell::closed}};
template <class Value>
std::string word_for(const std::vector<std::pair<std::string, Value>>& choices, Value value) {
  return std::find_if(choices.begin(), choices.end(),
                      [&](const auto& c) { return c.second == value; })
      ->first;
}

Location parse_location(ObjectReader& stent) {
  const json* at = stent.find("at");
  stent.require(at, "at",
                "a point [x, y, z], \"lesion\", or {\"branch\": 0, \"arc_length\": \"12mm\"}");
  if (at->is_string() && at->get<std::string>() == "lesion") return Lesion{};
  if (at->is_array() && at->size() == 3 &&
      std::all_of(at->begin(), at->end(), [](const json& x) { return x.is_number(); })) {
    const AtPoint place{
        Vec3((*at)[0].get<double>(), (*at)[1].get<double>(), (*at)[2].get<double>())};
    if (!place.point.allFinite()) stent.refuse("at", "must be finite, is " + at->dump());
    return place;
  }
  if (at->is_object()) {
    ObjectReader place = stent.object("at");
    const auto branch = place.integer("branch", 0, 1'000'000);
    const auto arc_length = place.length("arc_length", true);
    place.require(branch.has_value(), "branch",
                  "a branch id of the centerline, see `vstent centerline`");
    place.require(arc_length.has_value(), "arc_length",
                  "a length along the branch, such as \"12mm\"");
    place.finish();
    return AtArcLength{*branch, *arc_length};
  }
  stent.refuse(
      "at",
      "must be a point [x, y, z], \"lesion\", or {\"branch\": ..., \"arc_length\": ...}, is " +
          at->dump());
}

void parse_vessel(ObjectReader vessel, const std::filesystem::path& relative_to, Case& result) {
  const auto surface = vessel.text("surface");
  vessel.require(surface.has_value(), "surface", "the file of the lumen surface");
  result.surface = std::filesystem::weakly_canonical(relative_to / *surface);
  const auto units = vessel.text("units");
  vessel.require(units.has_value(), "units", "the surface's length unit: mm, cm or m");
  try {
    result.unit = vessels::parse_unit(*units);
  } catch (const Error&) {
    vessel.refuse("units", "must be mm, cm or m, is \"" + *units + "\"");
  }
  if (const auto centerline = vessel.text("centerline")) {
    result.centerline = std::filesystem::weakly_canonical(relative_to / *centerline);
  }
  vessel.finish();
}

void parse_stent(ObjectReader stent, Case& result) {
  result.at = parse_location(stent);
  result.towards = stent.integer("towards", 0, 1'000'000);
  const auto length = stent.length("length");
  stent.require(length.has_value(), "length", "the stent's length, such as \"30mm\"");
  result.length = *length;
  const json* diameter = stent.find("diameter");
  stent.require(diameter, "diameter", "the lumen diameter to reach, such as \"11mm\", or \"auto\"");
  if (!(diameter->is_string() && diameter->get<std::string>() == "auto"))
    result.diameter = stent.length("diameter");
  result.distal_diameter = stent.length("distal_diameter").value_or(0);
  ObjectReader flare = stent.object("flare");
  result.flare_diameter = flare.length("diameter").value_or(0);
  result.flare_length = flare.length("length").value_or(0);
  if ((result.flare_diameter > 0) != (result.flare_length > 0)) {
    stent.refuse("flare", "needs both diameter and length");
  }
  if (2 * result.flare_length > result.length) {
    flare.refuse("length", length_text(result.flare_length) +
                               " at both ends is more than the stent's " +
                               length_text(result.length));
  }
  flare.finish();
  result.shape = stent.choice("shape", kShapes).value_or(Shape::tube);
  result.cell = stent.choice("cell", kCells).value_or(stents::Cell::open);
  result.straightening =
      stent.number("straightening", 0, 1, "from 0 (follows the vessel) to 1 (straight)");
  if (result.cell == stents::Cell::open && result.straightening.value_or(0) > 0) {
    stent.refuse("straightening",
                 "an open-cell stent follows the vessel; use \"cell\": \"closed\"");
  }
  stent.finish();
}

void parse_wall(ObjectReader wall, Case& result) {
  const auto preset = wall.choice<bool>("preset", {{"paper", true}, {"elastic", false}});
  result.paper_wall = preset.value_or(false);
  result.youngs_modulus =
      wall.number("youngs_modulus_MPa", 1e-6, 1e6, "a positive stiffness in MPa");
  result.thickness = wall.length("thickness");
  result.poisson_ratio = wall.number("poisson_ratio", 0, 0.4999, "from 0 to below 0.5");
  if (result.paper_wall && (result.youngs_modulus || result.thickness || result.poisson_ratio)) {
    wall.refuse("preset",
                "\"paper\" has its own constants; leave youngs_modulus_MPa, thickness and "
                "poisson_ratio out");
  }
  wall.finish();
}

void parse_numerics(ObjectReader& root, Case& result) {
  ObjectReader contact = root.object("contact");
  result.contact_distance = contact.length("distance");
  result.contact_stiffness = contact.number("stiffness_N_per_mm", 1e-9, 1e12,
                                            "a positive stiffness in N/mm (leave out: rigid)");
  contact.finish();
  ObjectReader patch = root.object("patch");
  result.patch_margin = patch.length("margin");
  patch.finish();
  ObjectReader level_set = root.object("level_set");
  result.voxel_size = level_set.length("voxel_size");
  level_set.finish();
  ObjectReader solver = root.object("solver");
  result.growth_per_step = solver.length("growth_per_step");
  result.iterations = solver.integer("iterations", 1, 100'000);
  result.tolerance = solver.number("tolerance", 1e-9, 1, "between 0 and 1");
  result.max_settling_steps = solver.integer("max_settling_steps", 0, 10'000'000);
  solver.finish();
  result.save_steps = root.integer("save_steps", 0, 1'000'000).value_or(0);
}

/// nlohmann keeps the last of repeated keys; a repeated key in a case file is a mistake to point
/// at.
void refuse_repeated_keys(const std::string& text, const std::string& source) {
  std::vector<std::set<std::string>> open_objects;
  const json::parser_callback_t watch = [&](int, json::parse_event_t event, json& parsed) {
    if (event == json::parse_event_t::object_start) open_objects.emplace_back();
    if (event == json::parse_event_t::object_end) open_objects.pop_back();
    if (event == json::parse_event_t::key &&
        !open_objects.back().insert(parsed.get<std::string>()).second) {
      fail(source, parsed.get<std::string>(), "the key appears twice in one object");
    }
    return true;
  };
  const json ignored = json::parse(text, watch);
}

}  // namespace

std::string length_text(double millimetres) { return shortest(millimetres) + "mm"; }

Case parse_case(const json& specification, const std::string& source,
                const std::filesystem::path& relative_to) {
  ObjectReader root(specification, source, "");
  Case result;
  root.require(root.find("vessel"), "vessel", "{\"surface\": ..., \"units\": ...}");
  root.require(root.find("stent"), "stent", "{\"at\": ..., \"length\": ..., \"diameter\": ...}");
  parse_vessel(root.object("vessel"), relative_to, result);
  parse_stent(root.object("stent"), result);
  parse_wall(root.object("wall"), result);
  parse_numerics(root, result);
  root.finish();
  return result;
}

Case read_case(const std::filesystem::path& path) {
  std::error_code ignored;
  if (std::filesystem::is_directory(path, ignored)) {
    throw Error(ExitCode::usage, path.string() + ": is a folder; give the case file in it");
  }
  std::ifstream file(path, std::ios::binary);
  if (!file) throw Error(ExitCode::usage, path.string() + ": cannot be read; is the path right?");
  std::ostringstream text;
  text << file.rdbuf();
  json specification;
  try {
    specification = json::parse(text.str());
    refuse_repeated_keys(text.str(), path.string());
  } catch (const json::parse_error& error) {
    const std::string what = error.what();
    const std::size_t at = what.find("at line");
    throw Error(ExitCode::usage, path.string() + ": not JSON, " +
                                     (at == std::string::npos ? what : what.substr(at)));
  }
  return parse_case(specification, path.string(), std::filesystem::absolute(path).parent_path());
}

nlohmann::ordered_json to_json(const Case& c) {
  nlohmann::ordered_json result;
  auto& vessel = result["vessel"];
  vessel["surface"] = c.surface.string();
  vessel["units"] = std::string(vessels::name(c.unit));
  if (!c.centerline.empty()) vessel["centerline"] = c.centerline.string();
  auto& stent = result["stent"];
  if (const auto* point = std::get_if<AtPoint>(&c.at)) {
    stent["at"] = {point->point.x(), point->point.y(), point->point.z()};
  } else if (const auto* arc = std::get_if<AtArcLength>(&c.at)) {
    stent["at"] = {{"branch", arc->branch}, {"arc_length", length_text(arc->arc_length)}};
  } else {
    stent["at"] = "lesion";
  }
  if (c.towards) stent["towards"] = *c.towards;
  stent["length"] = length_text(c.length);
  stent["diameter"] = c.diameter ? length_text(*c.diameter) : "auto";
  if (c.distal_diameter > 0) stent["distal_diameter"] = length_text(c.distal_diameter);
  if (c.flare_length > 0) {
    stent["flare"] = {{"diameter", length_text(c.flare_diameter)},
                      {"length", length_text(c.flare_length)}};
  }
  stent["shape"] = word_for(kShapes, c.shape);
  stent["cell"] = word_for(kCells, c.cell);
  if (c.straightening) stent["straightening"] = *c.straightening;
  auto& wall = result["wall"];
  wall["preset"] = c.paper_wall ? "paper" : "elastic";
  if (c.youngs_modulus) wall["youngs_modulus_MPa"] = *c.youngs_modulus;
  if (c.thickness) wall["thickness"] = length_text(*c.thickness);
  if (c.poisson_ratio) wall["poisson_ratio"] = *c.poisson_ratio;
  if (c.contact_distance) result["contact"]["distance"] = length_text(*c.contact_distance);
  if (c.contact_stiffness) result["contact"]["stiffness_N_per_mm"] = *c.contact_stiffness;
  if (c.patch_margin) result["patch"]["margin"] = length_text(*c.patch_margin);
  if (c.voxel_size) result["level_set"]["voxel_size"] = length_text(*c.voxel_size);
  if (c.growth_per_step) result["solver"]["growth_per_step"] = length_text(*c.growth_per_step);
  if (c.iterations) result["solver"]["iterations"] = *c.iterations;
  if (c.tolerance) result["solver"]["tolerance"] = *c.tolerance;
  if (c.max_settling_steps) result["solver"]["max_settling_steps"] = *c.max_settling_steps;
  result["save_steps"] = c.save_steps;
  return result;
}

}  // namespace vstent::deployment
