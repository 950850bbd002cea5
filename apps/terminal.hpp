// Talking to the person at the terminal: progress while it takes long, interrupts, thread count.
#pragma once

#include <CLI/CLI.hpp>
#include <chrono>
#include <string>

namespace vstent::apps {

/// SIGINT and SIGTERM raise a flag that long work looks at between steps.
void watch_for_interrupts();
bool interrupted();

/// A line on standard error that is rewritten in place; silent where standard error is no terminal.
class Progress {
 public:
  Progress();
  ~Progress();
  void show(const std::string& line);
  void clear();

 private:
  bool terminal_ = false;
  bool shown_ = false;
  std::chrono::steady_clock::time_point last_{};
};

/// Adds --threads to a subcommand; the returned object must live while work runs.
class ThreadLimit {
 public:
  void add_option(CLI::App& command);
  void apply() const;
  int count() const { return threads_; }  ///< 0: all

 private:
  int threads_ = 0;
};

}  // namespace vstent::apps
