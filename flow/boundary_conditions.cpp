#include "flow/boundary_conditions.hpp"

#include <algorithm>
#include <cmath>
#include <functional>
#include <nlohmann/json.hpp>

#include "flow/simvascular_files.hpp"
#include "vessels/error.hpp"
#include "vessels/json_object.hpp"
#include "vessels/text.hpp"

namespace vstent::flow {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;
using vessels::ObjectReader;

/// What a file says that is being read, and where.
struct Source {
  std::string file;
  fs::path folder;
};

std::string full_key(const Source& source, const ObjectReader& object, const std::string& name) {
  return source.file + ": " + object.key(name);
}

std::optional<double> quantity(ObjectReader& object, const std::string& name, Dimension dimension,
                               const Source& source) {
  const json* value = object.find(name);
  if (!value) return std::nullopt;
  if (!value->is_string())
    object.refuse(name, "must be text with a number and its unit, is " + value->dump());
  return parse_quantity(value->get<std::string>(), dimension, full_key(source, object, name));
}

double needed(ObjectReader& object, const std::string& name, Dimension dimension,
              const Source& source, bool zero_allowed) {
  const std::optional<double> value = quantity(object, name, dimension, source);
  object.require(value.has_value(), name, "give it with its unit");
  if (!(*value > 0) && !(zero_allowed && *value == 0))
    object.refuse(name, std::string("must be positive") + (zero_allowed ? " or 0" : ""));
  return *value;
}

fs::path existing(ObjectReader& object, const std::string& name, const Source& source) {
  const auto given = object.text(name);
  object.require(given.has_value(), name, "the path of a file");
  const fs::path path = (source.folder / *given).lexically_normal();
  if (!fs::exists(path)) object.refuse(name, path.string() + " does not exist");
  return path;
}

/// Physiological and laboratory blood; a slip of units leaves these by far.
Blood read_blood(ObjectReader& root, const Source& source) {
  Blood blood;
  if (const auto viscosity = quantity(root, "viscosity", Dimension::viscosity, source)) {
    if (!(*viscosity >= 0.005 && *viscosity <= 0.3)) {
      root.refuse("viscosity", vessels::number(*viscosity) +
                                   " P is not that of blood (0.03 to 0.05 P in large vessels; "
                                   "0.005 to 0.3 P is taken): is the unit right?");
    }
    blood.viscosity = *viscosity;
  }
  if (const auto density = quantity(root, "density", Dimension::density, source)) {
    if (!(*density >= 0.8 && *density <= 1.3)) {
      root.refuse("density", vessels::number(*density) +
                                 " g/mL is not that of blood (1.05 to 1.06 g/mL; 0.8 to 1.3 is "
                                 "taken): is the unit right?");
    }
    blood.density = *density;
  }
  return blood;
}

Inflow read_inflow(ObjectReader& face, const Source& source, std::vector<std::string>& notes) {
  const json& given = *face.find("inflow");
  const std::string key = full_key(source, face, "inflow");
  if (given.is_string()) {
    const double value = parse_quantity(given.get<std::string>(), Dimension::flow, key);
    if (!(value > 0))
      face.refuse("inflow", "is " + given.dump() + "; flow into the vessel is positive here");
    return {constant(value), false};
  }
  ObjectReader inflow = face.object("inflow");
  const fs::path path = existing(inflow, "file", source);
  const std::string units = inflow.text("units").value_or("");
  const auto positive = inflow.choice<bool>("positive", {{"in", true}, {"out", false}});
  inflow.finish();
  WaveformFile file = read_waveform(path, units, full_key(source, inflow, "units"));
  notes.insert(notes.end(), file.notes.begin(), file.notes.end());
  return inflow_of(std::move(file), positive, path.string(), full_key(source, inflow, "positive"),
                   notes);
}

Rcr read_rcr(ObjectReader object, const Source& source) {
  Rcr rcr;
  rcr.proximal = needed(object, "Rp", Dimension::resistance, source, true);
  rcr.capacitance = needed(object, "C", Dimension::compliance, source, true);
  rcr.distal = needed(object, "Rd", Dimension::resistance, source, false);
  rcr.distal_pressure =
      quantity(object, "distal_pressure", Dimension::pressure, source).value_or(0);
  object.finish();
  return rcr;
}

Waveform read_pressures(ObjectReader& object, const std::string& name, const Source& source) {
  const json* given = object.find(name);
  if (!given) return constant(0);
  if (given->is_string()) return constant(*quantity(object, name, Dimension::pressure, source));
  ObjectReader inner = object.object(name);
  const auto read = [&](const std::string& array, Dimension dimension) {
    const auto units = inner.text(array + "_units");
    inner.require(units.has_value(), array + "_units", "the unit of " + array);
    const double cgs = cgs_per(*units, dimension, full_key(source, inner, array + "_units"));
    const json* values = inner.find(array);
    inner.require(values && values->is_array() && values->size() >= 2, array,
                  "a list of two numbers or more");
    std::vector<double> result;
    for (const json& value : *values) {
      if (!value.is_number()) inner.refuse(array, "has " + value.dump() + ", which is no number");
      result.push_back(value.get<double>() * cgs);
    }
    return result;
  };
  Waveform w{read("time", Dimension::time), read("pressure", Dimension::pressure)};
  inner.finish();
  if (w.time.size() != w.value.size() || w.time.front() != 0 ||
      std::adjacent_find(w.time.begin(), w.time.end(), std::greater_equal<>()) != w.time.end() ||
      w.value.front() != w.value.back()) {
    object.refuse(name, "must have as many times as pressures, rising from 0, and end as it began");
  }
  return w;
}

Coronary read_coronary(ObjectReader object, const Source& source) {
  Coronary c;
  c.arterial = needed(object, "Ra", Dimension::resistance, source, true);
  c.arterial_compliance = needed(object, "Ca", Dimension::compliance, source, true);
  c.micro = needed(object, "Ra_micro", Dimension::resistance, source, true);
  c.micro_compliance = needed(object, "Cim", Dimension::compliance, source, true);
  c.venous = needed(object, "Rv", Dimension::resistance, source, false);
  c.intramyocardial_pressure = read_pressures(object, "intramyocardial_pressure", source);
  c.venous_pressure = quantity(object, "venous_pressure", Dimension::pressure, source).value_or(0);
  object.finish();
  return c;
}

constexpr const char* kKinds[] = {"inflow", "resistance", "rcr", "pressure", "coronary"};

std::string kind_of(ObjectReader& face, const std::string& name, ObjectReader& faces) {
  std::string kind;
  for (const char* k : kKinds) {
    if (!face.find(k)) continue;
    if (!kind.empty()) faces.refuse(name, "has both " + kind + " and " + k + "; give one");
    kind = k;
  }
  if (kind.empty()) {
    face.finish();  // a misspelt kind is named first
    faces.refuse(name, "has no condition: inflow, resistance, rcr, pressure or coronary");
  }
  return kind;
}

Condition read_condition(const std::string& kind, ObjectReader& face, const Source& source,
                         std::vector<std::string>& notes) {
  if (kind == "inflow") return read_inflow(face, source, notes);
  if (kind == "rcr") return read_rcr(face.object("rcr"), source);
  if (kind == "coronary") return read_coronary(face.object("coronary"), source);
  if (kind == "pressure") return Pressure{*quantity(face, "pressure", Dimension::pressure, source)};
  const double resistance = needed(face, "resistance", Dimension::resistance, source, false);
  return Resistance{resistance,
                    quantity(face, "distal_pressure", Dimension::pressure, source).value_or(0)};
}

std::optional<std::array<double, 3>> read_point(ObjectReader& face) {
  const json* near = face.find("near");
  if (!near) return std::nullopt;
  const bool numbers =
      near->is_array() && near->size() == 3 &&
      std::all_of(near->begin(), near->end(), [](const json& x) { return x.is_number(); });
  if (!numbers) face.refuse("near", "must be [x, y, z], coordinates of the surface's file");
  return near->get<std::array<double, 3>>();
}

void read_faces(ObjectReader& root, const Source& source, BoundaryConditions& result) {
  const json* given = root.find("faces");
  if (!given) return;
  ObjectReader faces = root.object("faces");
  for (const auto& [name, value] : given->items()) {
    ObjectReader face = faces.object(name);
    const std::string kind = kind_of(face, name, faces);
    FaceCondition entry{name, read_condition(kind, face, source, result.notes),
                        face.integer("face_id", -1'000'000'000, 1'000'000'000), read_point(face)};
    face.finish();
    result.faces.push_back(std::move(entry));
  }
}

void add(std::vector<NamedCondition> conditions, ObjectReader& root, const std::string& key,
         BoundaryConditions& result) {
  for (NamedCondition& entry : conditions) {
    if (result.find(entry.name))
      root.refuse(key, "gives a condition for " + entry.name + ", which has one already");
    result.faces.push_back({entry.name, std::move(entry.condition), {}, {}});
  }
}

UnitSystem unit_system(ObjectReader& object) {
  const auto units = object.choice<UnitSystem>(
      "units", {{"cgs", UnitSystem::cgs}, {"mm-g-s", UnitSystem::mm_g_s}});
  object.require(units.has_value(), "units", "cgs (dyn s/cm5) or mm-g-s");
  return *units;
}

void read_simvascular_files(ObjectReader& root, const Source& source, BoundaryConditions& result) {
  if (root.find("rcrt")) {
    ObjectReader rcrt = root.object("rcrt");
    const fs::path path = existing(rcrt, "file", source);
    const fs::path outlets = rcrt.find("outlets") ? existing(rcrt, "outlets", source) : fs::path();
    const UnitSystem units = unit_system(rcrt);
    rcrt.finish();
    add(read_rcrt(path, outlets, units), root, "rcrt", result);
  }
  if (root.find("resistances")) {
    ObjectReader resistances = root.object("resistances");
    const fs::path path = existing(resistances, "file", source);
    const UnitSystem units = unit_system(resistances);
    resistances.finish();
    add(read_resistances(path, units), root, "resistances", result);
  }
}

std::string listed(const std::vector<std::string>& names) {
  std::string text;
  for (const std::string& name : names) text += (text.empty() ? "" : ", ") + name;
  return text;
}

}  // namespace

