#include <gtest/gtest.h>
#include <tbb/global_control.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <sstream>

#include "sdf/level_set.hpp"
#include "tests/sdf/shapes.hpp"

namespace vstent::sdf {
namespace {

namespace fs = std::filesystem;

class LevelSetFile : public testing::Test {
 protected:
  void SetUp() override {
    folder_ =
        fs::temp_directory_path() /
        ("vstent_" + std::string(testing::UnitTest::GetInstance()->current_test_info()->name()) +
         std::to_string(::getpid()));
    fs::create_directories(folder_);
  }
  void TearDown() override { fs::remove_all(folder_); }
  fs::path path(const std::string& name) const { return folder_ / name; }
  fs::path folder_;
};

std::string bytes_of(const fs::path& path) {
  std::ifstream in(path, std::ios::binary);
  std::ostringstream bytes;
  bytes << in.rdbuf();
  return bytes.str();
}

void write_bytes(const fs::path& path, const std::string& bytes) {
  std::ofstream(path, std::ios::binary) << bytes;
}

LevelSet some_level_set() {
  return voxelise(tests::uniform_tube(tests::arc_axis(6, 1, 20), 1.5), {.voxel_size = 0.2});
}

TEST_F(LevelSetFile, RoundTripKeepsEveryNode) {
  const LevelSet written = some_level_set();
  written.write(path("stent.vdb"), "stent");
  const LevelSet read = LevelSet::read(path("stent.vdb"));
  EXPECT_EQ(read.voxel_size(), written.voxel_size());
  EXPECT_EQ(read.background(), written.background());
  EXPECT_EQ(read.active_voxels(), written.active_voxels());
  const auto nodes = [](const LevelSet& level_set) {
    std::vector<std::pair<std::array<double, 3>, double>> all;
    level_set.for_each_active([&](const Vec3& x, double value) {
      all.push_back({{x.x(), x.y(), x.z()}, value});
    });
    return all;
  };
  EXPECT_EQ(nodes(read), nodes(written));
  tests::Random random(41);
  for (int n = 0; n < 5000; ++n) {
    const Vec3 x = random.in_box({-2, -2, -2}, {9, 9, 2});
    EXPECT_EQ(read.sample(x).distance, written.sample(x).distance);
    EXPECT_EQ(read.sample(x).gradient, written.sample(x).gradient);
  }
}

TEST_F(LevelSetFile, EqualLevelSetsGiveEqualBytes) {
  for (const std::size_t threads : {std::size_t{1}, std::size_t{2}}) {
    const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads);
    some_level_set().write(path(std::to_string(threads) + ".vdb"), "stent");
  }
  const std::string bytes = bytes_of(path("1.vdb"));
  EXPECT_FALSE(bytes.empty());
  EXPECT_TRUE(bytes == bytes_of(path("2.vdb")));
  LevelSet::read(path("1.vdb")).write(path("again.vdb"), "stent");
  EXPECT_TRUE(bytes == bytes_of(path("again.vdb")));
}

TEST_F(LevelSetFile, WritingLeavesNothingElseBehind) {
  some_level_set().write(path("stent.vdb"), "stent");
  some_level_set().write(path("stent.vdb"), "stent");
  int entries = 0;
  for ([[maybe_unused]] const auto& entry : fs::directory_iterator(folder_)) ++entries;
  EXPECT_EQ(entries, 1);
}

TEST_F(LevelSetFile, FailedWritingSaysSoAndKeepsWhatWasThere) {
  EXPECT_THROW(some_level_set().write(path("absent/stent.vdb"), "stent"), std::runtime_error);
  EXPECT_FALSE(fs::exists(path("absent")));
  fs::create_directories(path("taken/inside"));
  EXPECT_THROW(some_level_set().write(path("taken"), "stent"), std::runtime_error);
  EXPECT_TRUE(fs::exists(path("taken/inside")));
}

TEST_F(LevelSetFile, DamageIsNoticed) {
  // Every byte after the header is under the checksum; the versions before it are OpenVDB's to
  // check.
  some_level_set().write(path("stent.vdb"), "stent");
  const std::string bytes = bytes_of(path("stent.vdb"));
  tests::Random random(42);
  for (int n = 0; n < 200; ++n) {
    std::string damaged = bytes;
    const auto at = static_cast<std::size_t>(random(57, static_cast<double>(bytes.size())));
    damaged[at] = static_cast<char>(damaged[at] ^ (1 << static_cast<int>(random(0, 8))));
    write_bytes(path("damaged.vdb"), damaged);
    EXPECT_THROW(LevelSet::read(path("damaged.vdb")), std::runtime_error) << "byte " << at;
  }
}

TEST_F(LevelSetFile, WhatIsNotALevelSetIsRefused) {
  some_level_set().write(path("stent.vdb"), "stent");
  const std::string bytes = bytes_of(path("stent.vdb"));
  EXPECT_THROW(LevelSet::read(path("absent.vdb")), std::runtime_error);
  EXPECT_THROW(LevelSet::read(folder_), std::runtime_error);
  for (const std::string& content :
       {std::string(), std::string("hello"), std::string(1000, 'x'), bytes.substr(0, 30),
        bytes.substr(0, 500), bytes.substr(0, bytes.size() / 2)}) {
    write_bytes(path("wrong.vdb"), content);
    EXPECT_THROW(LevelSet::read(path("wrong.vdb")), std::runtime_error)
        << content.size() << " bytes";
  }
}

}  // namespace
}  // namespace vstent::sdf
