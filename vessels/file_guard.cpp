#include "vessels/file_guard.hpp"

#include <fcntl.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <cerrno>
#include <charconv>
#include <csignal>
#include <cstring>
#include <fstream>
#include <optional>

#include "vessels/error.hpp"

namespace vstent::vessels {
namespace {

Error unreadable(const std::string& name, const std::string& why) {
  return Error(ExitCode::input_file, name + ": " + why);
}

}  // namespace

std::string extension(const std::filesystem::path& path) {
  std::string result = path.extension().string();
  std::transform(result.begin(), result.end(), result.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return result;
}

std::string read_bytes(const std::filesystem::path& path) {
  const std::string name = path.string();
  struct stat status {};
  if (::stat(path.c_str(), &status) != 0) {
    throw unreadable(name, errno == ENOENT ? "there is no such file" : std::strerror(errno));
  }
  if (S_ISDIR(status.st_mode)) throw unreadable(name, "it is a folder, name a surface file");
  if (!S_ISREG(status.st_mode)) throw unreadable(name, "it is no regular file");
  if (status.st_size == 0) throw unreadable(name, "the file is empty (0 bytes)");
  std::ifstream file(path, std::ios::binary);
  if (!file) throw unreadable(name, std::string("cannot be opened: ") + std::strerror(errno));
  std::string bytes(static_cast<std::size_t>(status.st_size), '\0');
  file.read(bytes.data(), static_cast<std::streamsize>(bytes.size()));
  if (file.gcount() != static_cast<std::streamsize>(bytes.size())) {
    throw unreadable(name, "reading stopped after " + std::to_string(file.gcount()) + " of " +
                               std::to_string(bytes.size()) + " bytes");
  }
  return bytes;
}

std::string try_in_child(const std::function<std::string()>& parse, std::size_t file_size) {
  constexpr unsigned kSecondsBase = 60;
  const auto seconds =
      kSecondsBase + static_cast<unsigned>(file_size >> 22);  // 4 MiB/s is a slow parse
  std::array<int, 2> channel{};
  if (::pipe2(channel.data(), O_CLOEXEC) != 0)
    return std::string("no pipe: ") + std::strerror(errno);
  const pid_t child = ::fork();
  if (child < 0) {
    ::close(channel[0]);
    ::close(channel[1]);
    return std::string("no process to read it in: ") + std::strerror(errno);
  }
  if (child == 0) {
    for (const int signal : {SIGALRM, SIGINT, SIGTERM, SIGSEGV, SIGABRT, SIGBUS, SIGFPE, SIGPIPE}) {
      std::signal(signal, SIG_DFL);
    }
    if (const int silent = ::open("/dev/null", O_WRONLY); silent >= 0)
      ::dup2(silent, STDERR_FILENO);
    const rlimit no_core{0, 0};
    ::setrlimit(RLIMIT_CORE, &no_core);
#ifndef __SANITIZE_ADDRESS__
    std::size_t pages = 0;
    std::ifstream("/proc/self/statm") >> pages;
    const std::size_t now = pages * static_cast<std::size_t>(::sysconf(_SC_PAGESIZE));
    const rlim_t limit = now + (std::size_t{1} << 30) + 200 * file_size;
    const rlimit memory{limit, limit};
    ::setrlimit(RLIMIT_AS, &memory);
#endif
    ::alarm(seconds);
    std::string fault;
    try {
      fault = parse();
    } catch (const std::exception& error) {
      fault = error.what();
    } catch (...) {
      fault = "the reader failed";
    }
    fault.resize(std::min<std::size_t>(fault.size(), 1000));
    const ssize_t sent = fault.empty() ? 0 : ::write(channel[1], fault.data(), fault.size());
    ::_exit(sent == static_cast<ssize_t>(fault.size()) && fault.empty() ? 0 : 1);
  }
  ::close(channel[1]);
  std::string fault;
  std::array<char, 256> buffer{};
  while (true) {
    const ssize_t got = ::read(channel[0], buffer.data(), buffer.size());
    if (got < 0 && errno == EINTR) continue;
    if (got <= 0) break;
    fault.append(buffer.data(), static_cast<std::size_t>(got));
  }
  ::close(channel[0]);
  int status = 0;
  while (::waitpid(child, &status, 0) < 0 && errno == EINTR) {
  }
  if (!fault.empty()) return fault;
  if (WIFEXITED(status) && WEXITSTATUS(status) == 0) return {};
  if (WIFSIGNALED(status) && WTERMSIG(status) == SIGALRM) {
    return "reading it took more than " + std::to_string(seconds) + " s";
  }
  if (WIFSIGNALED(status))
    return std::string("it crashes VTK's reader (") + strsignal(WTERMSIG(status)) + ")";
  return "VTK's reader gave up on it";
}

}  // namespace vstent::vessels
