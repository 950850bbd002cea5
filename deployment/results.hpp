// The files of a result: what OUT holds.
#pragma once

#include <filesystem>

#include "deployment/deploy.hpp"
#include "measure/measure.hpp"

namespace vstent::deployment {

using measure::Metrics;
using measure::StrutMetrics;

/// Saves the surface and the stent of chosen steps while the simulation runs, and lists them for
/// ParaView in steps.pvd.
class StepSaver {
 public:
  StepSaver(const Setup& setup, std::filesystem::path stage)
      : setup_(setup), stage_(std::move(stage)) {}
  void save(const StepRecord& record, std::span<const Vec3> patch_positions);
  void write_list() const;  ///< nothing when no step was saved

 private:
  const Setup& setup_;
  std::filesystem::path stage_;
  std::vector<int> steps_;
};

/// Writes stented.vtp, stent.vtp, stent.vdb, centerline.vtp, case.json, history.csv, metrics.json,
/// profiles.csv and sections.vtp into `stage`. The metrics are measured on stented.vtp as read
/// back. Surfaces and lines are in the unit of the input, stent.vdb in mm. \throws Error (output)
Metrics write_results(const Setup& setup, const Outcome& outcome,
                      const std::filesystem::path& stage);

/// The geometry handed on must be sound. \throws Error (numerical) with the numbers of what is not
void require_sound(const Metrics& metrics, const std::filesystem::path& surface);

}  // namespace vstent::deployment
