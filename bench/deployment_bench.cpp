// What a whole deployment costs once the case is prepared: a coarctation where the shared vessels
// are at hand, and one ideal vessel cut ever more finely.
#include <benchmark/benchmark.h>
#include <tbb/global_control.h>

#include "tests/data.hpp"
#include "tests/deployment/whole_run.hpp"
#include "vessels/idealised.hpp"
#include "vessels/surface.hpp"

namespace {

using namespace vstent;

void deploy_prepared(benchmark::State& state, const deployment::Setup& setup) {
  const tbb::global_control limit(tbb::global_control::max_allowed_parallelism,
                                  static_cast<std::size_t>(state.range(0)));
  deployment::Outcome outcome;
  for (auto _ : state) outcome = deployment::deploy(setup);
  if (!outcome.converged) return state.SkipWithError("did not converge");
  const auto vertices = static_cast<double>(setup.region.vertices.size());
  state.counters["vertices"] = vertices;
  state.counters["residual"] = outcome.history.back().residual;
  state.counters["time_per_vertex"] = benchmark::Counter(
      vertices, benchmark::Counter::kIsIterationInvariantRate | benchmark::Counter::kInvert);
}

/// A coarctation of 31,000 vertices, 11 mm x 30 mm; argument: threads.
void coarctation(benchmark::State& state) {
  const auto surface = tests::shared_data("coa_patient1/wall_aorta.stl");
  if (!std::filesystem::exists(surface)) return state.SkipWithError("needs ../shared/data");
  static const deployment::Setup setup = deployment::prepare(tests::make_case(
      surface, "mm", {{"at", {0.36, 0.16, -3.78}}, {"length", "30mm"}, {"diameter", "11mm"}}));
  deploy_prepared(state, setup);
}
BENCHMARK(coarctation)->Arg(1)->Arg(2)->Unit(benchmark::kMillisecond)->UseRealTime();

/// A tube of radius 5 mm, half closed, opened to its own diameter; arguments: threads, thousands of
/// vertices.
void ideal_vessel(benchmark::State& state) {
  vessels::IdealisedVessel vessel;
  const double area = 2 * std::numbers::pi * vessel.radius * vessel.length;
  vessel.edge_length =
      std::sqrt(2 / std::sqrt(3.0) * area / (1e3 * static_cast<double>(state.range(1))));
  const tests::TemporaryFolder folder;
  const vessels::Surface surface =
      vessels::make_surface(vessels::idealised_vessel(vessel), "ideal");
  vessels::write_surface(surface, surface.mesh.points,
                         std::vector<char>(surface.mesh.points.size(), 0), folder / "vessel.vtp");
  const deployment::Setup setup = deployment::prepare(tests::make_case(
      folder / "vessel.vtp", "mm", {{"at", {0, 0, 30}}, {"length", "24mm"}, {"diameter", "10mm"}}));
  deploy_prepared(state, setup);
}
BENCHMARK(ideal_vessel)
    ->ArgsProduct({{2}, {20, 65, 200}})
    ->Iterations(1)
    ->Unit(benchmark::kMillisecond)
    ->UseRealTime();

}  // namespace
