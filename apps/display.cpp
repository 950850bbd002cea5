#include "apps/display.hpp"

#include <fcntl.h>
#include <poll.h>
#include <signal.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cstdlib>

#include "meshing/program.hpp"

namespace vstent::apps {
namespace {

/// The display number that the server writes once it is ready; empty when it does not within
/// `timeout_ms`.
std::string read_display_number(int descriptor, int timeout_ms) {
  std::string number;
  pollfd waiting{descriptor, POLLIN, 0};
  while (poll(&waiting, 1, timeout_ms) > 0) {
    char byte = 0;
    if (read(descriptor, &byte, 1) != 1) return {};
    if (byte == '\n') return number;
    number += byte;
  }
  return {};
}

}  // namespace

OffscreenDisplay::OffscreenDisplay() {
  const char* set = std::getenv("DISPLAY");
  previous_ = set ? set : "";
  const std::string program = meshing::find_program("Xvfb").string();
  if (program.empty()) {
    available_ = !previous_.empty();
    reason_ = "neither Xvfb (package xvfb) nor a display was found";
    return;
  }
  int channel[2];
  if (pipe(channel) != 0) {
    reason_ = "no pipe to Xvfb could be opened";
    return;
  }
  const std::string number_goes_to = std::to_string(channel[1]);
  server_ = fork();
  if (server_ == 0) {
    prctl(PR_SET_PDEATHSIG, SIGKILL);  // so that a killed run leaves no server behind
    close(channel[0]);
    const int nothing = open("/dev/null", O_RDWR);
    dup2(nothing, STDOUT_FILENO);
    dup2(nothing, STDERR_FILENO);
    execl(program.c_str(), "Xvfb", "-displayfd", number_goes_to.c_str(), "-screen", "0",
          "1600x1200x24", "-nolisten", "tcp", static_cast<char*>(nullptr));
    _exit(127);
  }
  close(channel[1]);
  const std::string number = server_ > 0 ? read_display_number(channel[0], 10'000) : std::string();
  close(channel[0]);
  if (number.empty()) {
    reason_ = program + " did not start";
    return;
  }
  setenv("DISPLAY", (":" + number).c_str(), 1);
  available_ = true;
}

OffscreenDisplay::~OffscreenDisplay() {
  if (server_ > 0) {
    kill(server_, SIGTERM);
    waitpid(server_, nullptr, 0);
  }
  if (previous_.empty()) {
    unsetenv("DISPLAY");
  } else {
    setenv("DISPLAY", previous_.c_str(), 1);
  }
}

}  // namespace vstent::apps
