#include "apps/run_case.hpp"

#include <cstdio>
#include <iostream>

#include "apps/commands.hpp"
#include "apps/pictures.hpp"
#include "apps/report.hpp"
#include "apps/terminal.hpp"
#include "deployment/result_folder.hpp"
#include "deployment/results.hpp"
#include "vessels/error.hpp"

namespace vstent::apps {
namespace {

std::string formatted(const char* format, double a, double b = 0, double c = 0) {
  char text[200];
  std::snprintf(text, sizeof text, format, a, b, c);
  return text;
}

void print_findings(const deployment::Setup& setup) {
  for (const vessels::Finding& finding : setup.check.findings) {
    if (finding.severity == vessels::Finding::Severity::note) continue;
    std::cerr << (finding.severity == vessels::Finding::Severity::repaired ? "repaired: "
                                                                           : "warning: ")
              << finding.text << '\n';
  }
  for (const std::string& warning : setup.warnings) std::cerr << "warning: " << warning << '\n';
}

void print_summary(const deployment::Setup& setup, const deployment::Outcome& outcome,
                   const deployment::Metrics& m, const std::filesystem::path& out) {
  std::cout << formatted("narrowest lumen   %.2f -> %.2f mm (equivalent diameter; stent %.2f mm)\n",
                         m.narrowest_before, m.narrowest_after, *setup.specification.diameter);
  if (m.stenosis_before) {
    std::cout << formatted("stenosis          %.0f -> %.0f %% of a reference lumen of %.2f mm\n",
                           *m.stenosis_before, *m.stenosis_after, m.reference_diameter);
  }
  std::cout << formatted("bend of the stent %.1f -> %.1f deg\n", m.bend_before, m.bend_after);
  if (outcome.given_way) {
    std::cout << formatted(
        "stent gave way    %.2f mm across its axis, down to %.2f mm; forces on it balance to "
        "%.2g\n",
        outcome.given_way->shift, outcome.given_way->smallest_diameter,
        outcome.given_way->unbalanced);
  }
  std::cout << formatted(
      "mesh              %.0f inverted triangles, %.0f new self-intersections, %.0f vertices "
      "moved\n",
      static_cast<double>(m.inverted_triangles), static_cast<double>(m.new_self_intersections),
      static_cast<double>(m.moved_vertices));
  std::cout << formatted("force balance     %.2g of the mean contact force after %.0f steps\n",
                         outcome.history.back().residual, outcome.history.back().step);
  std::cout << "result            " << out.string() << '\n' << kDisclaimer << '\n';
}

}  // namespace

CaseRun run_case(const deployment::Case& specification, const std::filesystem::path& out,
                 const RunOptions& options) {
  deployment::ResultFolder folder(out);
  Progress progress;
  progress.show(options.label + "reading and placing ...");
  deployment::Setup setup = deployment::prepare(specification);
  progress.clear();
  print_findings(setup);

  deployment::StepSaver saver(setup, folder.stage());
  Midway midway;
  const int growth = deployment::growth_steps(setup);
  const int save_every = setup.specification.save_steps;
  const auto observe = [&](const deployment::StepRecord& record, std::span<const Vec3> positions) {
    progress.show(
        options.label +
        (record.settling
             ? formatted("settling: step %.0f, forces balanced to %.2g of the contact force",
                         record.step, record.residual)
             : formatted("growing: step %.0f of %.0f, radius %.2f mm", record.step, growth,
                         record.radius)));
    if (record.step == (growth + 1) / 2)
      midway = {record.expansion, {positions.begin(), positions.end()}};
    if (save_every > 0 && !record.settling &&
        (record.step % save_every == 0 || record.step == growth)) {
      saver.save(record, positions);
    }
    return !interrupted();
  };
  deployment::Outcome outcome = deployment::deploy(setup, observe);
  progress.clear();
  if (!outcome.converged) {
    const std::string what =
        "forces are balanced only to " + formatted("%.2g", outcome.history.back().residual) +
        " of the contact force after " + std::to_string(outcome.history.back().step) +
        " steps (tolerance " + formatted("%.2g", *setup.specification.tolerance) + ")" +
        (outcome.given_way
             ? formatted(", on the stent, which gives way, to %.2g", outcome.given_way->unbalanced)
             : "");
    if (!options.allow_unconverged) {
      throw Error(ExitCode::numerical,
                  what + "; raise /solver/max_settling_steps or pass --allow-unconverged");
    }
    std::cerr << "warning: " << what << '\n';
  }
  if (outcome.given_way) {
    if (const auto narrowed = deployment::narrowed_warning(*outcome.given_way))
      std::cerr << "warning: " << *narrowed << '\n';
  }
  saver.write_list();
  const deployment::Metrics metrics = deployment::write_results(setup, outcome, folder.stage());
  deployment::require_sound(metrics, setup.specification.surface);
  if (options.pictures) draw_stages(setup, outcome, midway, folder.stage() / "stages.png");
  if (options.report) {
    progress.show("writing the report ...");
    add_report_page(folder.stage(), out);
    progress.clear();
  }
  if (interrupted()) throw Error(ExitCode::interrupted, "stopped on request");
  folder.publish();
  if (options.summary) print_summary(setup, outcome, metrics, folder.final_folder());
  return {std::move(setup), std::move(outcome)};
}

}  // namespace vstent::apps
