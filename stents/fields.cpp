#include "stents/fields.hpp"

#include <algorithm>
#include <charconv>

namespace vstent::stents {
namespace {

std::string text(double value) {
  char buffer[40];
  return {buffer, std::to_chars(buffer, buffer + sizeof buffer, value).ptr};
}

struct Describer {
  std::string prefix;
  std::vector<std::pair<std::string, std::string>>& lines;

  void add(const std::string& name, double value, const std::string& unit, Need need) {
    if (value != 0 || need == Need::required) lines.emplace_back(prefix + name, text(value) + unit);
  }
  void length(const std::string& name, double value, Need need) { add(name, value, " mm", need); }
  void count(const std::string& name, int value, Need need) { add(name, value, "", need); }
  void share(const std::string& name, double value, Need need) { add(name, value, "", need); }
  void degrees(const std::string& name, double value, Need need) { add(name, value, " deg", need); }
  void number(const std::string& name, double value, Need need) { add(name, value, "", need); }
  void maybe(const std::string& name, const std::optional<double>& value) {
    if (value) add(name, *value, "", Need::required);
  }
  void flag(const std::string& name, bool value) {
    lines.emplace_back(prefix + name, value ? "yes" : "no");
  }
  template <class Value>
  void choice(const std::string& name, Value value, const Words<Value>& words) {
    const auto found = std::find_if(words.begin(), words.end(),
                                    [&](const auto& word) { return word.second == value; });
    lines.emplace_back(prefix + name, found->first);
  }
  template <class Visit>
  void group(const std::string& name, Visit&& visit) {
    Describer inner{prefix + name + "/", lines};
    visit(inner);
  }
};

}  // namespace

std::vector<std::pair<std::string, std::string>> described(const Specification& specification) {
  std::vector<std::pair<std::string, std::string>> lines;
  Describer describer{"", lines};
  Specification copy = specification;  // fields are visited for writing, too
  visit_fields(describer, copy);
  return lines;
}

}  // namespace vstent::stents