bool is_inflow(const Condition& condition) { return std::holds_alternative<Inflow>(condition); }

std::string describe(const Condition& condition) {
  using vessels::number;
  const auto mmhg = [](double p) { return number(p / kDynPerCm2PerMmHg) + " mmHg"; };
  if (const auto* inflow = std::get_if<Inflow>(&condition)) {
    const Waveform& w = inflow->waveform;
    return "inflow, mean " + number(mean(w)) + (inflow->velocity ? " cm/s" : " mL/s") +
           (w.constant() ? "" : ", period " + number(w.period()) + " s");
  }
  if (const auto* r = std::get_if<Resistance>(&condition))
    return "resistance " + number(r->resistance) + " dyn s/cm5 to " + mmhg(r->distal_pressure);
  if (const auto* rcr = std::get_if<Rcr>(&condition))
    return "RCR " + number(rcr->proximal) + ", " + number(rcr->capacitance) + ", " +
           number(rcr->distal) + " (cgs) to " + mmhg(rcr->distal_pressure);
  if (const auto* pressure = std::get_if<Pressure>(&condition))
    return "pressure " + mmhg(pressure->pressure);
  const auto& c = std::get<Coronary>(condition);
  return "coronary bed, " + number(c.arterial + c.micro + c.venous) + " dyn s/cm5 to " +
         mmhg(c.venous_pressure);
}

