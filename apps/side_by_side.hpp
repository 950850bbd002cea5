// Runs of this program beside each other, each in a process of its own.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace vstent::apps {

struct Job {
  std::vector<std::string> arguments;  ///< of vstent
  std::filesystem::path log;           ///< takes what it prints to standard error
  std::string label;                   ///< for progress
};

struct JobOutcome {
  int exit_code = 0;     ///< 128 + the signal that ended it
  std::string error;     ///< what follows `error: `, or how it ended; empty when it succeeded
  long peak_memory = 0;  ///< kB
};

/// The first alone with all `threads`, which tells how much memory one takes; then as many side by
/// side as threads (0: cores) and free memory allow, threads shared. Outcomes are in the order of
/// the jobs. \throws Error (interrupted) after ending those that run
std::vector<JobOutcome> run_side_by_side(const std::vector<Job>& jobs, int threads);

}  // namespace vstent::apps
