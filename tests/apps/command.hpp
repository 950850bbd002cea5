// The command as a person runs it, in a folder of its own.
#pragma once

#include <sys/wait.h>
#include <unistd.h>

#include "tests/temporary_folder.hpp"

namespace vstent::tests {

struct CommandResult {
  int exit_code = -1;
  std::string out, err;
};

/// Starts `vstent <arguments>` in the folder; it prints to out.txt and err.txt there.
inline pid_t start(const TemporaryFolder& folder, const std::string& arguments) {
  const std::string line = "cd " + folder.path().string() + " && exec " + VSTENT_COMMAND + " " +
                           arguments + " >out.txt 2>err.txt";
  const pid_t child = fork();
  if (child == 0) {
    execl("/bin/sh", "sh", "-c", line.c_str(), static_cast<char*>(nullptr));
    _exit(127);
  }
  return child;
}

inline CommandResult vstent(const TemporaryFolder& folder, const std::string& arguments) {
  const pid_t child = start(folder, arguments);
  int status = 0;
  waitpid(child, &status, 0);
  return {WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status),
          read_text(folder / "out.txt"), read_text(folder / "err.txt")};
}

}  // namespace vstent::tests
