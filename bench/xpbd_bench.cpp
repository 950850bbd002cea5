// What the wall costs: projections per second beside a scalar loop in mesh order, relaxation,
// setup, and a whole expansion until the static residual is small.
#include <benchmark/benchmark.h>
#include <malloc.h>
#include <tbb/global_control.h>

#include <algorithm>
#include <numeric>

#include "tests/xpbd/reference_solver.hpp"
#include "tests/xpbd/shapes.hpp"

namespace {

using vstent::Vec3;
using vstent::tests::Mesh;
using vstent::tests::ReferenceSolver;
using namespace vstent::xpbd;

enum Kind { kDistance, kDihedral, kBoth };

/// A square tube: as many vertices around as along.
Mesh tube(std::int64_t vertices) {
  const double around = std::sqrt(static_cast<double>(vertices));
  return vstent::tests::make_tube({.radius = around / (2 * std::numbers::pi),
                                   .length = around * std::sqrt(3.0) / 2,
                                   .edge = 1,
                                   .jitter = 0.15});
}

Mesh shuffled(const Mesh& mesh) {
  std::vector<int> number(mesh.points.size());
  std::iota(number.begin(), number.end(), 0);
  std::shuffle(number.begin(), number.end(), std::mt19937(1));
  Mesh result = mesh;
  for (std::size_t i = 0; i < number.size(); ++i) {
    result.points[static_cast<std::size_t>(number[i])] = mesh.points[i];
    result.pinned[static_cast<std::size_t>(number[i])] = mesh.pinned[i];
  }
  for (auto& triangle : result.triangles)
    for (int& corner : triangle) corner = number[static_cast<std::size_t>(corner)];
  std::shuffle(result.triangles.begin(), result.triangles.end(), std::mt19937(2));
  return result;
}

/// Under a little strain, so that nothing is at rest.
Sheet sheet_of(const Mesh& mesh, Kind kind) {
  Sheet sheet = make_sheet(mesh.points, mesh.triangles, mesh.pinned, Membrane{});
  if (kind == kDistance) sheet.bendings.clear();
  if (kind == kDihedral) sheet.distances.clear();
  for (auto& d : sheet.distances) d.rest_length *= 0.99;
  for (auto& b : sheet.bendings) b.rest_angle += 0.01;
  scale_masses(sheet, 1, 0.3);
  return sheet;
}

constexpr int kSweeps = 20;

void count_projections(benchmark::State& state, const Sheet& sheet) {
  state.counters["projections/s"] = benchmark::Counter(
      static_cast<double>((sheet.distances.size() + sheet.bendings.size()) * kSweeps),
      benchmark::Counter::kIsIterationInvariantRate);
}

tbb::global_control threads(std::int64_t count) {
  return {tbb::global_control::max_allowed_parallelism, static_cast<std::size_t>(count)};
}

void Scalar(benchmark::State& state) {
  const Sheet sheet = sheet_of(tube(state.range(0)), kBoth);
  ReferenceSolver solver(sheet);
  for (auto _ : state) solver.step({}, {.iterations = kSweeps, .damping = 0.5});
  count_projections(state, sheet);
}
BENCHMARK(Scalar)->Arg(10'000)->Arg(40'000)->Arg(160'000)->Unit(benchmark::kMillisecond);

/// Of the heap.
std::size_t bytes_in_use() {
  const auto info = mallinfo2();
  return info.uordblks + info.hblkhd;
}

void sweep(benchmark::State& state, const Sheet& sheet, Precision precision) {
  const std::size_t before = bytes_in_use();
  Solver solver(sheet);
  const StepOptions options{.iterations = kSweeps, .damping = 0.5, .precision = precision};
  solver.step({}, options);
  state.counters["bytes/vertex"] =
      static_cast<double>(bytes_in_use() - before) / static_cast<double>(sheet.positions.size());
  for (auto _ : state) solver.step({}, options);
  count_projections(state, sheet);
}

/// range: vertices, threads, constraints, precision (0 double, 1 single).
void Batched(benchmark::State& state) {
  const auto limit = threads(state.range(1));
  sweep(state, sheet_of(tube(state.range(0)), static_cast<Kind>(state.range(2))),
        static_cast<Precision>(state.range(3)));
}
BENCHMARK(Batched)
    ->ArgNames({"vertices", "threads", "distance_dihedral_both", "single"})
    ->ArgsProduct({{10'000, 40'000, 160'000}, {1, 2}, {kDistance, kDihedral, kBoth}, {0, 1}})
    ->UseRealTime()
    ->Unit(benchmark::kMillisecond);

void BatchedShuffledNumbering(benchmark::State& state) {
  const auto limit = threads(1);
  sweep(state, sheet_of(shuffled(tube(state.range(0))), kBoth),
        static_cast<Precision>(state.range(1)));
}
BENCHMARK(BatchedShuffledNumbering)
    ->ArgNames({"vertices", "single"})
    ->ArgsProduct({{40'000, 160'000}, {0, 1}})
    ->Unit(benchmark::kMillisecond);

void Relax(benchmark::State& state) {
  const auto limit = threads(state.range(1));
  Solver solver(sheet_of(tube(state.range(0)), kBoth));
  for (auto _ : state) solver.relax({}, {});
}
BENCHMARK(Relax)
    ->ArgNames({"vertices", "threads"})
    ->ArgsProduct({{10'000, 40'000, 160'000}, {1, 2}})
    ->UseRealTime()
    ->Unit(benchmark::kMillisecond);

void Setup(benchmark::State& state) {
  const Sheet sheet = sheet_of(tube(state.range(0)), kBoth);
  for (auto _ : state) Solver solver(sheet);
}
BENCHMARK(Setup)->Arg(40'000)->Arg(160'000)->Unit(benchmark::kMillisecond);

/// A tube of 14k vertices, half closed, opened by a cylinder over 30 mm and relaxed until the
/// unbalanced force is 0.1 % of the contact force.
void Expansion(benchmark::State& state) {
  const auto limit = threads(state.range(0));
  const Mesh mesh = vstent::tests::make_tube(
      {.radius = 5, .length = 52, .edge = 0.35, .narrowing = 0.54, .jitter = 0.15});
  const Sheet sheet = make_sheet(mesh.points, mesh.triangles, mesh.pinned, Membrane{});
  int iterations = 0;
  double relative = 1;
  for (auto _ : state) {
    Solver solver(sheet);
    for (iterations = 0, relative = 1; iterations < 66 || relative > 1e-3; ++iterations) {
      const double radius = 2.3 + 3.2 * std::min(1.0, iterations / 65.0);
      const auto contacts =
          vstent::tests::cylinder_contacts(solver.positions(), mesh.pinned, radius, 15);
      relative = solver.relax(contacts, {}).balance.relative;
      if (iterations > 5000) {
        state.SkipWithError("not settled in 5000 iterations");
        break;
      }
    }
  }
  state.counters["vertices"] = static_cast<double>(mesh.points.size());
  state.counters["iterations"] = iterations;
}
BENCHMARK(Expansion)->ArgName("threads")->Arg(1)->Arg(2)->UseRealTime()->Unit(
    benchmark::kMillisecond);

}  // namespace
