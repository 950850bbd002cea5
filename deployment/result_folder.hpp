// The output folder: filled beside its final place, then put there in one move.
#pragma once

#include <filesystem>

namespace vstent::deployment {

/// Results are written into `stage()`, a sibling of the final folder. `publish` exchanges the two
/// atomically, keeping whatever else the user had in the final folder; without it, or when the
/// process is killed, the final folder stays as it was. Stages that dead processes left behind are
/// removed.
class ResultFolder {
 public:
  /// \throws Error (output) when the place cannot be written, before any work is done
  explicit ResultFolder(const std::filesystem::path& final_folder);
  ~ResultFolder();
  ResultFolder(const ResultFolder&) = delete;
  ResultFolder& operator=(const ResultFolder&) = delete;

  const std::filesystem::path& stage() const { return stage_; }
  const std::filesystem::path& final_folder() const { return final_; }

  /// \throws Error (output)
  void publish();

 private:
  std::filesystem::path final_, stage_;
};

}  // namespace vstent::deployment
