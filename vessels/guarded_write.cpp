#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <system_error>

#include "vessels/error.hpp"
#include "vessels/file_guard.hpp"

namespace vstent::vessels {
namespace {

class Descriptor {
 public:
  Descriptor(const std::filesystem::path& path, int flags)
      : fd_(::open(path.c_str(), flags | O_CLOEXEC, 0666)) {}
  ~Descriptor() {
    if (fd_ >= 0) ::close(fd_);
  }
  Descriptor(const Descriptor&) = delete;
  Descriptor& operator=(const Descriptor&) = delete;
  int get() const { return fd_; }
  bool close() {
    const int result = ::close(fd_);
    fd_ = -1;
    return result == 0;
  }

 private:
  int fd_;
};

bool write_all(int fd, std::string_view bytes) {
  while (!bytes.empty()) {
    const ssize_t written = ::write(fd, bytes.data(), bytes.size());
    if (written < 0 && errno == EINTR) continue;
    if (written <= 0) return false;
    bytes.remove_prefix(static_cast<std::size_t>(written));
  }
  return true;
}

bool holds(const std::filesystem::path& path, std::string_view bytes) {
  const Descriptor file(path, O_RDONLY);
  if (file.get() < 0) return false;
  std::string buffer(1 << 16, '\0');
  while (true) {
    const ssize_t got = ::read(file.get(), buffer.data(), buffer.size());
    if (got < 0 && errno == EINTR) continue;
    if (got < 0) return false;
    if (got == 0) return bytes.empty();
    const auto size = static_cast<std::size_t>(got);
    if (size > bytes.size() || std::memcmp(buffer.data(), bytes.data(), size) != 0) return false;
    bytes.remove_prefix(size);
  }
}

}  // namespace

void write_whole(const std::filesystem::path& path, std::string_view bytes) {
  namespace fs = std::filesystem;
  const auto failure = [&](const std::string& why) {
    return Error(ExitCode::output, path.string() + ": could not be written, " + why);
  };
  std::error_code ignored;
  fs::path target =
      fs::weakly_canonical(path, ignored);  // a link stays a link: its target is replaced
  if (target.empty()) target = path;
  const fs::path folder = target.has_parent_path() ? target.parent_path() : fs::path(".");
  if (!fs::is_directory(folder, ignored)) throw failure("there is no folder " + folder.string());
  if (fs::exists(target, ignored) && !fs::is_regular_file(target, ignored)) {
    throw failure("it is there already and is no regular file");
  }

  const fs::path partial = target.string() + ".partial-" + std::to_string(::getpid());
  const auto abandon = [&](const std::string& what) {
    const std::string why = what + ": " + std::strerror(errno);
    ::unlink(partial.c_str());
    return failure(why);
  };
  Descriptor file(partial, O_WRONLY | O_CREAT | O_TRUNC);
  if (file.get() < 0)
    throw failure(std::string("the folder refuses new files: ") + std::strerror(errno));
  if (!write_all(file.get(), bytes)) throw abandon("writing stopped");
  if (::fsync(file.get()) != 0) throw abandon("it did not reach the disk");
  if (!file.close()) throw abandon("closing failed");
  errno = EIO;
  if (!holds(partial, bytes)) throw abandon("what was read back differs");
  struct stat old {};
  if (::stat(target.c_str(), &old) == 0) ::chmod(partial.c_str(), old.st_mode & 07777);
  if (::rename(partial.c_str(), target.c_str()) != 0) throw abandon("renaming failed");
  const Descriptor directory(folder, O_RDONLY | O_DIRECTORY);
  if (directory.get() >= 0) ::fsync(directory.get());  // the file is whole either way
}

}  // namespace vstent::vessels
