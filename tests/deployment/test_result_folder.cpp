#include <gtest/gtest.h>
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include "deployment/result_folder.hpp"
#include "tests/temporary_folder.hpp"
#include "vessels/error.hpp"

namespace vstent::deployment {
namespace {

namespace fs = std::filesystem;
using tests::read_text;
using tests::TemporaryFolder;
using tests::write_text;

std::size_t entries(const fs::path& folder) {
  return static_cast<std::size_t>(
      std::distance(fs::directory_iterator(folder), fs::directory_iterator{}));
}

TEST(ResultFolder, AppearsOnlyWhenPublished) {
  const TemporaryFolder folder;
  ResultFolder result(folder / "out");
  write_text(result.stage() / "a.txt", "new");
  EXPECT_FALSE(fs::exists(folder / "out"));
  result.publish();
  EXPECT_EQ(read_text(folder / "out/a.txt"), "new");
  EXPECT_EQ(entries(folder.path()), 1u);
}

TEST(ResultFolder, WithoutPublishingEverythingStaysAsItWas) {
  const TemporaryFolder folder;
  fs::create_directory(folder / "out");
  write_text(folder / "out/a.txt", "old");
  {
    const ResultFolder result(folder / "out");
    write_text(result.stage() / "a.txt", "new");
  }
  EXPECT_EQ(read_text(folder / "out/a.txt"), "old");
  EXPECT_EQ(entries(folder.path()), 1u);
}

TEST(ResultFolder, ReplacesItsOwnFilesAndKeepsTheUsers) {
  const TemporaryFolder folder;
  fs::create_directories(folder / "out/mine");
  write_text(folder / "out/a.txt", "old");
  write_text(folder / "out/notes.txt", "notes");
  write_text(folder / "out/mine/b.txt", "deep");
  ResultFolder result(folder / "out");
  write_text(result.stage() / "a.txt", "new");
  result.publish();
  EXPECT_EQ(read_text(folder / "out/a.txt"), "new");
  EXPECT_EQ(read_text(folder / "out/notes.txt"), "notes");
  EXPECT_EQ(read_text(folder / "out/mine/b.txt"), "deep");
  EXPECT_EQ(entries(folder.path()), 1u);
}

TEST(ResultFolder, AKilledRunLeavesTheFolderAsItWasAndTheNextOneCleansUp) {
  const TemporaryFolder folder;
  fs::create_directory(folder / "out");
  write_text(folder / "out/a.txt", "old");
  const pid_t child = fork();
  if (child == 0) {
    const ResultFolder result(folder / "out");
    write_text(result.stage() / "a.txt", "half");
    kill(getpid(), SIGKILL);
  }
  waitpid(child, nullptr, 0);
  EXPECT_EQ(read_text(folder / "out/a.txt"), "old");
  EXPECT_EQ(entries(folder / "out"), 1u);
  EXPECT_EQ(entries(folder.path()), 2u);  // the dead run's stage
  { const ResultFolder next(folder / "out"); }
  EXPECT_EQ(entries(folder.path()), 1u);
}

TEST(ResultFolder, RefusesAFileInItsPlace) {
  const TemporaryFolder folder;
  write_text(folder / "out", "a file");
  EXPECT_THROW(ResultFolder(folder / "out"), Error);
  EXPECT_THROW(ResultFolder("/proc/nowhere/out"), Error);
  EXPECT_EQ(read_text(folder / "out"), "a file");
}

}  // namespace
}  // namespace vstent::deployment
