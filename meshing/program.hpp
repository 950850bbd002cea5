// Programs of others: found, run with limits, ended with all they started.
#pragma once

#include <filesystem>
#include <functional>
#include <string>
#include <vector>

namespace vstent::meshing {

/// The executable file that `name` means: a path as it is, a bare name looked up in PATH; empty
/// when there is none.
std::filesystem::path find_program(const std::string& name);

struct ProgramLimits {
  double seconds = 0;  ///< wall-clock time; 0: none
  /// Called ten times a second with the time so far; false ends the program.
  std::function<bool(double seconds)> keep_going;
};

struct ProgramRun {
  enum class End { exited, killed, timed_out, interrupted };
  End end = End::exited;
  int status = 0;  ///< exit code, or the signal that ended it
  double seconds = 0;
  double peak_megabytes = 0;  ///< of the largest process
};

/// Runs `program` in `folder`, its home too, without standard input, its output in `log`. It runs
/// on one thread where it heeds OMP_NUM_THREADS. It leads a process group of its own, which is
/// killed whole at its end, on a time-out, when `keep_going` says so, and when this process dies.
/// \throws Error (resources) when it cannot be started
ProgramRun run_program(const std::filesystem::path& program,
                       const std::vector<std::string>& arguments,
                       const std::filesystem::path& folder, const std::filesystem::path& log,
                       const ProgramLimits& limits);

}  // namespace vstent::meshing
