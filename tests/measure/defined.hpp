// Is every figure of a metrics.json defined, and every definition met?
#pragma once

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>
#include <set>

#include "measure/definitions.hpp"

namespace vstent::tests {

/// Pointers of all scalars, nulls among them; empty lists and objects hold none.
inline void scalars_of(const nlohmann::ordered_json& json, const std::string& path,
                       std::vector<std::string>& found) {
  if (!json.is_structured()) return found.push_back(path);
  std::size_t index = 0;
  for (const auto& [key, value] : json.items()) {
    std::string name = json.is_array() ? std::to_string(index++) : key;
    // As JSON pointers write them.
    for (std::size_t at = 0; (at = name.find('/', at)) != std::string::npos; at += 2)
      name.replace(at, 1, "~1");
    scalars_of(value, path + "/" + name, found);
  }
}

/// Keys of the definitions that `metrics` holds a figure of; every figure must have one.
inline std::set<std::string> defined_in(const nlohmann::ordered_json& metrics) {
  std::vector<std::string> pointers;
  scalars_of(metrics, "", pointers);
  std::set<std::string> keys;
  for (const std::string& pointer : pointers) {
    const measure::Definition* definition = measure::find_definition(pointer);
    if (!definition) {
      // A section or a station's end that is not there is null as a whole.
      const bool whole = pointer.ends_with("/before") || pointer.ends_with("/after");
      EXPECT_TRUE(whole && metrics.at(nlohmann::ordered_json::json_pointer(pointer)).is_null())
          << pointer << " is not defined";
      continue;
    }
    keys.insert(std::string(definition->key));
    const auto& value = metrics.at(nlohmann::ordered_json::json_pointer(pointer));
    EXPECT_FALSE(value.is_null() && definition->absent.empty())
        << pointer << " is null, which its definition does not say";
  }
  return keys;
}

/// Definitions that are not met must say when they may be absent.
inline void expect_absences_stated(const std::set<std::string>& met) {
  for (const measure::Definition& d : measure::definitions()) {
    EXPECT_TRUE(met.contains(std::string(d.key)) || !d.absent.empty()) << d.key << " is missing";
  }
}

}  // namespace vstent::tests
