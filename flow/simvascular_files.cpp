#include "flow/simvascular_files.hpp"

#include <charconv>
#include <cmath>
#include <sstream>

#include "vessels/error.hpp"
#include "vessels/file_guard.hpp"

namespace vstent::flow {
namespace {

struct Word {
  std::string text;
  std::size_t line = 0;
};

/// The words of a file, one after the other.
class Words {
 public:
  explicit Words(const std::filesystem::path& path) : file_(path.string()) {
    std::istringstream lines(vessels::read_bytes(path));
    std::string line, word;
    for (std::size_t number = 1; std::getline(lines, line); ++number) {
      std::istringstream stream(line);
      while (stream >> word) words_.push_back({word, number});
    }
  }

  bool done() const { return next_ == words_.size(); }
  bool number_next() const { return !done() && parsed(words_[next_].text).has_value(); }

  std::string text(const std::string& what) { return take(what).text; }

  double number(const std::string& what) {
    const Word word = take(what);
    const std::optional<double> value = parsed(word.text);
    if (!value) fail(word.line, "\"" + word.text + "\" stands where " + what + " must be");
    return *value;
  }

  double not_negative(const std::string& what) {
    const double value = number(what);
    if (value < 0) fail(words_[next_ - 1].line, what + " is negative");
    return value;
  }

  int count(const std::string& what) {
    const double value = number(what);
    if (!(value >= 1 && value <= 1e6 && value == std::floor(value)))
      fail(words_[next_ - 1].line, what + " must be a whole number from 1");
    return static_cast<int>(value);
  }

  [[noreturn]] void fail_here(const std::string& what) const {
    fail(next_ == 0 ? 1 : words_[next_ - 1].line, what);
  }

 private:
  [[noreturn]] void fail(std::size_t line, const std::string& what) const {
    throw Error(ExitCode::input_file, file_ + ": line " + std::to_string(line) + ": " + what);
  }

  static std::optional<double> parsed(const std::string& text) {
    double value = 0;
    const char* end = text.data() + text.size();
    const auto [stopped, fault] = std::from_chars(text.data(), end, value);
    if (fault != std::errc() || stopped != end || !std::isfinite(value)) return std::nullopt;
    return value;
  }

  const Word& take(const std::string& what) {
    if (done()) throw Error(ExitCode::input_file, file_ + ": ends where " + what + " must be");
    return words_[next_++];
  }

  std::string file_;
  std::vector<Word> words_;
  std::size_t next_ = 0;
};

Rcr read_rcr(Words& words, int pairs, UnitSystem units) {
  Rcr rcr;
  rcr.proximal =
      words.not_negative("the proximal resistance") * cgs_per(units, Dimension::resistance);
  rcr.capacitance = words.not_negative("the capacitance") * cgs_per(units, Dimension::compliance);
  rcr.distal = words.not_negative("the distal resistance") * cgs_per(units, Dimension::resistance);
  for (int i = 0; i < pairs; ++i) {
    words.number("a time");
    const double pressure = words.number("a distal pressure") * cgs_per(units, Dimension::pressure);
    if (i > 0 && pressure != rcr.distal_pressure)
      words.fail_here("the distal pressure varies over time; only a constant one can be used");
    rcr.distal_pressure = pressure;
  }
  return rcr;
}

std::vector<std::string> read_names(const std::filesystem::path& path) {
  Words words(path);
  std::vector<std::string> names;
  while (!words.done()) names.push_back(words.text("an outlet's name"));
  return names;
}

}  // namespace

std::vector<NamedCondition> read_rcrt(const std::filesystem::path& path,
                                      const std::filesystem::path& outlets, UnitSystem units) {
  Words words(path);
  const int most = words.count("the largest number of times");
  std::vector<NamedCondition> result;
  while (!words.done()) {
    const int pairs = words.count("a number of times");
    if (pairs > most) words.fail_here("has more times than the first line allows");
    std::string name;
    if (!words.number_next()) name = words.text("an outlet's name");
    result.push_back({name, read_rcr(words, pairs, units)});
  }
  const bool named = !result.empty() && !result.front().name.empty();
  for (const NamedCondition& entry : result) {
    if (entry.name.empty() == named)
      throw Error(ExitCode::input_file,
                  path.string() + ": some blocks have a name and some have none");
  }
  if (named != outlets.empty()) {
    throw Error(
        ExitCode::input_file,
        path.string() + (named ? ": its blocks have names of their own; leave out outlets"
                               : ": its blocks have no names; give outlets.dat as outlets"));
  }
  if (!named) {
    const std::vector<std::string> names = read_names(outlets);
    if (names.size() != result.size()) {
      throw Error(ExitCode::input_file,
                  outlets.string() + ": names " + std::to_string(names.size()) + " outlets, " +
                      path.string() + " has " + std::to_string(result.size()));
    }
    for (std::size_t i = 0; i < names.size(); ++i) result[i].name = names[i];
  }
  return result;
}

std::vector<NamedCondition> read_resistances(const std::filesystem::path& path, UnitSystem units) {
  Words words(path);
  std::vector<NamedCondition> result;
  while (!words.done()) {
    const std::string name = words.text("an outlet's name");
    result.push_back({name, Resistance{words.not_negative("the resistance of " + name) *
                                           cgs_per(units, Dimension::resistance),
                                       0}});
  }
  return result;
}

}  // namespace vstent::flow
