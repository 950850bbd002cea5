// Folders include only what lies below them, and OpenVDB and VTK stay where they are hidden.
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <map>
#include <regex>
#include <set>

namespace {

namespace fs = std::filesystem;

const std::map<std::string, std::set<std::string>> kMayInclude = {
    {"sdf", {"sdf"}},
    {"xpbd", {"xpbd"}},
    {"stents", {"stents"}},
    {"vessels", {"vessels", "sdf"}},
    {"measure", {"measure", "sdf", "stents", "vessels"}},
    {"deployment", {"deployment", "sdf", "xpbd", "stents", "vessels", "measure"}},
    {"flow", {"flow", "vessels", "sdf", "measure"}},
    {"meshing", {"meshing", "flow", "vessels", "sdf", "measure"}},
    {"report", {"report", "vessels", "sdf", "measure"}},
    {"apps",
     {"apps", "report", "deployment", "flow", "meshing", "sdf", "xpbd", "stents", "vessels",
      "measure"}},
};
// Plain geometry, shared by all.
const std::set<std::string> kShared = {"sdf/geometry.hpp", "sdf/nearest.hpp", "sdf/polyline.hpp"};

struct Include {
  fs::path file;
  std::string folder, header;
};

std::vector<Include> includes() {
  std::vector<Include> found;
  const std::regex pattern(R"re(^\s*#\s*include\s*["<]([^">]+)[">])re");
  for (const auto& [folder, allowed] : kMayInclude) {
    for (const auto& entry :
         fs::recursive_directory_iterator(fs::path(VSTENT_SOURCE_DIR) / folder)) {
      if (entry.path().extension() != ".hpp" && entry.path().extension() != ".cpp") continue;
      std::ifstream file(entry.path());
      std::smatch match;
      for (std::string line; std::getline(file, line);) {
        if (std::regex_search(line, match, pattern))
          found.push_back({entry.path(), folder, match[1]});
      }
    }
  }
  return found;
}

TEST(Layering, NothingIncludesUpward) {
  std::size_t checked = 0;
  for (const Include& include : includes()) {
    const std::string target = include.header.substr(0, include.header.find('/'));
    if (!kMayInclude.contains(target) || kShared.contains(include.header)) continue;
    ++checked;
    EXPECT_TRUE(kMayInclude.at(include.folder).contains(target))
        << include.file << " includes " << include.header;
  }
  EXPECT_GT(checked, 50u);
}

TEST(Layering, OpenVdbAndVtkStayHidden) {
  std::set<fs::path> openvdb_files;
  for (const Include& include : includes()) {
    if (include.header.starts_with("openvdb/")) {
      openvdb_files.insert(include.file);
      EXPECT_EQ(include.folder, "sdf") << include.file;
    }
    if (include.header.starts_with("vtk")) {
      EXPECT_TRUE(include.folder == "vessels" || include.folder == "apps") << include.file;
    }
  }
  std::size_t sources = 0;
  for (const fs::path& file : openvdb_files) sources += file.extension() == ".cpp";
  EXPECT_LE(sources, 3u) << "OpenVDB costs a minute of compilation per source file";
}

}  // namespace
