#include "meshing/program.hpp"

#include <fcntl.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <chrono>
#include <csignal>
#include <cstdlib>
#include <cstring>
#include <sstream>
#include <thread>

#include "vessels/error.hpp"

namespace vstent::meshing {
namespace fs = std::filesystem;
namespace {

bool executable(const fs::path& path) {
  std::error_code ignored;
  return fs::is_regular_file(path, ignored) && ::access(path.c_str(), X_OK) == 0;
}

/// What execve wants, kept alive.
class Strings {
 public:
  explicit Strings(std::vector<std::string> texts) : texts_(std::move(texts)) {
    for (std::string& text : texts_) pointers_.push_back(text.data());
    pointers_.push_back(nullptr);
  }
  char* const* get() { return pointers_.data(); }

 private:
  std::vector<std::string> texts_;
  std::vector<char*> pointers_;
};

/// This process's environment, with a home without settings, the C locale and one thread.
std::vector<std::string> environment(const fs::path& home) {
  std::vector<std::string> result;
  const std::vector<std::string> ours = {"HOME=" + home.string(), "LC_ALL=C", "OMP_NUM_THREADS=1"};
  for (char** entry = environ; *entry != nullptr; ++entry) {
    const std::string text = *entry;
    const std::string key = text.substr(0, text.find('=') + 1);
    if (key != "HOME=" && key != "LC_ALL=" && key != "OMP_NUM_THREADS=") result.push_back(text);
  }
  result.insert(result.end(), ours.begin(), ours.end());
  return result;
}

}  // namespace

fs::path find_program(const std::string& name) {
  if (name.empty()) return {};
  if (name.find('/') != std::string::npos)
    return executable(name) ? fs::absolute(name) : fs::path();
  const char* path = std::getenv("PATH");
  std::istringstream folders(path != nullptr ? path : "/usr/local/bin:/usr/bin:/bin");
  for (std::string folder; std::getline(folders, folder, ':');) {
    const fs::path candidate = fs::path(folder.empty() ? "." : folder) / name;
    if (executable(candidate)) return fs::absolute(candidate);
  }
  return {};
}

ProgramRun run_program(const fs::path& program, const std::vector<std::string>& arguments,
                       const fs::path& folder, const fs::path& log, const ProgramLimits& limits) {
  using Clock = std::chrono::steady_clock;
  std::vector<std::string> words = {program.string()};
  words.insert(words.end(), arguments.begin(), arguments.end());
  Strings argv(std::move(words));
  Strings envp(environment(folder));
  const auto failure = [&](const std::string& what) {
    return Error(ExitCode::resources,
                 program.string() + ": cannot be started: " + what + ": " + std::strerror(errno));
  };
  const int output = ::open(log.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0666);
  if (output < 0) throw failure(log.string());
  int channel[2];  // carries errno when the program cannot be executed
  if (::pipe2(channel, O_CLOEXEC) != 0) {
    ::close(output);
    throw failure("no pipe");
  }
  const auto begin = Clock::now();
  const pid_t parent = ::getpid();
  const pid_t child = ::fork();
  if (child == 0) {
    ::setpgid(0, 0);
    ::prctl(PR_SET_PDEATHSIG, SIGKILL);
    if (::getppid() != parent) ::_exit(127);
    for (const int signal : {SIGINT, SIGTERM, SIGPIPE, SIGXFSZ}) std::signal(signal, SIG_DFL);
    const rlimit no_core{0, 0};
    ::setrlimit(RLIMIT_CORE, &no_core);
    const int nothing = ::open("/dev/null", O_RDONLY);
    if (::chdir(folder.c_str()) == 0 && nothing >= 0 && ::dup2(nothing, STDIN_FILENO) >= 0 &&
        ::dup2(output, STDOUT_FILENO) >= 0 && ::dup2(output, STDERR_FILENO) >= 0)
      ::execve(program.c_str(), argv.get(), envp.get());
    const int why = errno;
    const ssize_t sent = ::write(channel[1], &why, sizeof why);
    ::_exit(sent == sizeof why ? 127 : 126);
  }
  const int fork_error = errno;
  ::close(output);
  ::close(channel[1]);
  if (child < 0) {
    ::close(channel[0]);
    errno = fork_error;
    throw failure("no process");
  }
  ::setpgid(child, child);  // whichever of the two comes first
  int why = 0;
  ssize_t told = 0;
  while ((told = ::read(channel[0], &why, sizeof why)) < 0 && errno == EINTR) {
  }
  ::close(channel[0]);
  if (told == sizeof why) {
    ::waitpid(child, nullptr, 0);
    errno = why;
    throw failure("execution");
  }

  ProgramRun run;
  int status = 0;
  rusage usage{};
  const auto elapsed = [&] { return std::chrono::duration<double>(Clock::now() - begin).count(); };
  std::chrono::milliseconds pause(1);  // short runs are not made longer
  double told_at = 0;
  bool ended = false;
  while (!ended) {
    const pid_t got = ::wait4(child, &status, WNOHANG, &usage);
    if (got == child || (got < 0 && errno != EINTR)) break;
    const double now = elapsed();
    if (limits.seconds > 0 && now > limits.seconds) run.end = ProgramRun::End::timed_out;
    if (now - told_at >= 0.1 || told_at == 0) {
      told_at = now;
      if (limits.keep_going && !limits.keep_going(now)) run.end = ProgramRun::End::interrupted;
    }
    if (run.end != ProgramRun::End::exited) {
      ::kill(-child, SIGKILL);
      while (::wait4(child, &status, 0, &usage) < 0 && errno == EINTR) {
      }
      ended = true;
    } else {
      std::this_thread::sleep_for(pause);
      pause = std::min(pause * 2, std::chrono::milliseconds(50));
    }
  }
  ::kill(-child, SIGKILL);  // what it left running
  run.seconds = elapsed();
  run.peak_megabytes = static_cast<double>(usage.ru_maxrss) / 1024;
  if (run.end == ProgramRun::End::exited) {
    if (WIFSIGNALED(status)) {
      run.end = ProgramRun::End::killed;
      run.status = WTERMSIG(status);
    } else {
      run.status = WEXITSTATUS(status);
    }
  }
  return run;
}

}  // namespace vstent::meshing
