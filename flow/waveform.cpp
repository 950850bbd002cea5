#include "flow/waveform.hpp"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <sstream>

#include "vessels/error.hpp"
#include "vessels/file_guard.hpp"
#include "vessels/text.hpp"

namespace vstent::flow {
namespace {

[[noreturn]] void fail(const std::string& file, std::size_t line, const std::string& what) {
  throw Error(ExitCode::input_file, file + ": line " + std::to_string(line) + ": " + what);
}

std::vector<std::string> words_of(const std::string& line, bool commas) {
  std::vector<std::string> words;
  std::string word;
  std::istringstream stream(line);
  if (commas) {
    while (std::getline(stream, word, ',')) {
      const std::size_t from = word.find_first_not_of(" \t\r"), to = word.find_last_not_of(" \t\r");
      words.push_back(from == std::string::npos ? "" : word.substr(from, to - from + 1));
    }
  } else {
    while (stream >> word) words.push_back(word);
  }
  return words;
}

double number_of(const std::string& word, const std::string& file, std::size_t line) {
  double value = 0;
  const char* begin = word.data() + (word.starts_with('+') ? 1 : 0);
  const char* end = word.data() + word.size();
  const auto [stopped, fault] = std::from_chars(begin, end, value);
  if (fault != std::errc() || stopped != end || !std::isfinite(value))
    fail(file, line, "\"" + word + "\" is no number");
  return value;
}

/// "velocity (m/s)" is the name and the unit.
struct Heading {
  std::string name, unit;
};

Heading heading_of(const std::string& word) {
  const std::size_t open = word.find_first_of("([");
  Heading heading{word.substr(0, open), ""};
  if (open != std::string::npos) {
    const std::size_t close = word.find_first_of(")]", open);
    heading.unit = word.substr(open + 1, close == std::string::npos ? close : close - open - 1);
  }
  while (heading.name.ends_with(' ')) heading.name.pop_back();
  std::transform(heading.name.begin(), heading.name.end(), heading.name.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return heading;
}

struct Columns {
  double seconds = 1;  ///< per unit of time
  std::string name, unit;
};

Columns columns_of(const std::string& header, const std::string& file) {
  const std::vector<std::string> words = words_of(header, true);
  const std::string wanted =
      "the header must be `time,flow` or `time,velocity`, is `" + header + "`";
  if (words.size() != 2) fail(file, 1, wanted);
  const Heading time = heading_of(words[0]), value = heading_of(words[1]);
  if (time.name != "time" || (value.name != "flow" && value.name != "velocity"))
    fail(file, 1, wanted);
  Columns columns{1, value.name, value.unit};
  if (!time.unit.empty()) columns.seconds = cgs_per(time.unit, Dimension::time, file + ": line 1");
  return columns;
}

/// The unit of the values: that of the header and the one that was given must not contradict.
std::string unit_of(const Columns& columns, const std::string& given, const std::string& file,
                    const std::string& key) {
  if (columns.unit.empty() && given.empty()) {
    throw Error(ExitCode::usage, key + ": is missing: the unit of the values in " + file +
                                     " (mL/s, L/min; or m/s, cm/s of a velocity)");
  }
  if (given.empty()) return columns.unit;
  const Dimension dimension = flow_or_velocity(given, key);
  if (!columns.name.empty() && (columns.name == "velocity") != (dimension == Dimension::velocity)) {
    throw Error(ExitCode::usage, key + ": \"" + given + "\" contradicts " + file +
                                     ", whose second column is `" + columns.name + "`");
  }
  if (!columns.unit.empty() &&
      cgs_per(columns.unit, dimension, file + ": line 1") != cgs_per(given, dimension, key)) {
    throw Error(ExitCode::usage, key + ": \"" + given + "\" contradicts " + file +
                                     ", whose header says \"" + columns.unit + "\"");
  }
  return given;
}

/// A period begins at 0 and ends as it began.
void close_period(Waveform& w, const std::string& file, std::vector<std::string>& notes) {
  if (w.time.front() != 0) {
    notes.push_back(file + ": begins at " + vessels::number(w.time.front()) +
                    " s; its first sample is taken for the start of the beat");
    const double start = w.time.front();
    for (double& t : w.time) t -= start;
  }
  if (w.value.front() == w.value.back()) return;
  const auto [low, high] = std::minmax_element(w.value.begin(), w.value.end());
  const double share = std::abs(w.value.back() - w.value.front()) / (*high - *low);
  notes.push_back(file + ": its last sample differs from its first by " +
                  vessels::number(100 * share) +
                  " % of its range; both take their mean, so that beats join");
  w.value.front() = w.value.back() = 0.5 * (w.value.front() + w.value.back());
}

}  // namespace

Waveform constant(double value) { return {{0}, {value}}; }

double at(const Waveform& w, double time) {
  if (w.constant()) return w.value.front();
  const double within = time - w.period() * std::floor(time / w.period());
  const auto above = std::upper_bound(w.time.begin() + 1, w.time.end() - 1, within);
  const auto i = static_cast<std::size_t>(above - w.time.begin());
  const double share = std::clamp((within - w.time[i - 1]) / (w.time[i] - w.time[i - 1]), 0.0, 1.0);
  return (1 - share) * w.value[i - 1] + share * w.value[i];
}

double mean(const Waveform& w) {
  if (w.constant()) return w.value.front();
  double integral = 0;
  for (std::size_t i = 1; i < w.time.size(); ++i)
    integral += 0.5 * (w.value[i] + w.value[i - 1]) * (w.time[i] - w.time[i - 1]);
  return integral / w.period();
}

Waveform times(Waveform waveform, double factor) {
  for (double& value : waveform.value) value *= factor;
  return waveform;
}

WaveformFile read_waveform(const std::filesystem::path& path, const std::string& units,
                           const std::string& key) {
  const std::string extension = vessels::extension(path), file = path.string();
  const bool csv = extension == ".csv";
  if (!csv && extension != ".flow") {
    throw Error(ExitCode::usage, key + ": " + file +
                                     " is neither a .flow file (time and flow) nor a .csv "
                                     "(time,flow or time,velocity)");
  }
  std::istringstream lines(vessels::read_bytes(path));
  std::string line;
  std::size_t number = 0;
  Columns columns;
  if (csv) {
    std::getline(lines, line);
    if (line.ends_with('\r')) line.pop_back();
    ++number;
    columns = columns_of(line, file);
  }
  const std::string unit = unit_of(columns, units, file, key);
  WaveformFile result;
  result.dimension = flow_or_velocity(unit, key);
  if (!csv && result.dimension != Dimension::flow) {
    throw Error(ExitCode::usage,
                key + ": \"" + unit + "\" contradicts " + file + ": a .flow file holds flows");
  }
  const double cgs = cgs_per(unit, result.dimension, key);
  Waveform& w = result.waveform;
  while (std::getline(lines, line)) {
    ++number;
    const std::vector<std::string> words = words_of(line, csv);
    if (words.empty() || words[0].starts_with('#') || (words.size() == 1 && words[0].empty()))
      continue;
    if (words.size() != 2)
      fail(file, number, "has " + vessels::counted(words.size(), "column") + ", must have 2");
    w.time.push_back(number_of(words[0], file, number) * columns.seconds);
    w.value.push_back(number_of(words[1], file, number) * cgs);
    if (w.time.size() > 1 && !(w.time.back() > w.time[w.time.size() - 2]))
      fail(file, number, "time does not rise");
  }
  if (w.time.size() < 2)
    throw Error(ExitCode::input_file, file + ": has fewer than two samples over the beat");
  close_period(w, file, result.notes);
  return result;
}

std::string simvascular_flow(const Waveform& inflow) {
  std::ostringstream text;
  const auto row = [&](double time, double value) {
    text << vessels::exact(time) << ' ' << vessels::exact(-value + 0.0) << '\n';
  };
  for (std::size_t i = 0; i < inflow.time.size(); ++i) row(inflow.time[i], inflow.value[i]);
  if (inflow.constant()) row(1, inflow.value.front());
  return text.str();
}

}  // namespace vstent::flow
