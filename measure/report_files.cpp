#include "measure/report_files.hpp"

#include <algorithm>
#include <cstdio>
#include <map>
#include <sstream>

#include "measure/rows.hpp"
#include "vessels/polylines.hpp"
#include "vessels/text.hpp"

namespace vstent::measure {
namespace {

using nlohmann::ordered_json;
using vessels::exact;
using vessels::Section;

ordered_json section_json(const std::optional<Section>& section) {
  if (!section) return nullptr;
  return {{"area_mm2", section->area},
          {"equivalent_diameter_mm", section->equivalent_diameter},
          {"min_diameter_mm", section->min_diameter},
          {"max_diameter_mm", section->max_diameter}};
}

ordered_json stations_json(const Metrics& m) {
  ordered_json stations = ordered_json::array();
  for (const Station& s : m.stations) {
    stations.push_back({{"arc_length_mm", s.arc_length},
                        {"target_diameter_mm", known(s.target > 0, s.target)},
                        {"crosses_branch_before", s.branch_before},
                        {"crosses_branch_after", s.branch_after},
                        {"before", section_json(s.before)},
                        {"after", section_json(s.after)}});
  }
  return stations;
}

ordered_json branches_json(const Metrics& m) {
  ordered_json branches = ordered_json::array();
  for (const SideBranch& b : m.branches) {
    std::optional<double> change;
    if (b.ostium_before && b.ostium_after) change = 100 * (*b.ostium_after / *b.ostium_before - 1);
    branches.push_back({{"branch", b.branch},
                        {"arc_length_mm", b.arc_length},
                        {"in_stent", b.in_stent},
                        {"ostium_area_before_mm2", or_null(b.ostium_before)},
                        {"ostium_area_after_mm2", or_null(b.ostium_after)},
                        {"ostium_area_change_percent", or_null(change)},
                        {"ostium_symmetry_before", or_null(b.symmetry_before)},
                        {"ostium_symmetry_after", or_null(b.symmetry_after)},
                        {"coverage_percent", or_null(b.coverage)}});
  }
  return branches;
}

std::string group_of(std::string_view pointer) {
  return std::string(pointer.substr(0, pointer.find('/', 1)));
}

/// Why figures are null; a group that is null for one reason is named once.
ordered_json reasons(const Metrics& m) {
  std::map<std::string, std::pair<std::size_t, std::map<std::string_view, std::size_t>>> groups;
  std::vector<const Row*> missing;
  for (const Row& row : rows()) {
    auto& [size, absent] = groups[group_of(row.definition.key)];
    ++size;
    if (!row.value(m).is_null()) continue;
    ++absent[row.definition.absent];
    missing.push_back(&row);
  }
  ordered_json result = ordered_json::object();
  for (const Row* row : missing) {
    const Definition& d = row->definition;
    const auto& [size, absent] = groups[group_of(d.key)];
    const bool whole_group = absent.at(d.absent) == size;
    result[whole_group ? group_of(d.key) : std::string(d.key)] = std::string(d.absent);
  }
  return result;
}

std::string shown(const ordered_json& value) {
  if (value.is_boolean()) return value.get<bool>() ? "yes" : "no";
  if (value.is_number_integer()) return value.dump();
  if (!value.is_number()) return value.is_string() ? value.get<std::string>() : "-";
  char buffer[40];
  std::snprintf(buffer, sizeof buffer, "%.4g", value.get<double>());
  return buffer;
}

std::string line(std::string_view label, const std::string& value, std::string_view unit) {
  char buffer[200];
  std::snprintf(buffer, sizeof buffer, "  %-42.*s %12s %.*s", static_cast<int>(label.size()),
                label.data(), value.c_str(), static_cast<int>(unit.size()), unit.data());
  std::string result(buffer);
  result.erase(result.find_last_not_of(' ') + 1);
  result += '\n';
  return result;
}

}  // namespace

ordered_json to_json(const Metrics& m) {
  ordered_json result;
  for (const Row& row : rows())
    result[ordered_json::json_pointer(std::string(row.definition.key))] = row.value(m);
  result["branches"] = branches_json(m);
  if (m.struts) result["struts"] = to_json(*m.struts);
  result["unmeasured"] = reasons(m);
  result["stations"] = stations_json(m);
  return result;
}

std::string profiles_csv(const Metrics& m) {
  std::ostringstream csv;
  csv << "arc_length_mm";
  for (const char* when : {"before", "after"}) {
    for (const char* what :
         {"area_mm2", "equivalent_diameter_mm", "min_diameter_mm", "max_diameter_mm"})
      csv << ',' << when << '_' << what;
  }
  csv << ",target_diameter_mm,curvature_before_per_mm,curvature_after_per_mm,flags\n";
  for (const Station& s : m.stations) {
    csv << exact(s.arc_length);
    for (const std::optional<Section>* section : {&s.before, &s.after}) {
      if (!*section) {
        csv << ",,,,";
        continue;
      }
      const Section& x = **section;
      for (const double v : {x.area, x.equivalent_diameter, x.min_diameter, x.max_diameter})
        csv << ',' << exact(v);
    }
    csv << ',' << (s.target > 0 ? exact(s.target) : std::string()) << ','
        << exact(s.curvature_before) << ',' << exact(s.curvature_after) << ',';
    const char* between = "";
    const auto flag = [&](bool is_set, const char* name) {
      if (!is_set) return;
      csv << between << name;
      between = " ";
    };
    flag(s.in_stent, "in_stent");
    flag(!s.before, "open_before");
    flag(!s.after, "open_after");
    flag(s.branch_before, "crosses_branch_before");
    flag(s.branch_after, "crosses_branch_after");
    csv << '\n';
  }
  return csv.str();
}

void write_sections(const Metrics& m, vessels::LengthUnit unit, const std::filesystem::path& path) {
  std::vector<Polyline> lines;
  std::map<std::string, std::vector<double>> values;
  std::map<std::string, std::vector<int>> marks;
  for (std::size_t i = 0; i < m.stations.size(); ++i) {
    const Station& s = m.stations[i];
    for (const int which : {0, 1}) {
      const std::optional<Section>& section = which == 0 ? s.before : s.after;
      if (!section) continue;
      Polyline& outline = lines.emplace_back(section->outline);
      outline.push_back(outline.front());
      values["arc_length_mm"].push_back(s.arc_length);
      marks["station"].push_back(static_cast<int>(i));
      marks["which"].push_back(which);
    }
  }
  vessels::write_polylines_with_values(lines, values, marks, path,
                                       1 / vessels::millimetres_per(unit));
}

std::string text_table(const ordered_json& metrics) {
  std::string table, group;
  for (const Row& row : rows()) {
    const Definition& d = row.definition;
    const auto& value = metrics.at(ordered_json::json_pointer(std::string(d.key)));
    if (value.is_null()) continue;
    const std::string its_group =
        std::count(d.key.begin(), d.key.end(), '/') > 1 ? group_of(d.key).substr(1) : "reference";
    if (its_group != group) table.append(its_group).append("\n");
    group = its_group;
    table += line(d.label, shown(value), d.unit);
  }
  for (const ordered_json& branch : metrics.at("branches")) {
    table.append("branch ").append(branch.at("branch").dump()).append("\n");
    for (const auto& [key, value] : branch.items()) {
      const Definition* d = find_definition(std::string("/branches/0/").append(key));
      if (key != "branch" && d && !value.is_null()) table += line(d->label, shown(value), d->unit);
    }
  }
  const ordered_json& reasons = metrics.at("unmeasured");
  if (!reasons.empty()) table += "not measured\n";
  for (const auto& [key, reason] : reasons.items())
    table.append("  ").append(key).append(": ").append(reason.get<std::string>()).append("\n");
  return table;
}

std::string definitions_markdown() {
  std::string table =
      "| key | what it is | unit | meaning | null or absent when |\n"
      "|---|---|---|---|---|\n";
  for (const Definition& d : definitions()) {
    table.append("| `").append(d.key).append("` | ").append(d.label).append(" | ");
    table.append(d.unit).append(" | ");
    for (const char c : d.meaning) table.append(c == '|' ? "\\" : "").append(1, c);
    table.append(" | ").append(d.absent).append(" |\n");
  }
  return table;
}

}  // namespace vstent::measure
