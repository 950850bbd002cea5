// vstent check: what is this surface, and can it be stented?
#include "vessels/check.hpp"

#include <iostream>
#include <memory>
#include <nlohmann/json.hpp>

#include "apps/commands.hpp"
#include "apps/terminal.hpp"
#include "vessels/error.hpp"
#include "vessels/text.hpp"

namespace vstent::apps {
namespace {

using vessels::CheckReport;
using vessels::Finding;
using vessels::number;

const char* word(Finding::Severity severity) {
  switch (severity) {
    case Finding::Severity::note:
      return "note";
    case Finding::Severity::repaired:
      return "repaired";
    case Finding::Severity::warning:
      return "warning";
    case Finding::Severity::error:
      return "error";
  }
  return "";
}

nlohmann::ordered_json point(const Vec3& p) { return {p.x(), p.y(), p.z()}; }

nlohmann::ordered_json to_json(const vessels::Surface& surface, const CheckReport& report) {
  nlohmann::ordered_json json;
  json["surface"] = surface.path;
  json["units"] = std::string(vessels::name(surface.unit));
  json["stentable"] = report.stentable();
  json["points"] = report.points;
  json["triangles"] = report.triangles;
  json["unused_points"] = report.unused_points;
  json["duplicate_points"] = report.duplicate_points;
  json["bounds_mm"] = {point(report.bounds.lower), point(report.bounds.upper)};
  json["edge_mm"] = {
      {"min", report.edge_min}, {"median", report.edge_median}, {"max", report.edge_max}};
  json["closed"] = report.closed;
  json["openings"] = nlohmann::ordered_json::array();
  for (const auto& opening : report.openings) {
    json["openings"].push_back({{"centre_mm", point(opening.centre)},
                                {"diameter_mm", opening.diameter},
                                {"vertices", opening.vertices}});
  }
  json["triangles_per_face"] = nlohmann::ordered_json::object();
  for (const auto& [face, count] : report.triangles_per_face)
    json["triangles_per_face"][std::to_string(face)] = count;
  json["findings"] = nlohmann::ordered_json::array();
  for (const Finding& finding : report.findings) {
    json["findings"].push_back({{"severity", word(finding.severity)},
                                {"kind", finding.kind},
                                {"count", finding.count},
                                {"text", finding.text}});
  }
  return json;
}

void print(const vessels::Surface& surface, const CheckReport& report) {
  const Vec3 size = report.bounds.upper - report.bounds.lower;
  std::cout << surface.path << '\n'
            << "  size       " << number(size.x()) << " x " << number(size.y()) << " x "
            << number(size.z()) << " mm\n"
            << "  mesh       " << report.points << " points, " << report.triangles
            << " triangles, edges " << number(report.edge_min) << " .. "
            << number(report.edge_median) << " (median) .. " << number(report.edge_max) << " mm\n"
            << "  surface    "
            << (report.closed ? "closed"
                              : "open, " + vessels::counted(report.openings.size(), "opening"))
            << '\n';
  for (const auto& opening : report.openings) {
    std::cout << "    opening  " << number(opening.diameter) << " mm wide at "
              << vessels::place(opening.centre) << " mm, " << opening.vertices << " vertices\n";
  }
  if (!report.triangles_per_face.empty()) {
    std::cout << "  faces     ";
    for (const auto& [face, count] : report.triangles_per_face)
      std::cout << ' ' << face << " (" << count << " triangles)";
    std::cout << '\n';
  }
  for (const Finding& finding : report.findings)
    std::cout << "  " << word(finding.severity) << ": " << finding.text << '\n';
  std::cout << (report.stentable() ? "  can be stented\n" : "  cannot be stented\n");
}

struct Arguments {
  std::string input, units;
  bool json = false;
  ThreadLimit threads;
};

void run(const Arguments& a) {
  a.threads.apply();
  const vessels::Surface surface = vessels::read_surface(a.input, vessels::parse_unit(a.units));
  const CheckReport report = vessels::check(surface);
  if (a.json) {
    std::cout << to_json(surface, report).dump(2) << '\n';
  } else {
    print(surface, report);
  }
  if (!report.stentable()) vessels::require_stentable(surface, report);
}

}  // namespace

void add_check(CLI::App& app) {
  auto* command = app.add_subcommand("check", "What is this surface, and can it be stented?");
  auto a = std::make_shared<Arguments>();
  command->add_option("surface", a->input, "Lumen surface (.vtp .vtk .stl .obj)")->required();
  command->add_option("--units", a->units, "Length unit of the surface: mm, cm or m")->required();
  command->add_flag("--json", a->json, "Print JSON");
  a->threads.add_option(*command);
  command->footer(
      "Examples:\n"
      "  vstent check wall.stl --units mm\n"
      "  vstent check model.vtp --units cm --json > report.json\n"
      "The exit code is 0 when the surface can be stented.");
  command->callback([a] { run(*a); });
}

}  // namespace vstent::apps
