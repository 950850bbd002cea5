// What a sweep of diameters found, as files and text.
#pragma once

#include <nlohmann/json_fwd.hpp>

#include "apps/diameters.hpp"
#include "apps/figure.hpp"
#include "flow/study.hpp"

namespace vstent::apps {

/// Which pressure drop a target is about.
enum class Gradient { mean, peak, peak_to_peak };
/// mmHg; that of steady flow is its mean.
double drop_of(const flow::Answer& answer, Gradient gradient);
std::string name(Gradient gradient);

/// One diameter: what its flow is like, or why it has none.
struct SweepEntry {
  double diameter = 0;  ///< mm
  std::string folder;
  bool searched = false;  ///< tried on the way to the target
  std::optional<flow::Answer> answer;
  double narrowest_after = 0;  ///< mm
  std::string refusal;
  int exit_code = 0;
};

struct Target {
  double drop = 0;  ///< mmHg
  Gradient gradient = Gradient::mean;
  std::optional<Trial> found;  ///< the smallest diameter known to reach it
  std::string verdict;         ///< one line
};

struct Sweep {
  std::string case_file, conditions;
  std::optional<flow::Answer> before;
  std::vector<SweepEntry> entries;  ///< by rising diameter
  std::optional<Target> target;
  std::vector<std::string> notes;
};

/// Those that were deployed, by rising diameter.
std::vector<Trial> trials(const std::vector<SweepEntry>& entries, Gradient gradient);
/// What the entries say of the target.
void judge(Target& target, const std::vector<SweepEntry>& entries);

std::string sweep_csv(const Sweep& sweep);
nlohmann::ordered_json sweep_json(const Sweep& sweep);
std::string sweep_table(const Sweep& sweep);
Figure sweep_figure(const Sweep& sweep);

}  // namespace vstent::apps