Inflow inflow_of(WaveformFile file, std::optional<bool> positive_in, const std::string& path,
                 const std::string& key, std::vector<std::string>& notes) {
  const bool velocity = file.dimension == Dimension::velocity;
  const double net = mean(file.waveform);
  double gross = 0;
  for (const double v : file.waveform.value) gross += std::abs(v);
  gross /= static_cast<double>(file.waveform.value.size());
  const std::string mean_text =
      "its mean is " + vessels::number(net) + (velocity ? " cm/s" : " mL/s");
  if (positive_in) {
    if (net == 0 || (net > 0) != *positive_in) {
      throw Error(ExitCode::usage, key + ": \"" + (*positive_in ? "in" : "out") +
                                       "\" contradicts " + path + ": " + mean_text +
                                       ", so that no blood would enter the vessel here");
    }
  } else if (std::abs(net) < 0.1 * gross || net == 0) {
    throw Error(ExitCode::usage, key + ": is missing: " + path + " flows as much to as fro (" +
                                     mean_text + "); say which way is positive, in or out");
  }
  if (net > 0) {
    if (!velocity && !positive_in) {
      notes.push_back(path + ": " + mean_text +
                      ", taken as flow into the vessel (SimVascular's 3-D files write that "
                      "negative, and so does this program for them)");
    }
    return {std::move(file.waveform), velocity};
  }
  notes.push_back(path + ": " + mean_text +
                  ", SimVascular's sign for flow into the vessel; turned to be positive inwards");
  return {times(std::move(file.waveform), -1), velocity};
}

