// The one exception a person's mistake becomes: a clear line and the exit code that goes with it.
#pragma once

#include <stdexcept>
#include <string>

namespace vstent {

/// Exit codes of the command; the groups follow where the fault lies.
enum class ExitCode {
  ok = 0,
  usage = 2,        ///< command line or case file
  input_file = 3,   ///< a file that cannot be read
  geometry = 4,     ///< a surface or a request that is not feasible
  numerical = 5,    ///< the simulation did not reach a trustworthy result
  output = 6,       ///< results could not be written
  resources = 7,    ///< memory or size limits
  interrupted = 130
};

/// what() is one line: `<file>[: key]: what, value, what to do`.
class Error : public std::runtime_error {
 public:
  Error(ExitCode code, const std::string& line) : std::runtime_error(line), code_(code) {}
  ExitCode code() const { return code_; }

 private:
  ExitCode code_;
};

}  // namespace vstent
