#include "apps/diameters.hpp"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <functional>

#include "vessels/error.hpp"
#include "vessels/units.hpp"

namespace vstent::apps {
namespace {

constexpr double kPerMm = 100;        // mm: no balloon is finer
constexpr double kCloseEnough = 0.1;  // mm
constexpr int kMost = 100;

[[noreturn]] void refuse(const std::string& text, const std::string& what) {
  throw Error(ExitCode::usage, "command line: --diameter: \"" + text + "\" " + what);
}

std::vector<std::string> split(const std::string& text, char mark) {
  std::vector<std::string> parts(1);
  for (const char c : text) {
    if (c == mark) {
      parts.emplace_back();
    } else {
      parts.back() += c;
    }
  }
  return parts;
}

double rounded(double diameter) { return std::round(diameter * kPerMm) / kPerMm; }

double diameter_of(const std::string& text, const std::string& part) {
  if (part.empty() || !std::isalpha(static_cast<unsigned char>(part.back())))
    refuse(text, "needs a unit with every diameter, as 6mm:12mm:7 or 6mm,8mm");
  const double value =
      vessels::parse_length(part, vessels::LengthUnit::mm, "command line: --diameter");
  if (!(value > 0)) refuse(text, "must be positive");
  return value;
}

}  // namespace

std::vector<double> parse_diameters(const std::string& text) {
  std::vector<double> result;
  if (text.find(':') == std::string::npos) {
    for (const std::string& part : split(text, ',')) result.push_back(diameter_of(text, part));
  } else {
    const std::vector<std::string> parts = split(text, ':');
    if (parts.size() != 3) refuse(text, "must be first:last:how many, as 6mm:12mm:7");
    const double first = diameter_of(text, parts[0]), last = diameter_of(text, parts[1]);
    int count = 0;
    const char* end = parts[2].data() + parts[2].size();
    const auto [stopped, fault] = std::from_chars(parts[2].data(), end, count);
    if (fault != std::errc() || stopped != end || count < 2 || count > kMost)
      refuse(text, "must end in how many diameters, from 2 to " + std::to_string(kMost));
    if (!(last > first)) refuse(text, "must rise");
    for (int i = 0; i < count; ++i)
      result.push_back(rounded(first + (last - first) * i / (count - 1)));
  }
  if (std::adjacent_find(result.begin(), result.end(), std::greater_equal<>()) != result.end())
    refuse(text, "must rise, by 0.01 mm or more from one to the next");
  return result;
}

std::optional<Bracket> bracket(const std::vector<Trial>& trials, double target) {
  for (std::size_t i = 1; i < trials.size(); ++i)
    if (trials[i - 1].drop > target && trials[i].drop <= target)
      return Bracket{trials[i - 1], trials[i]};
  return std::nullopt;
}

std::optional<double> next_diameter(const Bracket& b, double target) {
  const double width = b.below.diameter - b.above.diameter;
  if (width < kCloseEnough) return std::nullopt;
  // Losses go like a power of the diameter; a drop that is not positive has no logarithm.
  double share = (b.above.drop - target) / (b.above.drop - b.below.drop);
  if (target > 0 && b.below.drop > 0)
    share = std::log(b.above.drop / target) / std::log(b.above.drop / b.below.drop);
  const double ratio = b.below.diameter / b.above.diameter;
  const double diameter = rounded(b.above.diameter * std::pow(ratio, std::clamp(share, 0.1, 0.9)));
  if (diameter <= b.above.diameter || diameter >= b.below.diameter) return std::nullopt;
  return diameter;
}

}  // namespace vstent::apps