const FaceCondition* BoundaryConditions::find(const std::string& name) const {
  const auto found = std::find_if(faces.begin(), faces.end(),
                                  [&](const FaceCondition& face) { return face.name == name; });
  return found == faces.end() ? nullptr : &*found;
}

BoundaryConditions read_boundary_conditions(const fs::path& path) {
  const json given = vessels::read_json(path);
  const Source source{path.string(), fs::absolute(path).parent_path()};
  ObjectReader root(given, source.file, "");
  BoundaryConditions result;
  result.source = source.file;
  result.blood = read_blood(root, source);
  root.text("description");
  read_faces(root, source, result);
  read_simvascular_files(root, source, result);
  if (root.find("caps")) {
    result.caps = existing(root, "caps", source);
    if (!fs::is_directory(result.caps))
      root.refuse("caps", result.caps.string() + " is no folder of one surface per face");
  }
  root.finish();
  const auto inflows = std::count_if(result.faces.begin(), result.faces.end(),
                                     [](const FaceCondition& f) { return is_inflow(f.condition); });
  if (inflows == 0) root.refuse("faces", "no face has an inflow");
  if (inflows == static_cast<std::ptrdiff_t>(result.faces.size()))
    root.refuse("faces", "no face is an outlet (resistance, rcr, pressure or coronary)");
  return result;
}

void require_faces(const BoundaryConditions& conditions, std::span<const std::string> faces,
                   const std::string& model) {
  std::vector<std::string> missing, extra;
  for (const std::string& name : faces)
    if (!conditions.find(name)) missing.push_back(name);
  for (const FaceCondition& face : conditions.faces)
    if (std::find(faces.begin(), faces.end(), face.name) == faces.end()) extra.push_back(face.name);
  if (missing.empty() && extra.empty()) return;
  std::string what;
  if (!missing.empty()) what = "no condition for " + listed(missing);
  if (!extra.empty())
    what += (what.empty() ? "" : "; ") +
            ("conditions for " + listed(extra) + ", which " + model + " does not have (it has " +
             listed({faces.begin(), faces.end()}) + ")");
  throw Error(ExitCode::usage, conditions.source + ": /faces: " + what);
}

Waveform flow_into(const Inflow& inflow, double area) {
  return inflow.velocity ? times(inflow.waveform, area) : inflow.waveform;
}

Resistance steady(const Condition& outlet) {
  if (const auto* r = std::get_if<Resistance>(&outlet)) return *r;
  if (const auto* rcr = std::get_if<Rcr>(&outlet))
    return {rcr->proximal + rcr->distal, rcr->distal_pressure};
  if (const auto* pressure = std::get_if<Pressure>(&outlet)) return {0, pressure->pressure};
  const auto& c = std::get<Coronary>(outlet);
  return {c.arterial + c.micro + c.venous, c.venous_pressure};
}

}  // namespace vstent::flow
