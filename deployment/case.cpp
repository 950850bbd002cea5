#include "deployment/case.hpp"

#include <algorithm>

#include "deployment/wall_material.hpp"
#include "vessels/error.hpp"
#include "vessels/json_object.hpp"
#include "vessels/text.hpp"

namespace vstent::deployment {
namespace {

using nlohmann::json;

const std::vector<std::pair<std::string, Shape>> kShapes = {
    {"tube", Shape::tube}, {"capsule", Shape::capsule}, {"paper", Shape::paper}};
const std::vector<std::pair<std::string, stents::Cell>> kCells = {{"open", stents::Cell::open},
                                                                  {"closed", stents::Cell::closed}};
const std::vector<std::pair<std::string, xpbd::MembraneModel>> kMembranes = {
    {"neo_hookean", xpbd::MembraneModel::neo_hookean}, {"springs", xpbd::MembraneModel::springs}};

template <class Value>
std::string word_for(const std::vector<std::pair<std::string, Value>>& choices, Value value) {
  return std::find_if(choices.begin(), choices.end(),
                      [&](const auto& c) { return c.second == value; })
      ->first;
}

Location parse_location(vessels::ObjectReader& stent) {
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
    vessels::ObjectReader place = stent.object("at");
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

void parse_vessel(vessels::ObjectReader vessel, const std::filesystem::path& relative_to,
                  Case& result) {
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

void parse_stiffness(vessels::ObjectReader& stent, Case& result) {
  result.gives_way = stent.boolean("gives_way").value_or(false);
  result.bending_stiffness =
      stent.number("bending_stiffness_N_mm2", 1e-6, 1e9, "a positive stiffness in N mm2");
  result.radial_stiffness = stent.number("radial_stiffness_N_per_mm2", 1e-9, 1e9,
                                         "a positive stiffness in N/mm2: force per mm of length "
                                         "and mm of diameter");
  for (const char* of_giving : {"bending_stiffness_N_mm2", "radial_stiffness_N_per_mm2"}) {
    if (!result.gives_way && stent.find(of_giving))
      stent.refuse(of_giving, "is for a stent that gives way; add \"gives_way\": true");
  }
}

void parse_stent(vessels::ObjectReader stent, const std::filesystem::path& relative_to,
                 Case& result) {
  result.at = parse_location(stent);
  result.towards = stent.integer("towards", 0, 1'000'000);
  if (const auto design = stent.text("design")) {
    // A word is a preset; what looks like a file is found from where the case is.
    const std::filesystem::path file = *design;
    result.design = file.has_extension() || file.has_parent_path()
                        ? std::filesystem::weakly_canonical(relative_to / file).string()
                        : *design;
  }
  const auto length = stent.length("length");
  stent.require(length.has_value() || !result.design.empty(), "length",
                "the stent's length, such as \"30mm\"");
  result.length = length.value_or(0);
  const json* diameter = stent.find("diameter");
  stent.require(diameter, "diameter", "the lumen diameter to reach, such as \"11mm\", or \"auto\"");
  if (!(diameter->is_string() && diameter->get<std::string>() == "auto"))
    result.diameter = stent.length("diameter");
  result.distal_diameter = stent.length("distal_diameter").value_or(0);
  vessels::ObjectReader flare = stent.object("flare");
  result.flare_diameter = flare.length("diameter").value_or(0);
  result.flare_length = flare.length("length").value_or(0);
  if ((result.flare_diameter > 0) != (result.flare_length > 0)) {
    stent.refuse("flare", "needs both diameter and length");
  }
  if (result.length > 0 && 2 * result.flare_length > result.length) {
    flare.refuse("length", length_text(result.flare_length) +
                               " at both ends is more than the stent's " +
                               length_text(result.length));
  }
  flare.finish();
  for (const char* of_tubes : {"shape", "cell"}) {
    if (!result.design.empty() && stent.find(of_tubes))
      stent.refuse(of_tubes, "is for smooth tubes; the design " + result.design + " has its own");
  }
  result.shape = stent.choice("shape", kShapes).value_or(Shape::tube);
  result.cell = stent.choice("cell", kCells).value_or(stents::Cell::open);
  result.straightening =
      stent.number("straightening", 0, 1, "from 0 (follows the vessel) to 1 (straight)");
  if (result.design.empty() && result.cell == stents::Cell::open &&
      result.straightening.value_or(0) > 0) {
    stent.refuse("straightening",
                 "an open-cell stent follows the vessel; use \"cell\": \"closed\"");
  }
  parse_stiffness(stent, result);
  stent.finish();
}

void parse_wall(vessels::ObjectReader wall, Case& result) {
  std::vector<std::pair<std::string, std::string>> presets{{"elastic", "elastic"},
                                                           {"paper", "paper"}};
  for (const WallPreset& preset : wall_presets()) presets.emplace_back(preset.name, preset.name);
  result.wall_preset = wall.choice("preset", presets).value_or(result.wall_preset);
  result.youngs_modulus =
      wall.number("youngs_modulus_MPa", 1e-6, 1e6, "a positive stiffness in MPa");
  result.thickness = wall.length("thickness");
  result.poisson_ratio = wall.number("poisson_ratio", 0, 0.4999, "from 0 to below 0.5");
  const auto membrane = wall.choice("membrane", kMembranes);
  result.membrane = membrane.value_or(result.membrane);
  result.modulus_array = wall.text("modulus_array").value_or("");
  result.thickness_array = wall.text("thickness_array").value_or("");
  std::vector<std::pair<std::string, std::string>> units;
  for (const auto& [name, value] : kModulusUnits) units.emplace_back(name, name);
  const auto unit = wall.choice("modulus_unit", units);
  if (unit && result.modulus_array.empty())
    wall.refuse("modulus_unit", "is the unit of modulus_array, which is not given");
  if (!result.modulus_array.empty() && !unit)
    wall.refuse("modulus_unit", "is missing: the unit of modulus_array, MPa, kPa, Pa or dyn/cm2");
  result.modulus_unit = unit.value_or(result.modulus_unit);
  if (result.paper_wall() &&
      (result.youngs_modulus || result.thickness || result.poisson_ratio || membrane ||
       !result.modulus_array.empty() || !result.thickness_array.empty())) {
    wall.refuse("preset",
                "\"paper\" has its own constants; leave youngs_modulus_MPa, thickness, "
                "poisson_ratio, membrane and the arrays out");
  }
  if (result.youngs_modulus && !result.modulus_array.empty())
    wall.refuse("modulus_array", "is given as well as youngs_modulus_MPa; leave one out");
  if (result.thickness && !result.thickness_array.empty())
    wall.refuse("thickness_array", "is given as well as thickness; leave one out");
  result.tissue_support =
      wall.number("tissue_support_MPa_per_mm", 0, 1e6, "0 or more, in MPa per mm").value_or(0);
  result.self_collision = wall.boolean("self_collision");
  if (result.paper_wall() && result.self_collision.value_or(false)) {
    wall.refuse("self_collision",
                "needs a wall with a thickness and a modulus; the preset \"paper\" has neither");
  }
  wall.finish();
}

void parse_numerics(vessels::ObjectReader& root, Case& result) {
  vessels::ObjectReader contact = root.object("contact");
  result.contact_distance = contact.length("distance");
  result.contact_stiffness = contact.number("stiffness_N_per_mm", 1e-9, 1e12,
                                            "a positive stiffness in N/mm (leave out: rigid)");
  result.friction = contact.number("friction", 0, 10, "a coefficient from 0 to 10").value_or(0);
  if (result.friction > 0) {
    const auto refuse = [&](const std::string& what) {
      contact.refuse("friction",
                     "is for rigid smooth tubes that follow the vessel, not for " + what);
    };
    if (!result.design.empty()) refuse("struts");
    if (result.contact_stiffness) refuse("soft contact");
    if (result.gives_way) refuse("a stent that gives way");
    if (result.cell == stents::Cell::closed && result.straightening.value_or(1) > 0)
      refuse("one that straightens it");
  }
  if (!result.design.empty() && result.contact_stiffness) {
    contact.refuse("stiffness_N_per_mm",
                   "is for smooth tubes; struts meet the wall rigidly at their own surface");
  }
  if (result.gives_way && result.contact_stiffness) {
    contact.refuse("stiffness_N_per_mm",
                   "is a soft contact; a stent that gives way needs a rigid one");
  }
  contact.finish();
  vessels::ObjectReader patch = root.object("patch");
  result.patch_margin = patch.length("margin");
  result.patch_edge_length = patch.length("edge_length");
  result.keep_refined = patch.boolean("keep_refined").value_or(true);
  patch.finish();
  vessels::ObjectReader level_set = root.object("level_set");
  result.voxel_size = level_set.length("voxel_size");
  level_set.finish();
  vessels::ObjectReader solver = root.object("solver");
  result.growth_per_step = solver.length("growth_per_step");
  result.iterations = solver.integer("iterations", 1, 100'000);
  result.tolerance = solver.number("tolerance", 1e-9, 1, "between 0 and 1");
  result.max_settling_steps = solver.integer("max_settling_steps", 0, 10'000'000);
  solver.finish();
  result.save_steps = root.integer("save_steps", 0, 1'000'000).value_or(0);
}

}  // namespace

std::string length_text(double millimetres) { return vessels::exact(millimetres) + "mm"; }

Case parse_case(const json& specification, const std::string& source,
                const std::filesystem::path& relative_to) {
  vessels::ObjectReader root(specification, source, "");
  Case result;
  root.require(root.find("vessel"), "vessel", "{\"surface\": ..., \"units\": ...}");
  root.require(root.find("stent"), "stent", "{\"at\": ..., \"length\": ..., \"diameter\": ...}");
  parse_vessel(root.object("vessel"), relative_to, result);
  parse_stent(root.object("stent"), relative_to, result);
  parse_wall(root.object("wall"), result);
  parse_numerics(root, result);
  root.finish();
  return result;
}

Case read_case(const std::filesystem::path& path) {
  return parse_case(vessels::read_json(path), path.string(),
                    std::filesystem::absolute(path).parent_path());
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
  if (!c.design.empty()) stent["design"] = c.design;
  if (c.length > 0) stent["length"] = length_text(c.length);
  stent["diameter"] = c.diameter ? length_text(*c.diameter) : "auto";
  if (c.distal_diameter > 0) stent["distal_diameter"] = length_text(c.distal_diameter);
  if (c.flare_length > 0) {
    stent["flare"] = {{"diameter", length_text(c.flare_diameter)},
                      {"length", length_text(c.flare_length)}};
  }
  if (c.design.empty()) {
    stent["shape"] = word_for(kShapes, c.shape);
    stent["cell"] = word_for(kCells, c.cell);
  }
  if (c.straightening) stent["straightening"] = *c.straightening;
  if (c.gives_way) stent["gives_way"] = true;
  if (c.bending_stiffness) stent["bending_stiffness_N_mm2"] = *c.bending_stiffness;
  if (c.radial_stiffness) stent["radial_stiffness_N_per_mm2"] = *c.radial_stiffness;
  auto& wall = result["wall"];
  wall["preset"] = c.wall_preset;
  if (!c.modulus_array.empty()) {
    wall["modulus_array"] = c.modulus_array;
    wall["modulus_unit"] = c.modulus_unit;
  }
  if (!c.thickness_array.empty()) wall["thickness_array"] = c.thickness_array;
  if (c.tissue_support > 0) wall["tissue_support_MPa_per_mm"] = c.tissue_support;
  if (c.self_collision) wall["self_collision"] = *c.self_collision;
  if (c.youngs_modulus) wall["youngs_modulus_MPa"] = *c.youngs_modulus;
  if (c.thickness) wall["thickness"] = length_text(*c.thickness);
  if (c.poisson_ratio) wall["poisson_ratio"] = *c.poisson_ratio;
  if (!c.paper_wall()) wall["membrane"] = word_for(kMembranes, c.membrane);
  if (c.contact_distance) result["contact"]["distance"] = length_text(*c.contact_distance);
  if (c.contact_stiffness) result["contact"]["stiffness_N_per_mm"] = *c.contact_stiffness;
  if (c.friction > 0) result["contact"]["friction"] = c.friction;
  if (c.patch_margin) result["patch"]["margin"] = length_text(*c.patch_margin);
  if (c.patch_edge_length) result["patch"]["edge_length"] = length_text(*c.patch_edge_length);
  if (!c.design.empty()) result["patch"]["keep_refined"] = c.keep_refined;
  if (c.voxel_size) result["level_set"]["voxel_size"] = length_text(*c.voxel_size);
  if (c.growth_per_step) result["solver"]["growth_per_step"] = length_text(*c.growth_per_step);
  if (c.iterations) result["solver"]["iterations"] = *c.iterations;
  if (c.tolerance) result["solver"]["tolerance"] = *c.tolerance;
  if (c.max_settling_steps) result["solver"]["max_settling_steps"] = *c.max_settling_steps;
  result["save_steps"] = c.save_steps;
  return result;
}

}  // namespace vstent::deployment
