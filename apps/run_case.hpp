// One deployment from case to published folder, as `deploy` and `demo` run it.
#pragma once

#include <filesystem>

#include "deployment/deploy.hpp"

namespace vstent::apps {

struct RunOptions {
  bool allow_unconverged = false;
  bool pictures = true;  ///< stages.png: before, midway, after
};

/// Prepares, deploys, writes, measures, publishes; progress on standard error, the summary on
/// standard output. \throws Error
void run_case(const deployment::Case& specification, const std::filesystem::path& out,
              const RunOptions& options);

}  // namespace vstent::apps
