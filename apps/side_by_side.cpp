#include "apps/side_by_side.hpp"

#include <fcntl.h>
#include <spawn.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <csignal>
#include <cstring>
#include <fstream>
#include <sstream>
#include <thread>

#include "apps/terminal.hpp"
#include "vessels/error.hpp"

extern char** environ;

namespace vstent::apps {
namespace {

constexpr double kMemoryMargin = 1.3;  // a larger stent takes more than the one that was measured

long available_memory() {
  std::ifstream file("/proc/meminfo");
  std::string key, rest;
  long value = 0;
  while (file >> key >> value) {
    if (key == "MemAvailable:") return value;
    std::getline(file, rest);
  }
  return 0;
}

/// The last `error: ...` of a log.
std::string error_in(const std::filesystem::path& log) {
  std::ifstream file(log);
  std::string error;
  constexpr const char* kMark = "error: ";
  for (std::string line; std::getline(file, line);)
    if (line.starts_with(kMark)) error = line.substr(std::strlen(kMark));
  return error;
}

pid_t start(const Job& job, int threads) {
  std::vector<std::string> words{"vstent"};
  words.insert(words.end(), job.arguments.begin(), job.arguments.end());
  words.insert(words.end(), {"--threads", std::to_string(threads)});
  std::vector<char*> pointers;
  for (std::string& word : words) pointers.push_back(word.data());
  pointers.push_back(nullptr);
  posix_spawn_file_actions_t actions;
  posix_spawn_file_actions_init(&actions);
  posix_spawn_file_actions_addopen(&actions, STDOUT_FILENO, "/dev/null", O_WRONLY, 0);
  posix_spawn_file_actions_addopen(&actions, STDERR_FILENO, job.log.c_str(),
                                   O_WRONLY | O_CREAT | O_TRUNC, 0644);
  pid_t child = 0;
  const int fault =
      posix_spawn(&child, "/proc/self/exe", &actions, nullptr, pointers.data(), environ);
  posix_spawn_file_actions_destroy(&actions);
  if (fault != 0)
    throw Error(ExitCode::resources, job.label + ": cannot be started: " + std::strerror(fault));
  return child;
}

JobOutcome outcome_of(const Job& job, int status, const rusage& usage) {
  JobOutcome outcome;
  outcome.peak_memory = usage.ru_maxrss;
  outcome.exit_code = WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
  if (outcome.exit_code == 0) return outcome;
  outcome.error = error_in(job.log);
  if (outcome.error.empty()) {
    outcome.error = WIFSIGNALED(status)
                        ? "was ended by signal " + std::to_string(WTERMSIG(status))
                        : "ended with exit code " + std::to_string(outcome.exit_code);
  }
  return outcome;
}

class Runner {
 public:
  explicit Runner(const std::vector<Job>& jobs) : jobs_(jobs), outcomes_(jobs.size()) {}
  ~Runner() {
    for (const Running& r : running_) {
      kill(r.process, SIGTERM);
      waitpid(r.process, nullptr, 0);
    }
  }
  Runner(const Runner&) = delete;
  Runner& operator=(const Runner&) = delete;

  /// All jobs before `last`, at most `beside` at once.
  void run_until(std::size_t last, int beside, int threads) {
    while (next_ < last || !running_.empty()) {
      while (next_ < last && static_cast<int>(running_.size()) < beside) {
        running_.push_back({start(jobs_[next_], threads), next_});
        ++next_;
      }
      std::erase_if(running_, [&](const Running& r) { return finished(r); });
      if (interrupted()) throw Error(ExitCode::interrupted, "stopped on request");
      show();
      std::this_thread::sleep_for(std::chrono::milliseconds(20));
    }
  }

  long peak_memory() const {
    long peak = 0;
    for (const JobOutcome& o : outcomes_) peak = std::max(peak, o.peak_memory);
    return peak;
  }

  std::vector<JobOutcome> take() { return std::move(outcomes_); }

 private:
  struct Running {
    pid_t process = 0;
    std::size_t job = 0;
  };

  bool finished(const Running& r) {
    int status = 0;
    rusage usage{};
    const pid_t ended = wait4(r.process, &status, WNOHANG, &usage);
    if (ended == 0 || (ended < 0 && errno == EINTR)) return false;
    outcomes_[r.job] = outcome_of(jobs_[r.job], status, usage);
    return true;
  }

  void show() {
    std::string line;
    for (const Running& r : running_) line += (line.empty() ? "" : ", ") + jobs_[r.job].label;
    progress_.show("deploying " + line + " (" + std::to_string(next_) + " of " +
                   std::to_string(jobs_.size()) + ")");
  }

  const std::vector<Job>& jobs_;
  std::vector<JobOutcome> outcomes_;
  std::vector<Running> running_;
  std::size_t next_ = 0;
  Progress progress_;
};

}  // namespace

std::vector<JobOutcome> run_side_by_side(const std::vector<Job>& jobs, int threads) {
  if (jobs.empty()) return {};
  const int cores =
      threads > 0 ? threads : std::max(1, static_cast<int>(std::thread::hardware_concurrency()));
  Runner runner(jobs);
  runner.run_until(1, 1, cores);
  const double one = kMemoryMargin * static_cast<double>(std::max(1L, runner.peak_memory()));
  const int room = static_cast<int>(
      std::clamp(static_cast<double>(available_memory()) / one, 1.0, static_cast<double>(cores)));
  const int beside = std::min(room, std::max(1, static_cast<int>(jobs.size()) - 1));
  runner.run_until(jobs.size(), beside, std::max(1, cores / beside));
  return runner.take();
}

}  // namespace vstent::apps
