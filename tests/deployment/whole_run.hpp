// A deployment from case to written and measured results.
#pragma once

#include <nlohmann/json.hpp>

#include "deployment/deploy.hpp"
#include "deployment/results.hpp"
#include "tests/temporary_folder.hpp"

namespace vstent::tests {

struct WholeRun {
  deployment::Setup setup;
  deployment::Outcome outcome;
  deployment::Metrics metrics;
};

inline deployment::Case make_case(const std::filesystem::path& surface, const std::string& units,
                                  const nlohmann::json& stent) {
  const nlohmann::json specification = {
      {"vessel", {{"surface", surface.string()}, {"units", units}}}, {"stent", stent}};
  return deployment::parse_case(specification, "test", "/");
}

inline WholeRun run(const TemporaryFolder& folder, const deployment::Case& specification) {
  WholeRun r;
  r.setup = deployment::prepare(specification);
  r.outcome = deployment::deploy(r.setup);
  r.metrics = deployment::write_results(r.setup, r.outcome, folder.path());
  return r;
}

}  // namespace vstent::tests
