// The reduced model of a result folder or a surface, as `flow` and `sweep` run it.
#pragma once

#include <CLI/CLI.hpp>
#include <filesystem>

#include "apps/figure.hpp"
#include "flow/study.hpp"

namespace vstent::apps {

/// What is asked about. Surfaces and centerline are read; nothing is written.
struct FlowInput {
  vessels::Surface before;
  std::optional<vessels::Surface> after;  ///< nothing: one surface
  vessels::Centerline centerline;
  std::optional<flow::Stretch> stretch;
  std::vector<std::string> notes;

  flow::Question question() const { return {before, after ? *after : before, centerline, stretch}; }
};

/// OUT of `vstent deploy`: the surface that was stented and the stented one, its centerline, and
/// where the stent lies. Where the surface that was stented is no longer there, a note says so.
/// \throws Error (input_file)
FlowInput read_result(const std::filesystem::path& out);

/// A surface alone. \throws Error
FlowInput read_surface_alone(const std::filesystem::path& surface, vessels::LengthUnit unit,
                             const std::filesystem::path& centerline);

/// Boundary conditions from a file, or an inflow alone.
struct ConditionOptions {
  std::string file, inflow, inflow_units, pressure = "93 mmHg";

  /// `name` is that of the option for the file, "--case".
  void add_options(CLI::App& command, const std::string& name);
  /// \throws Error, before anything long begins, for what can be seen to be wrong without a vessel
  void check() const;
  flow::BoundaryConditions read(const FlowInput& input) const;

 private:
  flow::Inflow read_inflow(std::vector<std::string>& notes) const;
  std::string name_;
};

/// Mean pressure along the blood's way past the stent.
Figure pressure_figure(const flow::Study& study);

/// As PNG; where nothing can be drawn on, a warning says so. \throws Error (output)
void draw(const Figure& figure, const std::filesystem::path& png);

/// flow.json, flow.svg, flow.vtp, svzerod_before.json (where there is a before) and
/// svzerod_after.json; flow.png with `pictures`. \throws Error (output)
void write_flow(const flow::Study& study, const flow::BoundaryConditions& conditions,
                vessels::LengthUnit unit, const std::filesystem::path& folder, bool pictures);

}  // namespace vstent::apps
