#include "flow/report.hpp"

#include <cmath>
#include <cstdio>
#include <nlohmann/json.hpp>
#include <numbers>

#include "vessels/text.hpp"

namespace vstent::flow {
namespace {

using nlohmann::ordered_json;

constexpr double kMmPerCm = 10;

double mmhg(double dyn_per_cm2) { return dyn_per_cm2 / kDynPerCm2PerMmHg; }

double diameter_mm(double area_cm2) {
  return kMmPerCm * std::sqrt(4 * area_cm2 / std::numbers::pi);
}

template <class Value>
ordered_json or_null(const std::optional<Value>& pressure) {
  return pressure ? ordered_json(mmhg(*pressure)) : ordered_json(nullptr);
}

/// Length (cm) over which a narrowing is narrower than halfway, by the logarithm of its area.
double length_of(const Lumen& lumen, const Stenosis& s) {
  const double reference = std::min(lumen.area[s.start], lumen.area[s.end]);
  const double half = std::sqrt(reference * lumen.area[s.throat]);
  double length = 0;
  for (std::size_t i = s.start + 1; i <= s.end; ++i) {
    const double h = lumen.arc[i] - lumen.arc[i - 1];
    length += 0.5 * h * ((lumen.area[i] < half) + (lumen.area[i - 1] < half));
  }
  return length;
}

ordered_json stenoses_json(const Answer& answer) {
  ordered_json list = ordered_json::array();
  for (std::size_t b = 0; b < answer.network.branches.size(); ++b) {
    const Branch& branch = answer.network.branches[b];
    for (const Stenosis& s : branch.losses.stenoses) {
      const Lumen& lumen = branch.lumen;
      const double reference = diameter_mm(std::min(lumen.area[s.start], lumen.area[s.end]));
      const double throat = diameter_mm(lumen.area[s.throat]), length = length_of(lumen, s);
      const YoungTsai lumped = young_tsai(reference / kMmPerCm, throat / kMmPerCm, length,
                                          answer.mean_flow[b], answer.network.blood);
      list.push_back(
          {{"branch", b},
           {"throat_at_mm", kMmPerCm * lumen.arc[s.throat]},
           {"throat_diameter_mm", throat},
           {"reference_diameter_mm", reference},
           {"diameter_stenosis_percent", s.percent},
           {"length_mm", kMmPerCm * length},
           {"young_tsai_drop_at_mean_flow_mmHg", mmhg(lumped.viscous + lumped.separation)}});
    }
  }
  return list;
}

ordered_json faces_json(const Answer& answer, const Study& study) {
  ordered_json faces;
  for (const TreeEnd& end : study.ends) {
    const auto b = static_cast<std::size_t>(end.branch);
    const std::vector<double>& pressure = answer.mean_pressure[b];
    faces[end.name] = {{"mean_flow_mL_per_s", answer.mean_flow[b]},
                       {"mean_pressure_mmHg", mmhg(end.root ? pressure.front() : pressure.back())}};
  }
  return faces;
}

double pressure_at(const std::vector<std::vector<double>>& p, const TreePlace& place) {
  return p[static_cast<std::size_t>(place.branch)][place.point];
}

ordered_json beat_json(const Answer& answer, const Study& study) {
  if (!answer.beat) return nullptr;
  ordered_json beat = {{"beats_until_periodic", answer.beat->beats},
                       {"time_s", ordered_json::array()},
                       {"inflow_mL_per_s", ordered_json::array()},
                       {"inlet_pressure_mmHg", ordered_json::array()},
                       {"proximal_pressure_mmHg", ordered_json::array()},
                       {"distal_pressure_mmHg", ordered_json::array()}};
  for (const Instant& instant : answer.beat->instants) {
    const auto p = pressures(answer.network, instant);
    beat["time_s"].push_back(instant.time);
    beat["inflow_mL_per_s"].push_back(instant.flow.front());
    beat["inlet_pressure_mmHg"].push_back(mmhg(instant.inlet_pressure));
    beat["proximal_pressure_mmHg"].push_back(mmhg(pressure_at(p, study.proximal)));
    beat["distal_pressure_mmHg"].push_back(mmhg(pressure_at(p, study.distal)));
  }
  return beat;
}

ordered_json path_json(const Answer& answer, const Study& study) {
  ordered_json path = {{"along_mm", ordered_json::array()},
                       {"pressure_mmHg", ordered_json::array()},
                       {"diameter_mm", ordered_json::array()}};
  for (std::size_t k = 0; k < study.path.branches.size(); ++k) {
    const auto b = static_cast<std::size_t>(study.path.branches[k]);
    const std::vector<double>& arc = study.tree.branches[b].arc;
    for (std::size_t i = 0; i < arc.size(); ++i) {
      path["along_mm"].push_back(study.path.start[k] + arc[i]);
      path["pressure_mmHg"].push_back(mmhg(answer.mean_pressure[b][i]));
      path["diameter_mm"].push_back(diameter_mm(answer.network.branches[b].lumen.area[i]));
    }
  }
  return path;
}

ordered_json answer_json(const Answer& answer, const Study& study) {
  return {{"mean_pressure_drop_mmHg", mmhg(answer.drop)},
          {"mean_pressure_drop_range_mmHg", {mmhg(answer.lowest_drop), mmhg(answer.highest_drop)}},
          {"peak_pressure_drop_mmHg", or_null(answer.peak_drop)},
          {"peak_to_peak_gradient_mmHg", or_null(answer.peak_to_peak)},
          {"proximal_mean_pressure_mmHg", mmhg(answer.proximal)},
          {"distal_mean_pressure_mmHg", mmhg(answer.distal)},
          {"inlet_mean_pressure_mmHg", mmhg(answer.inlet)},
          {"distal_over_inlet_pressure", answer.ratio},
          {"faces", faces_json(answer, study)},
          {"stenoses", stenoses_json(answer)},
          {"path", path_json(answer, study)},
          {"beat", beat_json(answer, study)}};
}

std::string row(const char* label, const char* unit, const std::optional<double>& before,
                const std::optional<double>& after) {
  const auto cell = [](const std::optional<double>& value) -> std::string {
    if (!value) return "-";
    char text[40];
    std::snprintf(text, sizeof text, "%.3g", *value);
    return text;
  };
  char line[200];
  std::snprintf(line, sizeof line, "%-34s %-5s %10s %10s\n", label, unit, cell(before).c_str(),
                cell(after).c_str());
  return line;
}

ordered_json condition_json(const std::string& name, const Condition& condition, double period) {
  ordered_json values;
  std::string type;
  const double last = period > 0 ? period : 1;
  if (const auto* r = std::get_if<Resistance>(&condition)) {
    type = "RESISTANCE";
    values = {{"R", r->resistance}, {"Pd", r->distal_pressure}};
  } else if (const auto* rcr = std::get_if<Rcr>(&condition)) {
    type = "RCR";
    values = {{"Rp", rcr->proximal},
              {"C", rcr->capacitance},
              {"Rd", rcr->distal},
              {"Pd", rcr->distal_pressure}};
  } else if (const auto* p = std::get_if<Pressure>(&condition)) {
    type = "PRESSURE";
    values = {{"P", {p->pressure, p->pressure}}, {"t", {0.0, last}}};
  } else {
    const auto& c = std::get<Coronary>(condition);
    const Waveform& muscle = c.intramyocardial_pressure;
    type = "CORONARY";
    values = {{"Ra1", c.arterial},        {"Ra2", c.micro},
              {"Rv1", c.venous},          {"Ca", c.arterial_compliance},
              {"Cc", c.micro_compliance}, {"P_v", c.venous_pressure}};
    if (muscle.constant()) {
      values["t"] = {0.0, last};
      values["Pim"] = {muscle.value[0], muscle.value[0]};
    } else {
      values["t"] = muscle.time;
      values["Pim"] = muscle.value;
    }
  }
  return {{"bc_name", name}, {"bc_type", type}, {"bc_values", values}};
}

}  // namespace

ordered_json to_json(const Study& study, const BoundaryConditions& conditions) {
  ordered_json json;
  json["note"] = "Research tool, not for clinical use.";
  json["blood"] = {{"viscosity_P", conditions.blood.viscosity},
                   {"density_g_per_mL", conditions.blood.density}};
  json["conditions"]["source"] = conditions.source;
  for (const FaceCondition& face : conditions.faces)
    json["conditions"]["faces"][face.name] = describe(face.condition);
  json["inflow"] = {{"face", study.ends.front().name},
                    {"mean_mL_per_s", mean(study.inflow_volume)},
                    {"period_s", study.inflow_volume.period()},
                    {"area_cm2", study.inlet_area}};
  json["pressure_drop"] = {{"from_mm", study.proximal.along},
                           {"to_mm", study.distal.along},
                           {"stretch_from_mm", study.stretch_from},
                           {"stretch_to_mm", study.stretch_to},
                           {"stretch", study.stretch_is}};
  json["before"] = study.before ? answer_json(*study.before, study) : ordered_json(nullptr);
  json["after"] = answer_json(study.after, study);
  json["uncertainty"] = kUncertainty;
  json["notes"] = study.notes;
  return json;
}

std::string text_table(const Study& study) {
  const auto pressure = [&](const char* label, auto Answer::*member) {
    const auto value = [&](const Answer& a) -> std::optional<double> {
      const std::optional<double> p = a.*member;
      return p ? std::optional<double>(mmhg(*p)) : std::nullopt;
    };
    return row(label, "mmHg", study.before ? value(*study.before) : std::nullopt,
               value(study.after));
  };
  char head[200];
  std::snprintf(head, sizeof head, "%-34s %-5s %10s %10s\n", "", "", study.before ? "before" : "",
                study.before ? "after" : "now");
  std::string text = head;
  text += pressure("mean pressure drop", &Answer::drop);
  text += pressure("  lowest by other coefficients", &Answer::lowest_drop);
  text += pressure("  highest", &Answer::highest_drop);
  if (study.after.peak_drop) {
    text += pressure("peak pressure drop", &Answer::peak_drop);
    text += pressure("peak-to-peak gradient", &Answer::peak_to_peak);
  }
  text += pressure("mean pressure at the inlet", &Answer::inlet);
  text += pressure("mean pressure distally", &Answer::distal);
  text += row("distal over inlet pressure", "",
              study.before ? std::optional<double>(study.before->ratio) : std::nullopt,
              study.after.ratio);
  for (const TreeEnd& end : study.ends) {
    const auto b = static_cast<std::size_t>(end.branch);
    const std::string label = (end.root ? "flow into " : "flow out of ") + end.name;
    text += row(label.c_str(), "mL/s",
                study.before ? std::optional<double>(study.before->mean_flow[b]) : std::nullopt,
                study.after.mean_flow[b]);
  }
  char places[200];
  std::snprintf(places, sizeof places,
                "The drop is taken from %.1f to %.1f mm along the vessel, around %s, %.1f to %.1f "
                "mm.\n",
                study.proximal.along, study.distal.along, study.stretch_is.c_str(),
                study.stretch_from, study.stretch_to);
  text += places;
  for (const std::string& note : study.notes) text += "note: " + note + '\n';
  return text + "uncertainty: " + kUncertainty + '\n';
}

void write_lines(const Study& study, vessels::LengthUnit unit, const std::filesystem::path& path) {
  std::vector<Polyline> lines;
  std::map<std::string, std::vector<double>> arrays;
  std::map<std::string, std::vector<int>> marks;
  const auto add = [&](const Answer& answer, std::size_t b, const std::string& suffix) {
    const Branch& branch = answer.network.branches[b];
    for (std::size_t i = 0; i < branch.lumen.area.size(); ++i) {
      arrays["Pressure" + suffix].push_back(mmhg(answer.mean_pressure[b][i]));
      arrays["Flow" + suffix].push_back(answer.mean_flow[b]);
      arrays["Diameter" + suffix].push_back(diameter_mm(branch.lumen.area[i]));
    }
  };
  for (std::size_t b = 0; b < study.tree.branches.size(); ++b) {
    lines.push_back(study.tree.branches[b].axis_after);
    marks["Branch"].push_back(static_cast<int>(b));
    add(study.after, b, "");
    if (study.before) add(*study.before, b, "Before");
  }
  vessels::write_polylines(lines, arrays, marks, path, 1 / vessels::millimetres_per(unit));
}

ordered_json zero_d_case(const Answer& answer, const Study& study,
                         const BoundaryConditions& conditions) {
  const double period = study.inflow_volume.period();
  const Waveform& q = study.inflow_volume;
  ordered_json json;
  json["simulation_parameters"] = {
      {"number_of_cardiac_cycles", answer.beat ? answer.beat->beats : 2},
      {"number_of_time_pts_per_cardiac_cycle", 201}};
  ordered_json flow = {{"Q", q.value}, {"t", q.time}};
  if (q.constant()) flow = {{"Q", {q.value[0], q.value[0]}}, {"t", {0.0, 1.0}}};
  const std::string inlet = study.ends.front().name;
  json["boundary_conditions"] = {{{"bc_name", inlet}, {"bc_type", "FLOW"}, {"bc_values", flow}}};
  json["vessels"] = ordered_json::array();
  json["junctions"] = ordered_json::array();
  const std::vector<Branch>& branches = answer.network.branches;
  for (std::size_t b = 0; b < branches.size(); ++b) {
    const Branch& branch = branches[b];
    ordered_json vessel = {{"vessel_id", b},
                           {"vessel_name", "branch" + std::to_string(b) + "_seg0"},
                           {"vessel_length", branch.lumen.arc.back()},
                           {"zero_d_element_type", "BloodVessel"},
                           {"zero_d_element_values",
                            {{"R_poiseuille", branch.losses.viscous.back()},
                             {"C", 0.0},
                             {"L", branch.losses.inertance.back()},
                             {"stenosis_coefficient", branch.losses.separation.back()}}}};
    if (b == 0) vessel["boundary_conditions"]["inlet"] = inlet;
    std::vector<std::size_t> children;
    for (std::size_t c = 0; c < branches.size(); ++c)
      if (branches[c].parent == static_cast<int>(b)) children.push_back(c);
    if (!children.empty()) {
      json["junctions"].push_back(
          {{"junction_name", "J" + std::to_string(json["junctions"].size())},
           {"junction_type", "NORMAL_JUNCTION"},
           {"inlet_vessels", {b}},
           {"outlet_vessels", children}});
    }
    for (const TreeEnd& end : study.ends) {
      if (end.root || end.branch != static_cast<int>(b)) continue;
      vessel["boundary_conditions"]["outlet"] = end.name;
      json["boundary_conditions"].push_back(
          condition_json(end.name, conditions.find(end.name)->condition, period));
    }
    json["vessels"].push_back(std::move(vessel));
  }
  return json;
}

}  // namespace vstent::flow
