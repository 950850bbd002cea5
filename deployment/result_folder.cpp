#include "deployment/result_folder.hpp"

#include <fcntl.h>
#include <signal.h>
#include <stdio.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <string>

#include "vessels/error.hpp"

namespace vstent::deployment {
namespace fs = std::filesystem;
namespace {

constexpr const char* kMark = ".partial-";

[[noreturn]] void fail(const fs::path& path, const std::string& what) {
  throw Error(ExitCode::output, path.string() + ": " + what);
}

/// Stages are named after their process; one whose process is gone will never be finished.
void remove_abandoned_stages(const fs::path& final_folder) {
  const std::string prefix = final_folder.filename().string() + kMark;
  std::error_code ignored;
  for (const auto& entry : fs::directory_iterator(final_folder.parent_path(), ignored)) {
    const std::string name = entry.path().filename().string();
    if (!name.starts_with(prefix)) continue;
    const std::string digits = name.substr(prefix.size());
    if (digits.empty() || digits.find_first_not_of("0123456789") != std::string::npos ||
        digits.size() > 9)
      continue;
    const pid_t process = std::stoi(digits);
    if (process != getpid() && kill(process, 0) != 0 && errno == ESRCH)
      fs::remove_all(entry.path(), ignored);
  }
}

void sync_folder(const fs::path& folder) {
  const int descriptor = open(folder.c_str(), O_RDONLY | O_DIRECTORY);
  if (descriptor < 0) return;
  fsync(descriptor);
  close(descriptor);
}

/// What the user keeps in the old folder and this run did not write appears in the new one too.
void keep_foreign_entries(const fs::path& from, const fs::path& to) {
  for (const auto& entry : fs::directory_iterator(from)) {
    const fs::path target = to / entry.path().filename();
    if (fs::exists(fs::symlink_status(target))) continue;
    std::error_code failed;
    const auto how = fs::copy_options::recursive | fs::copy_options::copy_symlinks;
    fs::copy(entry.path(), target, how | fs::copy_options::create_hard_links, failed);
    if (failed) {
      fs::remove_all(target);
      fs::copy(entry.path(), target, how);
    }
  }
}

}  // namespace

ResultFolder::ResultFolder(const fs::path& final_folder) {
  try {
    final_ = fs::absolute(final_folder).lexically_normal();
    if (!final_.has_filename()) final_ = final_.parent_path();
    if (fs::exists(final_) && !fs::is_directory(final_))
      fail(final_, "is a file; results need a folder");
    fs::create_directories(final_.parent_path());
    if (fs::exists(final_) && access(final_.c_str(), W_OK) != 0)
      fail(final_, "cannot be written to");
    remove_abandoned_stages(final_);
    stage_ = final_.string() + kMark + std::to_string(getpid());
    fs::remove_all(stage_);
    fs::create_directory(stage_);
  } catch (const fs::filesystem_error& error) {
    fail(final_folder, std::string("cannot be made: ") + error.code().message());
  }
}

ResultFolder::~ResultFolder() {
  std::error_code ignored;
  if (!stage_.empty()) fs::remove_all(stage_, ignored);
}

void ResultFolder::publish() {
  try {
    sync_folder(stage_);
    if (!fs::exists(final_)) {
      fs::rename(stage_, final_);
    } else {
      keep_foreign_entries(final_, stage_);
      if (renameat2(AT_FDCWD, stage_.c_str(), AT_FDCWD, final_.c_str(), RENAME_EXCHANGE) != 0) {
        fail(final_, std::string("results cannot be put in place: ") + std::strerror(errno));
      }
      fs::remove_all(stage_);
    }
    sync_folder(final_.parent_path());
    stage_.clear();
  } catch (const fs::filesystem_error& error) {
    fail(final_, std::string("results cannot be put in place: ") + error.code().message());
  }
}

}  // namespace vstent::deployment
