// report.html: a result folder as one page that works from disk, without a network.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace vstent::report {

struct Options {
  double size_limit = 10;  ///< MB (10^6 bytes); saved steps are dropped evenly to stay below
  std::string name;        ///< what the page is called
  std::string version;     ///< of the command
  std::string disclaimer;
  std::string shown_folder;  ///< as commands on the page name it
};

struct Written {
  std::size_t bytes = 0;
  std::vector<std::string> warnings;  ///< what the page leaves out, and why; the page says so too
};

/// Whether this build has the page (CMake option VSTENT_REPORT).
bool available();

/// Reads stented.vtp, case.json and metrics.json of `folder`, and stent.vtp, struts.vtp,
/// centerline.vtp, sections.vtp, profiles.csv, history.csv, steps.pvd where they are; writes `file`
/// whole or not at all. \throws Error (input_file) for missing or damaged files, (resources) when
/// even without steps the page is larger than the limit, (usage) when the build has no page,
/// (output)
Written write_report(const std::filesystem::path& folder, const std::filesystem::path& file,
                     const Options& options);

}  // namespace vstent::report
