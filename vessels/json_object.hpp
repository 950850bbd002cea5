// Strict reading of JSON objects that people write: every mistake is named with its file and key.
#pragma once

#include <filesystem>
#include <nlohmann/json.hpp>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

namespace vstent::vessels {

/// The source of an object that came as options; errors then name the option instead of the key.
inline constexpr const char* kCommandLine = "command line";

/// Reads one JSON object key by key, and at the end refuses the keys nobody asked for, naming the
/// nearest known one. The object must outlive its reader. \throws Error (usage)
/// `<source>: /<key>: what is wrong, what is allowed`
class ObjectReader {
 public:
  ObjectReader(const nlohmann::json& object, std::string source, std::string prefix);

  const nlohmann::json* find(const std::string& key);  ///< null where absent or null
  std::string key(const std::string& name) const { return prefix_ + "/" + name; }
  [[noreturn]] void refuse(const std::string& name, const std::string& what) const;

  std::optional<std::string> text(const std::string& name);
  std::optional<bool> boolean(const std::string& name);
  /// A positive length with its unit, such as "11mm"; in mm.
  std::optional<double> length(const std::string& name, bool zero_allowed = false);
  std::optional<double> number(const std::string& name, double low, double high,
                               const std::string& allowed);
  std::optional<int> integer(const std::string& name, int low, int high);
  ObjectReader object(const std::string& name);  ///< an empty one where absent
  template <class Value>
  std::optional<Value> choice(const std::string& name,
                              const std::vector<std::pair<std::string, Value>>& choices);

  void require(bool present, const std::string& name, const std::string& what) const;
  void finish() const;

 private:
  const nlohmann::json& object_;
  std::string source_, prefix_;
  std::set<std::string> known_;
};

/// The whole file as JSON.
/// \throws Error (usage) what cannot be read, is no JSON (line and column) or repeats a key
nlohmann::json read_json(const std::filesystem::path& path);

/// Of `known`, the word most like `given`, or nothing where none is near.
std::string nearest_word(const std::string& given, const std::vector<std::string>& known);

template <class Value>
std::optional<Value> ObjectReader::choice(
    const std::string& name, const std::vector<std::pair<std::string, Value>>& choices) {
  const auto given = text(name);
  if (!given) return std::nullopt;
  std::string allowed;
  for (const auto& [word, value] : choices) {
    if (word == *given) return value;
    allowed += (allowed.empty() ? "" : ", ") + word;
  }
  refuse(name, "must be one of " + allowed + ", is \"" + *given + "\"");
}

}  // namespace vstent::vessels
