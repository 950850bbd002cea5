// vstent designs: the catalogue, and everything about one design.
#include <algorithm>
#include <cstdio>
#include <iostream>
#include <memory>
#include <nlohmann/json.hpp>

#include "apps/commands.hpp"
#include "deployment/design_file.hpp"
#include "stents/catalogue.hpp"
#include "stents/expansion.hpp"
#include "stents/fields.hpp"
#include "vessels/text.hpp"

namespace vstent::apps {
namespace {

using stents::Design;
using stents::Specification;

struct Arguments {
  std::string name;
  bool json = false;
};

const char* cells(const Design& design) {
  return design.cell() == stents::Cell::open ? "open" : "closed";
}

std::string range(double low, double high) {
  if (low <= 0 && high <= 0) return "-";
  return vessels::number(low) + "-" + vessels::number(high);
}

std::string section_text(const stents::CrossSection& section) {
  return section.round
             ? vessels::number(section.width) + " wire"
             : vessels::number(section.width) + " x " + vessels::number(section.thickness);
}

/// Lengths between the crimped and the nominal diameter, in per cent of the crimped one.
double nominal_foreshortening(const Design& design) {
  const stents::Limits limits = design.limits();
  return 100 * stents::foreshortening(design, limits.crimped_diameter, limits.nominal_diameter);
}

void print_catalogue() {
  std::printf("%-11s %-9s %-6s %-10s %-10s %-13s %-8s %s\n", "name", "family", "cells", "for mm",
              "D x L mm", "strut mm", "shortens", "");
  for (const Specification& s : stents::catalogue()) {
    const auto design = stents::make_design(s);
    char size[40], shortens[24];
    std::snprintf(size, sizeof size, "%.3g x %.3g", s.nominal_diameter, s.nominal_length);
    std::snprintf(shortens, sizeof shortens, "%.1f %%", nominal_foreshortening(*design));
    std::printf("%-11s %-9s %-6s %-10s %-10s %-13s %-8s %s\n", s.name.c_str(),
                stents::family(s).c_str(), cells(*design),
                range(s.smallest_use, s.largest_use).c_str(), size, section_text(s.section).c_str(),
                shortens, s.description.c_str());
  }
  std::printf(
      "\n\"shortens\": from crimped to nominal, by the design's own geometry. Designs are "
      "patterned "
      "after\ndevices, from public descriptions; `vstent designs NAME` says where each figure is "
      "from.\n");
}

void print_sizes(const Specification& s, const Design& design) {
  const stents::Limits limits = design.limits();
  std::printf("\nsize                outer diameter   length   shortened by\n");
  const auto line = [&](const char* name, double diameter) {
    std::printf("%-19s %11.3f mm %8.2f mm %7.1f %%\n", name, diameter,
                design.expanded(diameter).length,
                100 * stents::foreshortening(design, limits.crimped_diameter, diameter));
  };
  line("crimped", limits.crimped_diameter);
  line("nominal", limits.nominal_diameter);
  if (s.largest_use > limits.nominal_diameter && s.largest_use <= limits.largest_diameter) {
    line("largest in use", s.largest_use);
  }
  line("geometric limit", limits.largest_diameter);
}

void print_expansion(const Specification& s, const Design& design) {
  const stents::Limits limits = design.limits();
  constexpr int kMoments = 5;
  const stents::Inflation inflation{limits.crimped_diameter, limits.nominal_diameter};
  std::printf("\non a balloon        at its ends   in its middle   dog-boning   length\n");
  const auto history = stents::expansion_history(design, inflation, kMoments, s.recoil);
  for (std::size_t i = 0; i < history.size(); ++i) {
    const stents::ExpansionState& state = history[i];
    char moment[32];
    std::snprintf(moment, sizeof moment, "%.0f %% of the time", 100 * state.moment);
    std::printf("%-19s %8.3f mm %12.3f mm %9.1f %% %8.2f mm\n",
                i + 1 == history.size() ? "after deflation" : moment, state.end_diameter,
                state.middle_diameter, 100 * state.dog_boning, state.length);
  }
}

void print_design(const Specification& s) {
  const auto design = stents::make_design(s);
  std::printf("%s: %s\nfamily %s, %s cells\n\n", s.name.c_str(), s.description.c_str(),
              stents::family(s).c_str(), cells(*design));
  std::size_t wide_name = 0, wide_value = 0;
  for (const stents::Figure& f : s.figures) {
    if (f.name.find(' ') != std::string::npos) continue;  // what it does, in words
    wide_name = std::max(wide_name, f.name.size());
    wide_value = std::max(wide_value, f.value.size());
  }
  for (const stents::Figure& f : s.figures) {
    std::printf("%-*s  %-*s  %-10s  %s\n", static_cast<int>(wide_name), f.name.c_str(),
                static_cast<int>(wide_value), f.value.c_str(),
                std::string(stents::word(f.provenance)).c_str(), f.source.c_str());
  }
  if (s.figures.empty()) {
    for (const auto& [name, value] : stents::described(s))
      std::printf("%-28s  %s\n", name.c_str(), value.c_str());
  }
  print_sizes(s, *design);
  if (s.recoil > 0) print_expansion(s, *design);
}

void run(const Arguments& a) {
  if (!a.json)
    return a.name.empty() ? print_catalogue() : print_design(deployment::find_design(a.name));
  nlohmann::ordered_json output;
  if (a.name.empty()) {
    output = nlohmann::ordered_json::array();
    for (const Specification& s : stents::catalogue()) output.push_back(deployment::to_json(s));
  } else {
    output = deployment::to_json(deployment::find_design(a.name));
  }
  std::cout << output.dump(2) << '\n';
}

}  // namespace

void add_designs(CLI::App& app) {
  auto* command = app.add_subcommand(
      "designs", "List stent designs, or show one with the source of its figures");
  auto a = std::make_shared<Arguments>();
  command->add_option("design", a->name, "A preset's name or a design file (.json)");
  command->add_flag("--json", a->json, "As JSON, which also serves as a design file to change");
  command->footer(
      "Examples:\n"
      "  vstent designs\n"
      "  vstent designs cp8\n"
      "  vstent designs xience_s --json > mine.json        then edit, and use mine.json as a "
      "design\n"
      "measured: published by those who measured or made it; inferred: follows from such figures;\n"
      "tunable: chosen so that a published behaviour is met; remembered: not checked.");
  command->callback([a] { run(*a); });
}

}  // namespace vstent::apps
