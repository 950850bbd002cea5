#include "vessels/json_object.hpp"

#include <algorithm>
#include <cctype>
#include <fstream>
#include <sstream>

#include "vessels/error.hpp"
#include "vessels/units.hpp"

namespace vstent::vessels {
namespace {

using nlohmann::json;

/// A key as the person wrote it: on the command line the last part of the path is the option's
/// name.
std::string named(const std::string& source, const std::string& key) {
  if (source != kCommandLine) return source + ": " + key;
  const std::string last = key.substr(key.rfind('/') + 1);
  return source + ": " + (last == "surface" ? last : last == "preset" ? "--wall" : "--" + last);
}

[[noreturn]] void fail(const std::string& source, const std::string& key, const std::string& what) {
  throw Error(ExitCode::usage, named(source, key) + ": " + what);
}

std::size_t edit_distance(const std::string& a, const std::string& b) {
  std::vector<std::size_t> row(b.size() + 1);
  for (std::size_t j = 0; j <= b.size(); ++j) row[j] = j;
  for (std::size_t i = 1; i <= a.size(); ++i) {
    std::size_t diagonal = row[0];
    row[0] = i;
    for (std::size_t j = 1; j <= b.size(); ++j) {
      const std::size_t above = row[j];
      row[j] = std::min({above + 1, row[j - 1] + 1, diagonal + (a[i - 1] == b[j - 1] ? 0 : 1)});
      diagonal = above;
    }
  }
  return row.back();
}

/// nlohmann keeps the last of repeated keys; a repeated key is a mistake to point at.
void refuse_repeated_keys(const std::string& text, const std::string& source) {
  std::vector<std::set<std::string>> open_objects;
  const json::parser_callback_t watch = [&](int, json::parse_event_t event, json& parsed) {
    if (event == json::parse_event_t::object_start) open_objects.emplace_back();
    if (event == json::parse_event_t::object_end) open_objects.pop_back();
    if (event == json::parse_event_t::key &&
        !open_objects.back().insert(parsed.get<std::string>()).second) {
      fail(source, parsed.get<std::string>(), "the key appears twice in one object");
    }
    return true;
  };
  const json ignored = json::parse(text, watch);
}

}  // namespace

std::string nearest_word(const std::string& given, const std::vector<std::string>& known) {
  std::string nearest;
  std::size_t best = 4;
  for (const std::string& word : known) {
    const std::size_t distance = edit_distance(given, word);
    if (distance < best) best = distance, nearest = word;
  }
  return nearest;
}

ObjectReader::ObjectReader(const json& object, std::string source, std::string prefix)
    : object_(object), source_(std::move(source)), prefix_(std::move(prefix)) {
  if (!object.is_object())
    fail(source_, prefix_.empty() ? "/" : prefix_, "must be an object { ... }");
}

const json* ObjectReader::find(const std::string& key) {
  known_.insert(key);
  const auto found = object_.find(key);
  return found == object_.end() || found->is_null() ? nullptr : &*found;
}

void ObjectReader::refuse(const std::string& name, const std::string& what) const {
  fail(source_, key(name), what);
}

std::optional<std::string> ObjectReader::text(const std::string& name) {
  const json* value = find(name);
  if (!value) return std::nullopt;
  if (!value->is_string()) refuse(name, "must be text, is " + value->dump());
  return value->get<std::string>();
}

std::optional<bool> ObjectReader::boolean(const std::string& name) {
  const json* value = find(name);
  if (!value) return std::nullopt;
  if (!value->is_boolean()) refuse(name, "must be true or false, is " + value->dump());
  return value->get<bool>();
}

std::optional<double> ObjectReader::length(const std::string& name, bool zero_allowed) {
  const json* value = find(name);
  if (!value) return std::nullopt;
  if (!value->is_string())
    refuse(name, "must be a length with its unit, such as \"11mm\", is " + value->dump());
  const auto given = value->get<std::string>();
  if (!given.empty() && !std::isalpha(static_cast<unsigned char>(given.back()))) {
    refuse(name, "needs a unit (mm, cm or m), is \"" + given + "\"");
  }
  const double millimetres = parse_length(given, LengthUnit::mm, named(source_, key(name)));
  if (!(millimetres > 0) && !(zero_allowed && millimetres == 0)) {
    refuse(name, "must be positive, is " + given);
  }
  return millimetres;
}

std::optional<double> ObjectReader::number(const std::string& name, double low, double high,
                                           const std::string& allowed) {
  const json* value = find(name);
  if (!value) return std::nullopt;
  if (!value->is_number()) refuse(name, "must be a number " + allowed + ", is " + value->dump());
  const double number = value->get<double>();
  if (!(number >= low && number <= high))
    refuse(name, "must be " + allowed + ", is " + value->dump());
  return number;
}

std::optional<int> ObjectReader::integer(const std::string& name, int low, int high) {
  const json* value = find(name);
  if (!value) return std::nullopt;
  const std::string allowed =
      "a whole number from " + std::to_string(low) + " to " + std::to_string(high);
  if (!value->is_number_integer()) refuse(name, "must be " + allowed + ", is " + value->dump());
  const auto number = value->get<std::int64_t>();
  if (number < low || number > high) refuse(name, "must be " + allowed + ", is " + value->dump());
  return static_cast<int>(number);
}

ObjectReader ObjectReader::object(const std::string& name) {
  static const json empty = json::object();
  const json* value = find(name);
  return {value ? *value : empty, source_, key(name)};
}

void ObjectReader::require(bool present, const std::string& name, const std::string& what) const {
  if (!present) refuse(name, "is missing: " + what);
}

void ObjectReader::finish() const {
  for (const auto& [name, value] : object_.items()) {
    if (known_.contains(name)) continue;
    const std::string nearest = nearest_word(name, {known_.begin(), known_.end()});
    refuse(name, "unknown key" +
                     (nearest.empty() ? std::string() : "; did you mean \"" + nearest + "\"?"));
  }
}

json read_json(const std::filesystem::path& path) {
  std::error_code ignored;
  if (std::filesystem::is_directory(path, ignored)) {
    throw Error(ExitCode::usage, path.string() + ": is a folder; give the file in it");
  }
  std::ifstream file(path, std::ios::binary);
  if (!file) throw Error(ExitCode::usage, path.string() + ": cannot be read; is the path right?");
  std::ostringstream text;
  text << file.rdbuf();
  try {
    json parsed = json::parse(text.str());
    refuse_repeated_keys(text.str(), path.string());
    return parsed;
  } catch (const json::parse_error& error) {
    const std::string what = error.what();
    const std::size_t at = what.find("at line");
    throw Error(ExitCode::usage, path.string() + ": not JSON, " +
                                     (at == std::string::npos ? what : what.substr(at)));
  }
}

}  // namespace vstent::vessels
