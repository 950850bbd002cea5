// One deployment from case to published folder, as `deploy` and `demo` run it.
#pragma once

#include <filesystem>
#include <string>

#include "deployment/deploy.hpp"

namespace vstent::apps {

struct RunOptions {
  bool allow_unconverged = false;
  bool pictures = true;  ///< stages.png: before, midway, after
  bool report = true;    ///< report.html
  bool summary = true;   ///< on standard output
  std::string label;     ///< before every line of progress
};

struct CaseRun {
  deployment::Setup setup;
  deployment::Outcome outcome;
};

/// Prepares, deploys, writes, measures, publishes; progress on standard error, the summary on
/// standard output. \throws Error
CaseRun run_case(const deployment::Case& specification, const std::filesystem::path& out,
                 const RunOptions& options);

}  // namespace vstent::apps
