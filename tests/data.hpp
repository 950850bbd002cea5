// Where the real vessels are; tests that need them skip, saying so, where they are absent.
#pragma once

#include <gtest/gtest.h>

#include <filesystem>
#include <string>

namespace vstent::tests {

inline std::filesystem::path shared_data(const std::string& name) {
  return std::filesystem::path(VSTENT_SHARED_DATA) / name;
}

inline std::filesystem::path shared_reference(const std::string& name) {
  return std::filesystem::path(VSTENT_SHARED_REFERENCE) / name;
}

}  // namespace vstent::tests

/// Skips the running test when `path` (a std::filesystem::path) is not there.
#define SKIP_WITHOUT(path)            \
  if (!std::filesystem::exists(path)) \
  GTEST_SKIP() << "needs " << (path).string() << ", which is absent"
