// Batches, instruction sets and threads change the speed of a result and nothing else.
#include <gtest/gtest.h>
#include <tbb/global_control.h>
#include <tbb/task_arena.h>

#include <cstring>
#include <numeric>

#include "tests/xpbd/reference_solver.hpp"
#include "tests/xpbd/shapes.hpp"
#include "xpbd/kernels.hpp"
#include "xpbd/layout.hpp"

namespace vstent::tests {
namespace {

using xpbd::Layout;
using xpbd::Sheet;
using xpbd::Solver;

std::size_t at(int i) { return static_cast<std::size_t>(i); }

Mesh vessel() { return make_tube({.length = 60, .edge = 0.8, .narrowing = 0.5, .jitter = 0.2}); }

using xpbd::MembraneModel;
constexpr MembraneModel kModels[] = {MembraneModel::springs, MembraneModel::neo_hookean};

Sheet sheet_of(const Mesh& mesh, MembraneModel model = MembraneModel::springs) {
  Sheet sheet =
      xpbd::make_sheet(mesh.points, mesh.triangles, mesh.pinned, xpbd::Membrane{.model = model});
  xpbd::scale_masses(sheet, 1, 0.5);
  return sheet;
}

/// The constraints of a layout's tasks, in the order in which a forward sweep takes them.
template <class Batch, class Add>
void in_order(const std::vector<Batch>& batches, std::size_t first, std::size_t last,
              const Add& add) {
  for (std::size_t k = first; k < last; ++k)
    for (std::size_t lane = 0; lane < xpbd::kLanes; ++lane) add(batches[k], lane);
}

Sheet reordered(const Sheet& sheet) {
  const Layout layout = xpbd::make_layout(sheet);
  Sheet result = sheet;
  result.distances.clear();
  result.bendings.clear();
  result.triangles.clear();
  const auto vertex = [&](int number) { return layout.original[at(number)]; };
  for (const auto* phase : {&layout.within, &layout.between})
    for (const xpbd::Task& task : *phase) {
      in_order(layout.distances, task.first_distance, task.last_distance,
               [&](const auto& b, std::size_t lane) {
                 if (lane > 0 && b.vertex[0][lane] == b.vertex[0][0]) return;
                 result.distances.push_back({vertex(b.vertex[0][lane]), vertex(b.vertex[1][lane]),
                                             b.rest[lane], 1 / b.compliance[lane]});
               });
      in_order(layout.bendings, task.first_bending, task.last_bending,
               [&](const auto& b, std::size_t lane) {
                 if (lane > 0 && b.vertex[0][lane] == b.vertex[0][0]) return;
                 result.bendings.push_back({vertex(b.vertex[0][lane]), vertex(b.vertex[1][lane]),
                                            vertex(b.vertex[2][lane]), vertex(b.vertex[3][lane]),
                                            b.rest[lane], 1 / b.compliance[lane]});
               });
      in_order(layout.triangles, task.first_triangle, task.last_triangle,
               [&](const auto& b, std::size_t lane) {
                 if (lane > 0 && b.vertex[0][lane] == b.vertex[0][0]) return;
                 const std::array<int, 3> corners{vertex(b.vertex[0][lane]),
                                                  vertex(b.vertex[1][lane]),
                                                  vertex(b.vertex[2][lane])};
                 result.triangles.push_back(
                     *std::find_if(sheet.triangles.begin(), sheet.triangles.end(),
                                   [&](const auto& t) { return t.vertices == corners; }));
               });
    }
  return result;
}

class Batches : public ::testing::TestWithParam<MembraneModel> {};
INSTANTIATE_TEST_SUITE_P(Models, Batches, ::testing::ValuesIn(kModels));

TEST_P(Batches, DoWhatOneConstraintAfterAnotherDoes) {
  const Mesh small = make_tube({.length = 16, .edge = 1, .narrowing = 0.3, .jitter = 0.2});
  ASSERT_LT(small.points.size(), 768u);
  Sheet sheet = sheet_of(small, GetParam());
  std::mt19937 random(6);
  for (auto& d : sheet.distances) d.rest_length *= 1 + 0.05 * random_vector(random).x();
  for (auto& b : sheet.bendings) b.rest_angle += 0.1 * random_vector(random).x();
  const Sheet ordered = reordered(sheet);
  Solver solver(sheet);
  ReferenceSolver reference(ordered);
  for (int step = 0; step < 10; ++step) {
    const xpbd::StepOptions options{.iterations = 3, .damping = 0.1};
    solver.step({}, options);
    reference.step({}, options);
  }
  // Rounding differs (sums' order, arcus tangent), 1e-15 a step, and grows by little in ten.
  for (std::size_t i = 0; i < small.points.size(); ++i)
    EXPECT_LT((solver.positions()[i] - reference.positions()[i]).norm(), 1e-11) << i;
}

TEST_P(Batches, RespectTheOrderOfTasks) {
  const Mesh mesh = vessel();
  for (const bool bend : {false, true}) {
    Sheet sheet = sheet_of(mesh, GetParam());
    if (bend) {  // one kind at a time: a task takes all its kinds, the twin kind after kind
      sheet.distances.clear();
      sheet.triangles.clear();
    } else {
      sheet.bendings.clear();
    }
    std::mt19937 random(6);
    for (auto& d : sheet.distances) d.rest_length *= 1 + 0.05 * random_vector(random).x();
    for (auto& b : sheet.bendings) b.rest_angle += 0.05 * random_vector(random).x();
    Solver solver(sheet);
    ReferenceSolver reference(reordered(sheet));
    const auto contacts = cylinder_contacts(mesh.points, mesh.pinned, 2.6, 8);
    solver.step(contacts, {.iterations = 4});
    reference.step(contacts, {.iterations = 4});
    for (std::size_t i = 0; i < mesh.points.size(); ++i)
      ASSERT_LT((solver.positions()[i] - reference.positions()[i]).norm(), 1e-11) << i;
  }
}

TEST(Layout, KeepsTasksOfAPhaseApart) {
  const Mesh mesh = vessel();
  Sheet sheet = sheet_of(mesh);
  sheet.triangles = sheet_of(mesh, MembraneModel::neo_hookean).triangles;
  const Layout layout = xpbd::make_layout(sheet);
  EXPECT_GT(layout.within.size(), 3u);
  for (const auto* phase : {&layout.within, &layout.between}) {
    std::vector<int> owner(mesh.points.size(), -1);
    for (std::size_t t = 0; t < phase->size(); ++t) {
      const auto claim = [&](int v) {
        EXPECT_TRUE(owner[at(v)] < 0 || owner[at(v)] == static_cast<int>(t));
        owner[at(v)] = static_cast<int>(t);
      };
      const xpbd::Task& task = (*phase)[t];
      for (std::size_t k = task.first_distance; k < task.last_distance; ++k)
        for (std::size_t lane = 0; lane < xpbd::kLanes; ++lane) {
          claim(layout.distances[k].vertex[0][lane]);
          claim(layout.distances[k].vertex[1][lane]);
        }
      for (std::size_t k = task.first_triangle; k < task.last_triangle; ++k)
        for (const auto& corner : layout.triangles[k].vertex)
          for (int v : corner) claim(v);
      for (std::size_t k = task.first_bending; k < task.last_bending; ++k)
        for (const auto& corner : layout.bendings[k].vertex)
          for (int v : corner) claim(v);
    }
  }
}

TEST(Layout, TakesMoreThanSixtyFourConstraintsAtAVertex) {
  Sheet sheet;
  for (int i = 0; i <= 300; ++i) {
    sheet.positions.push_back({std::cos(i), std::sin(i), i == 0 ? 1.0 : 0.0});
    sheet.inverse_mass.push_back(1);
    if (i > 0) sheet.distances.push_back({0, i, 1.0, 1.0});
  }
  EXPECT_EQ(reordered(sheet).distances.size(), 300u);
}

enum class Way { kRelax, kStep, kStepInSingle };

std::vector<Vec3> deployed(const Sheet& sheet, const Mesh& mesh, Way way) {
  Solver solver(sheet);
  double relative = 0;
  for (int step = 0; step < 40; ++step) {
    const auto contacts = cylinder_contacts(solver.positions(), mesh.pinned, 2.5 + 0.03 * step, 12);
    if (way == Way::kRelax) {
      relative = solver.relax(contacts, {}).balance.relative;
      continue;
    }
    solver.step(contacts, {.iterations = 2,
                           .velocity_limit = 0.1,
                           .adaptive_damping = true,
                           .precision = way == Way::kStep ? xpbd::Precision::kDouble
                                                          : xpbd::Precision::kSingle});
    relative = solver.balance(contacts, 1e-3).relative;
  }
  std::vector<Vec3> result(solver.positions().begin(), solver.positions().end());
  result.push_back(Vec3::Constant(relative));
  return result;
}

TEST(Threads, GiveTheSameBits) {
  const Mesh mesh = vessel();
  for (const auto& [model, way] : {std::pair{MembraneModel::springs, Way::kRelax},
                                   std::pair{MembraneModel::springs, Way::kStep},
                                   std::pair{MembraneModel::springs, Way::kStepInSingle},
                                   std::pair{MembraneModel::neo_hookean, Way::kRelax},
                                   std::pair{MembraneModel::neo_hookean, Way::kStep}}) {
    const Sheet sheet = sheet_of(mesh, model);
    std::vector<Vec3> first;
    for (int threads : {1, 2, 3, 8}) {
      tbb::global_control limit(tbb::global_control::max_allowed_parallelism,
                                static_cast<std::size_t>(threads));
      tbb::task_arena arena(threads);
      const auto result = arena.execute([&] { return deployed(sheet, mesh, way); });
      if (first.empty()) first = result;
      EXPECT_EQ(std::memcmp(first.data(), result.data(), first.size() * sizeof(Vec3)), 0)
          << threads;
    }
  }
}

TEST(SinglePrecision, MovesAsDouble) {
  const Mesh mesh = vessel();
  const Sheet sheet = sheet_of(mesh);
  const auto in_double = deployed(sheet, mesh, Way::kStep);
  const auto in_single = deployed(sheet, mesh, Way::kStepInSingle);
  double largest = 0;
  for (std::size_t i = 0; i < mesh.points.size(); ++i)
    largest = std::max(largest, (in_single[i] - in_double[i]).norm());
  // 80 sweeps of about 25 projections of a particle, each rounded by at most 1e-6 mm within 32 mm
  // of the middle: 2,000 roundings add up to 5e-5 mm where they are random.
  EXPECT_LT(largest, 1e-4);
  EXPECT_GT(largest, 1e-8);
  EXPECT_NEAR(in_single.back().x(), in_double.back().x(), 1e-4);
}

TEST(SinglePrecision, IsRefusedForTriangles) {
  const Sheet sheet = sheet_of(vessel(), MembraneModel::neo_hookean);
  Solver solver(sheet);
  EXPECT_THROW(solver.step({}, {.precision = xpbd::Precision::kSingle}), std::invalid_argument);
}

TEST(SinglePrecision, DoesNotDependOnWhereTheSheetLies) {
  // Places are counted from the sheet's middle: a metre away, only the rounding of doubles differs,
  // 1e-13 mm a step before it is rounded to single.
  const Mesh mesh = make_tube({.length = 16, .edge = 1, .narrowing = 0.3, .jitter = 0.2});
  const Vec3 far(1000, -1000, 1000);
  const auto stepped = [&](const Vec3& by) {
    Sheet sheet = sheet_of(mesh);
    for (Vec3& p : sheet.positions) p += by;
    for (auto& d : sheet.distances) d.rest_length *= 0.97;
    Solver solver(sheet);
    for (int n = 0; n < 10; ++n)
      solver.step({}, {.iterations = 4, .precision = xpbd::Precision::kSingle});
    return std::vector<Vec3>(solver.positions().begin(), solver.positions().end());
  };
  const auto near = stepped(Vec3::Zero()), away = stepped(far);
  for (std::size_t i = 0; i < near.size(); ++i) EXPECT_LT((away[i] - far - near[i]).norm(), 2e-5);
}

/// Both instruction sets from the same places: projections there and back, then the kept forces.
template <class Real>
void compare_steps(const xpbd::StepKernels<Real>& narrow, const xpbd::StepKernels<Real>& wide,
                   xpbd::BatchesOf<Real> a, std::vector<xpbd::SlotOf<Real>> places) {
  xpbd::BatchesOf<Real> b = a;
  std::vector<xpbd::SlotOf<Real>> others = places, force_a(places.size()), force_b(places.size());
  const auto run = [](const xpbd::StepKernels<Real>& kernel, xpbd::BatchesOf<Real>& batches,
                      auto& particles, auto& forces) {
    for (const bool backward : {false, true}) {
      kernel.project_distances(batches.distances, particles.data(), backward);
      kernel.project_bendings(batches.bendings, particles.data(), backward);
    }
    kernel.kept_distance_forces(batches.distances, particles.data(), forces.data());
    kernel.kept_bending_forces(batches.bendings, particles.data(), forces.data());
  };
  run(narrow, a, places, force_a);
  run(wide, b, others, force_b);
  const std::size_t bytes = places.size() * sizeof places[0];
  EXPECT_EQ(std::memcmp(places.data(), others.data(), bytes), 0);
  EXPECT_EQ(std::memcmp(force_a.data(), force_b.data(), bytes), 0);
}

class InstructionSets : public testing::TestWithParam<const xpbd::Kernels* (*)()> {};

TEST_P(InstructionSets, GiveTheSameBits) {
  const xpbd::Kernels* wide = GetParam()();
  if (!wide) GTEST_SKIP() << "this machine does not have it";
  const xpbd::Kernels& narrow = xpbd::baseline_kernels();
  const Mesh mesh = vessel();
  Sheet both = sheet_of(mesh);
  both.triangles = sheet_of(mesh, MembraneModel::neo_hookean).triangles;
  const Layout layout = xpbd::make_layout(both);
  std::mt19937 random(9);
  std::vector<xpbd::Slot> places(mesh.points.size()), force_a(places.size()),
      force_b(places.size());
  std::vector<xpbd::SlotOf<float>> single(places.size());
  for (std::size_t k = 0; k < places.size(); ++k) {
    const Vec3 p = mesh.points[at(layout.original[k])] + 0.1 * random_vector(random);
    const Eigen::Vector3f f = p.cast<float>();
    places[k] = {p.x(), p.y(), p.z(), 0.3};
    single[k] = {f.x(), f.y(), f.z(), 0.3f};
  }
  compare_steps<double>(narrow.step, wide->step, layout, places);
  compare_steps<float>(narrow.step_in_single, wide->step_in_single,
                       xpbd::in_single_precision(layout), single);
  Layout a = layout, b = layout;
  std::vector<xpbd::Slot> others = places;
  for (const bool backward : {false, true}) {
    narrow.project_triangles(a.triangles, places.data(), backward);
    wide->project_triangles(b.triangles, others.data(), backward);
  }
  narrow.kept_triangle_forces(a.triangles, places.data(), force_a.data());
  wide->kept_triangle_forces(b.triangles, others.data(), force_b.data());
  EXPECT_EQ(std::memcmp(places.data(), others.data(), places.size() * sizeof(xpbd::Slot)), 0);
  EXPECT_EQ(std::memcmp(force_a.data(), force_b.data(), force_a.size() * sizeof(xpbd::Slot)), 0);
  const auto fold_a = narrow.elastic_bending_forces(layout.bendings, places.data(), force_a.data());
  const auto fold_b = wide->elastic_bending_forces(layout.bendings, places.data(), force_b.data());
  EXPECT_EQ(fold_a.energy, fold_b.energy);
  const auto stretch_a =
      narrow.elastic_distance_forces(layout.distances, places.data(), force_a.data());
  const auto stretch_b =
      wide->elastic_distance_forces(layout.distances, places.data(), force_b.data());
  EXPECT_EQ(stretch_a.energy, stretch_b.energy);
  const auto strain_a = narrow.elastic_triangle_forces(a.triangles, places.data(), force_a.data());
  const auto strain_b = wide->elastic_triangle_forces(b.triangles, others.data(), force_b.data());
  EXPECT_EQ(strain_a.energy, strain_b.energy);
  EXPECT_EQ(std::memcmp(force_a.data(), force_b.data(), force_a.size() * sizeof(xpbd::Slot)), 0);
}

INSTANTIATE_TEST_SUITE_P(Wide, InstructionSets,
                         testing::Values(xpbd::avx2_kernels, xpbd::avx512_kernels),
                         [](const auto& set) { return set.index == 0 ? "AVX2" : "AVX512"; });

class Balance : public ::testing::TestWithParam<MembraneModel> {};
INSTANTIATE_TEST_SUITE_P(Models, Balance, ::testing::ValuesIn(kModels));

TEST_P(Balance, AgreesWithTheGradientOfTheEnergy) {
  // Central differences of the energy at a few vertices.
  const Mesh mesh = make_tube({.length = 16, .edge = 1, .jitter = 0.2});
  Sheet sheet = sheet_of(mesh, GetParam());
  for (double& w : sheet.inverse_mass) w = 0;
  std::mt19937 random(11);
  auto places = mesh.points;
  for (Vec3& p : places) p += 0.05 * random_vector(random);
  for (std::size_t vertex : {40u, 77u, 150u}) {
    sheet.inverse_mass[vertex] = 1;
    Solver solver(sheet);
    Vec3 force;
    for (int axis = 0; axis < 3; ++axis) {
      double energy[2];
      for (int side : {0, 1}) {
        auto moved = places;
        moved[vertex][axis] += side == 0 ? -1e-5 : 1e-5;
        solver.set_positions(moved);
        energy[side] = solver.balance({}, 0).energy;
      }
      force[axis] = -(energy[1] - energy[0]) / 2e-5;
    }
    solver.set_positions(places);
    const auto balance = solver.balance({}, 0);
    EXPECT_NEAR(balance.residual_max, force.norm(), 1e-7 * (1 + force.norm()));
    EXPECT_EQ(balance.worst_vertex, static_cast<int>(vertex));
    // A contact against the force takes it; one along it does not.
    const std::vector<xpbd::Contact> against{{static_cast<int>(vertex), -force.normalized(),
                                              -force.normalized().dot(places[vertex]), 0}};
    const auto held = solver.balance(against, 1e-9);
    EXPECT_LT(held.residual_max, 1e-6 * (1 + force.norm()));
    EXPECT_NEAR(held.contact_force_sum, force.norm(), 1e-6 * (1 + force.norm()));
    const std::vector<xpbd::Contact> along{
        {static_cast<int>(vertex), force.normalized(), force.normalized().dot(places[vertex]), 0}};
    EXPECT_EQ(solver.balance(along, 1e-9).in_contact, 0);
    sheet.inverse_mass[vertex] = 0;
  }
}

}  // namespace
}  // namespace vstent::tests
