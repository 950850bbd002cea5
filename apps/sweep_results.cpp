#include "apps/sweep_results.hpp"

#include <algorithm>
#include <cstdio>
#include <nlohmann/json.hpp>
#include <sstream>

#include "apps/commands.hpp"
#include "apps/plot.hpp"
#include "flow/report.hpp"
#include "vessels/text.hpp"

namespace vstent::apps {
namespace {

using nlohmann::ordered_json;

constexpr Colour kRefusedColour{160, 160, 160};

double mmhg(double pressure) { return pressure / flow::kDynPerCm2PerMmHg; }

struct Column {
  const char *key, *heading;
  std::optional<double> (*value)(const flow::Answer&);
};

std::optional<double> in_mmhg(const std::optional<double>& pressure) {
  return pressure ? std::optional<double>(mmhg(*pressure)) : std::nullopt;
}

const Column kColumns[] = {
    {"mean_pressure_drop_mmHg", "drop", [](const flow::Answer& a) { return in_mmhg(a.drop); }},
    {"lowest_drop_mmHg", "lowest", [](const flow::Answer& a) { return in_mmhg(a.lowest_drop); }},
    {"highest_drop_mmHg", "highest", [](const flow::Answer& a) { return in_mmhg(a.highest_drop); }},
    {"peak_pressure_drop_mmHg", "peak", [](const flow::Answer& a) { return in_mmhg(a.peak_drop); }},
    {"peak_to_peak_gradient_mmHg", "pk-to-pk",
     [](const flow::Answer& a) { return in_mmhg(a.peak_to_peak); }},
    {"distal_over_inlet_pressure", "Pd/Pa",
     [](const flow::Answer& a) { return std::optional<double>(a.ratio); }},
};

std::string shown(const std::optional<double>& value) {
  if (!value) return "-";
  char text[40];
  std::snprintf(text, sizeof text, "%.3g", *value);
  return text;
}

ordered_json values(const flow::Answer& answer) {
  ordered_json json;
  for (const Column& c : kColumns) {
    const std::optional<double> value = c.value(answer);
    json[c.key] = value ? ordered_json(*value) : ordered_json(nullptr);
  }
  return json;
}

ordered_json target_json(const std::optional<Target>& target) {
  if (!target) return nullptr;
  ordered_json json = {{"drop_mmHg", target->drop},
                       {"gradient", name(target->gradient)},
                       {"reached", target->found.has_value()},
                       {"verdict", target->verdict}};
  if (target->found) {
    json["diameter_mm"] = target->found->diameter;
    json["drop_there_mmHg"] = target->found->drop;
  }
  return json;
}

}  // namespace

double drop_of(const flow::Answer& a, Gradient gradient) {
  if (gradient == Gradient::peak && a.peak_drop) return mmhg(*a.peak_drop);
  if (gradient == Gradient::peak_to_peak && a.peak_to_peak) return mmhg(*a.peak_to_peak);
  return mmhg(a.drop);
}

std::string name(Gradient gradient) {
  return gradient == Gradient::mean ? "mean" : gradient == Gradient::peak ? "peak" : "peak-to-peak";
}

std::vector<Trial> trials(const std::vector<SweepEntry>& entries, Gradient gradient) {
  std::vector<Trial> result;
  for (const SweepEntry& e : entries)
    if (e.answer) result.push_back({e.diameter, drop_of(*e.answer, gradient)});
  return result;
}

void judge(Target& target, const std::vector<SweepEntry>& entries) {
  const std::vector<Trial> tried = trials(entries, target.gradient);
  const auto first = std::find_if(tried.begin(), tried.end(),
                                  [&](const Trial& t) { return t.drop <= target.drop; });
  const auto text = [](double value, const char* unit) { return vessels::number(value) + unit; };
  const std::string wanted =
      "a " + name(target.gradient) + " drop of " + text(target.drop, " mmHg");
  if (first == tried.end()) {
    const auto least = std::min_element(
        tried.begin(), tried.end(), [](const Trial& a, const Trial& b) { return a.drop < b.drop; });
    target.verdict = "none of the diameters from " + text(tried.front().diameter, " mm") + " to " +
                     text(tried.back().diameter, " mm") + " reaches " + wanted + ": the least is " +
                     text(least->drop, " mmHg") + " at " + text(least->diameter, " mm");
    return;
  }
  target.found = *first;
  target.verdict = text(first->diameter, " mm") + " reaches " + wanted + ": it leaves " +
                   text(first->drop, " mmHg");
  if (first == tried.begin()) {
    target.verdict += "; it is the smallest that was deployed, a smaller one may do";
  } else {
    target.verdict += " (" + text((first - 1)->diameter, " mm") + " leaves " +
                      text((first - 1)->drop, " mmHg") + ")";
  }
}

std::string sweep_csv(const Sweep& sweep) {
  std::ostringstream csv;
  csv << "diameter_mm,folder,narrowest_after_mm";
  for (const Column& c : kColumns) csv << ',' << c.key;
  csv << ",refused\n";
  const auto row = [&](const flow::Answer* answer) {
    for (const Column& c : kColumns) {
      csv << ',';
      const std::optional<double> value = answer ? c.value(*answer) : std::nullopt;
      if (value) csv << ordered_json(*value);
    }
  };
  if (sweep.before) {
    csv << "0,before,";
    row(&*sweep.before);
    csv << ",\n";
  }
  for (const SweepEntry& e : sweep.entries) {
    csv << ordered_json(e.diameter) << ',' << e.folder << ',';
    if (e.answer) csv << ordered_json(e.narrowest_after);
    row(e.answer ? &*e.answer : nullptr);
    csv << ',' << (e.refusal.empty() ? "" : ordered_json(e.refusal).dump()) << '\n';
  }
  return csv.str();
}

ordered_json sweep_json(const Sweep& sweep) {
  ordered_json json = {{"note", kDisclaimer},
                       {"case", sweep.case_file},
                       {"conditions", sweep.conditions},
                       {"before", sweep.before ? values(*sweep.before) : ordered_json(nullptr)},
                       {"diameters", ordered_json::array()},
                       {"target", target_json(sweep.target)},
                       {"uncertainty", flow::kUncertainty},
                       {"notes", sweep.notes}};
  for (const SweepEntry& e : sweep.entries) {
    ordered_json entry = {
        {"diameter_mm", e.diameter}, {"folder", e.folder}, {"searched", e.searched}};
    if (e.answer) {
      entry["narrowest_after_mm"] = e.narrowest_after;
      entry.update(values(*e.answer));
    } else {
      entry["refused"] = e.refusal;
    }
    json["diameters"].push_back(std::move(entry));
  }
  return json;
}

std::string sweep_table(const Sweep& sweep) {
  std::string text;
  const auto line = [&](const std::string& label, const std::string& narrowest,
                        const flow::Answer* answer, const std::string& refusal) {
    char cells[100];
    std::snprintf(cells, sizeof cells, "%-10s %9s", label.c_str(), narrowest.c_str());
    text += cells;
    for (const Column& c : kColumns) {
      std::snprintf(cells, sizeof cells, " %9s", (answer ? shown(c.value(*answer)) : "-").c_str());
      text += cells;
    }
    text += refusal.empty() ? "\n" : "  refused\n";
  };
  char cells[100];
  std::snprintf(cells, sizeof cells, "%-10s %9s", "diameter", "narrowest");
  text += cells;
  for (const Column& c : kColumns) {
    std::snprintf(cells, sizeof cells, " %9s", c.heading);
    text += cells;
  }
  text += "   (mm, mmHg)\n";
  if (sweep.before) line("before", "", &*sweep.before, "");
  for (const SweepEntry& e : sweep.entries)
    line(vessels::number(e.diameter), e.answer ? shown(e.narrowest_after) : "-",
         e.answer ? &*e.answer : nullptr, e.refusal);
  if (sweep.target) text += sweep.target->verdict + '\n';
  for (const std::string& note : sweep.notes) text += "note: " + note + '\n';
  return text + "uncertainty: " + flow::kUncertainty + '\n';
}

Figure sweep_figure(const Sweep& sweep) {
  const Gradient gradient = sweep.target ? sweep.target->gradient : Gradient::mean;
  Range x, y;
  y.include(0);
  for (const SweepEntry& e : sweep.entries) {
    x.include(e.diameter);
    if (!e.answer) continue;
    for (const double drop : {drop_of(*e.answer, gradient), mmhg(e.answer->highest_drop)})
      y.include(drop);
  }
  if (sweep.before) y.include(drop_of(*sweep.before, gradient));
  if (sweep.target) y.include(sweep.target->drop);
  const double margin = 0.04 * std::max(x.high - x.low, 1.0);
  x = {x.low - margin, x.high + margin};
  y.high += 0.06 * std::max(y.high - y.low, 1.0);
  y.low -= 0.03 * (y.high - y.low);
  Plot plot(x, y);
  plot.axes("stent diameter (mm)", name(gradient) + " pressure drop (mmHg)");
  std::vector<PlotPoint> line;
  const SweepEntry* last = nullptr;
  for (const SweepEntry& e : sweep.entries) {
    if (!e.answer) {
      plot.mark(e.diameter, kRefusedColour);
      continue;
    }
    line.push_back({e.diameter, drop_of(*e.answer, gradient)});
    plot.dot(e.diameter, *line.back().y, 5, kAfterColour);
    if (last && gradient == Gradient::mean) {
      Colour band = kAfterColour;
      band.opacity = 0.16;
      plot.quadrangle({plot.spot(last->diameter, mmhg(last->answer->lowest_drop)),
                       plot.spot(e.diameter, mmhg(e.answer->lowest_drop)),
                       plot.spot(e.diameter, mmhg(e.answer->highest_drop)),
                       plot.spot(last->diameter, mmhg(last->answer->highest_drop))},
                      band);
    }
    last = &e;
  }
  const Stroke after{{}, kAfterColour, 2.4}, grey{{}, kBeforeColour, 2},
      blue{{}, kTargetColour, 1.6};
  plot.line(line, after, false);
  std::vector<Plot::Entry> entries{{"stented", after}};
  if (sweep.before) {
    const double drop = drop_of(*sweep.before, gradient);
    plot.line({{x.low, drop}, {x.high, drop}}, grey, false);
    entries.push_back({"before", grey});
  }
  if (sweep.target) {
    plot.line({{x.low, sweep.target->drop}, {x.high, sweep.target->drop}}, blue, true);
    entries.push_back({"target", blue, true});
  }
  if (std::any_of(sweep.entries.begin(), sweep.entries.end(),
                  [](const SweepEntry& e) { return !e.answer; }))
    entries.push_back({"refused", {{}, kRefusedColour, 1.2}, true});
  plot.legend(entries);
  return plot.take();
}

}  // namespace vstent::apps
