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

/// A layout's constraints in the order in which a forward sweep takes them.
struct Ordered {
  Sheet sheet;
  std::vector<Turn> turns;
};

Ordered ordered(const Sheet& sheet) {
  const Layout layout = xpbd::make_layout(sheet);
  Ordered made{sheet, {}};
  made.sheet.distances.clear();
  made.sheet.bendings.clear();
  made.sheet.triangles.clear();
  const auto vertex = [&](const auto& batch, std::size_t k, std::size_t lane) {
    return layout.original[at(batch.vertex[k][lane])];
  };
  const auto add_turn = [&](Turn::Kind kind) {
    const Sheet& s = made.sheet;
    made.turns.push_back({kind,
                          kind == Turn::kTriangle  ? s.triangles.size()
                          : kind == Turn::kBending ? s.bendings.size()
                                                   : s.distances.size(),
                          s.bendings.size()});
  };
  const auto add_distance = [&](const auto& b, std::size_t lane) {
    made.sheet.distances.push_back({vertex(b, 0, lane), vertex(b, 1, lane), b.length.rest[lane],
                                    xpbd::stiffness_of(b.length, lane)});
  };
  const auto add_bending = [&](const auto& b, std::size_t lane) {
    made.sheet.bendings.push_back({vertex(b, 0, lane), vertex(b, 1, lane), vertex(b, 2, lane),
                                   vertex(b, 3, lane), b.fold.rest[lane],
                                   xpbd::stiffness_of(b.fold, lane)});
  };
  const auto add_triangle = [&](const xpbd::TriangleBatch& b, std::size_t lane) {
    const std::array<int, 3> corners{vertex(b, 0, lane), vertex(b, 1, lane), vertex(b, 2, lane)};
    made.sheet.triangles.push_back(
        *std::find_if(sheet.triangles.begin(), sheet.triangles.end(),
                      [&](const auto& t) { return t.vertices == corners; }));
  };
  for (const auto* phase : {&layout.within, &layout.between})
    for (const xpbd::Task& task : *phase) {
      const xpbd::ConstBatches batches = xpbd::batches_of(layout, task);
      xpbd::for_each_lane(batches.distances, [&](const auto& b, std::size_t lane) {
        add_turn(Turn::kDistance);
        add_distance(b, lane);
      });
      xpbd::for_each_lane(batches.hinged_edges, [&](const auto& b, std::size_t lane) {
        add_turn(Turn::kHingedEdge);
        add_distance(b, lane);
        add_bending(b, lane);
      });
      xpbd::for_each_lane(batches.triangles, [&](const auto& b, std::size_t lane) {
        add_turn(Turn::kTriangle);
        add_triangle(b, lane);
      });
      xpbd::for_each_lane(batches.bendings, [&](const auto& b, std::size_t lane) {
        add_turn(Turn::kBending);
        add_bending(b, lane);
      });
    }
  return made;
}

class Batches : public ::testing::TestWithParam<MembraneModel> {};
INSTANTIATE_TEST_SUITE_P(Models, Batches, ::testing::ValuesIn(kModels));

/// Against the twin, for sheets of which something is pulled out of shape.
void expect_same_steps(const Sheet& sheet, std::span<const xpbd::Contact> contacts,
                       const xpbd::StepOptions& options, int steps) {
  const Ordered twin = ordered(sheet);
  Solver solver(sheet);
  ReferenceSolver reference(twin.sheet, true, twin.turns);
  for (int step = 0; step < steps; ++step) {
    solver.step(contacts, options);
    reference.step(contacts, options);
  }
  const std::span<const Vec3> positions = solver.positions();
  // Rounding differs (sums' order, arcus tangent), 1e-15 a step, and grows by little in ten. Where
  // it makes a kept force fall to the other of two numbers of single precision, a particle moves by
  // 6e-8 of what that force moves it by in a step, 0.01 mm.
  for (std::size_t i = 0; i < positions.size(); ++i)
    EXPECT_LT((positions[i] - reference.positions()[i]).norm(), 1e-9) << i;
}

Sheet pulled(Sheet sheet) {
  std::mt19937 random(6);
  for (auto& d : sheet.distances) d.rest_length *= 1 + 0.05 * random_vector(random).x();
  for (auto& b : sheet.bendings) b.rest_angle += 0.05 * random_vector(random).x();
  return sheet;
}

TEST_P(Batches, DoWhatOneConstraintAfterAnotherDoes) {
  const Mesh small = make_tube({.length = 16, .edge = 1, .narrowing = 0.3, .jitter = 0.2});
  ASSERT_LT(small.points.size(), 768u);
  expect_same_steps(pulled(sheet_of(small, GetParam())), {}, {.iterations = 3, .damping = 0.1}, 10);
}

TEST_P(Batches, RespectTheOrderOfTasks) {
  const Mesh mesh = vessel();
  const auto contacts = cylinder_contacts(mesh.points, mesh.pinned, 2.6, 8);
  expect_same_steps(pulled(sheet_of(mesh, GetParam())), contacts, {.iterations = 4}, 1);
}

TEST_P(Batches, TakeEveryKindAlone) {
  const Mesh mesh = vessel();
  Sheet unbending = pulled(sheet_of(mesh, GetParam())), unstretching = unbending;
  unbending.bendings.clear();
  unstretching.distances.clear();
  unstretching.triangles.clear();
  expect_same_steps(unbending, {}, {.iterations = 4}, 2);
  expect_same_steps(unstretching, {}, {.iterations = 4}, 2);
}

/// visit(batch) for every batch of every kind.
template <class Visit>
void for_each_batch(const xpbd::ConstBatches& batches, const Visit& visit) {
  for (const auto& batch : batches.distances) visit(batch);
  for (const auto& batch : batches.hinged_edges) visit(batch);
  for (const auto& batch : batches.triangles) visit(batch);
  for (const auto& batch : batches.bendings) visit(batch);
}

class LayoutOf : public ::testing::TestWithParam<MembraneModel> {
 protected:
  Mesh mesh = vessel();
  Layout layout = xpbd::make_layout(sheet_of(mesh, GetParam()));
};
INSTANTIATE_TEST_SUITE_P(Models, LayoutOf, ::testing::ValuesIn(kModels));

TEST_P(LayoutOf, KeepsTasksOfAPhaseApart) {
  EXPECT_GT(layout.within.size(), 3u);
  for (const auto* phase : {&layout.within, &layout.between}) {
    std::vector<int> owner(mesh.points.size(), -1);
    for (std::size_t t = 0; t < phase->size(); ++t)
      for_each_batch(xpbd::batches_of(std::as_const(layout), (*phase)[t]), [&](const auto& batch) {
        for (const auto& corner : batch.vertex)
          for (const int v : corner) {
            EXPECT_TRUE(owner[at(v)] < 0 || owner[at(v)] == static_cast<int>(t));
            owner[at(v)] = static_cast<int>(t);
          }
      });
  }
}

TEST_P(LayoutOf, FillsItsBatchesWithVerticesThatDiffer) {
  std::size_t lanes = 0, taken = 0;
  for_each_batch(xpbd::all_of(layout), [&](const auto& batch) {
    std::vector<int> vertices;
    std::size_t count = 0;
    xpbd::for_each_lane(std::span(&batch, 1), [&](const auto& b, std::size_t lane) {
      for (const auto& corner : b.vertex) vertices.push_back(corner[lane]);
      ++count;
    });
    std::sort(vertices.begin(), vertices.end());
    EXPECT_EQ(std::adjacent_find(vertices.begin(), vertices.end()), vertices.end());
    lanes += xpbd::kLanes;
    taken += count;
  });
  // Of each kind a task leaves one batch short, or a few where their vertices meet.
  EXPECT_GT(static_cast<double>(taken), 0.9 * static_cast<double>(lanes));
}

TEST_P(LayoutOf, HoldsEveryConstraintOnce) {
  const Sheet sheet = sheet_of(mesh, GetParam());
  const Ordered all = ordered(sheet);
  const auto sorted = [](const auto& constraints, const auto& vertices) {
    std::vector<decltype(vertices(constraints[0]))> result;
    for (const auto& c : constraints) {
      result.push_back(vertices(c));
      std::sort(result.back().begin(), result.back().end());
    }
    std::sort(result.begin(), result.end());
    return result;
  };
  const auto ends = [](const auto& d) { return std::array{d.i, d.j}; };
  const auto hinge = [](const auto& b) {
    return std::array{b.edge_a, b.edge_b, b.wing_a, b.wing_b};
  };
  const auto corners = [](const auto& t) { return t.vertices; };
  EXPECT_EQ(sorted(sheet.distances, ends), sorted(all.sheet.distances, ends));
  EXPECT_EQ(sorted(sheet.bendings, hinge), sorted(all.sheet.bendings, hinge));
  EXPECT_EQ(sorted(sheet.triangles, corners), sorted(all.sheet.triangles, corners));
}

TEST(Layout, TakesMoreThanSixtyFourConstraintsAtAVertex) {
  Sheet sheet;
  for (int i = 0; i <= 300; ++i) {
    sheet.positions.push_back({std::cos(i), std::sin(i), i == 0 ? 1.0 : 0.0});
    sheet.inverse_mass.push_back(1);
    if (i > 0) sheet.distances.push_back({0, i, 1.0, 1.0});
  }
  EXPECT_EQ(ordered(sheet).sheet.distances.size(), 300u);
}

TEST(Layout, RefusesAStiffnessBeyondSinglePrecision) {
  Sheet sheet;
  sheet.positions = {{0, 0, 0}, {1, 0, 0}};
  sheet.inverse_mass = {1, 1};
  for (const double stiffness : {1e-39, 1e39}) {
    sheet.distances = {{0, 1, 1.0, stiffness}};
    EXPECT_THROW(xpbd::make_layout(sheet), std::invalid_argument) << stiffness;
  }
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
                   const Layout& layout, std::vector<xpbd::SlotOf<Real>> places) {
  Layout a = layout, b = layout;
  std::vector<xpbd::SlotOf<Real>> others = places, force_a(places.size()), force_b(places.size());
  const auto run = [](const xpbd::StepKernels<Real>& kernel, Layout& all, auto& particles,
                      auto& forces) {
    for (const bool backward : {false, true})
      kernel.project({all.distances, all.hinged_edges, all.triangles, all.bendings},
                     particles.data(), backward);
    kernel.add_kept_forces(xpbd::all_of(all), particles.data(), forces.data());
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
  Sheet all = sheet_of(mesh);
  all.triangles = sheet_of(mesh, MembraneModel::neo_hookean).triangles;
  Sheet alone = all;  // distances and bendings that are not of the same edges
  alone.distances.resize(alone.distances.size() / 2);
  for (const Sheet& sheet : {all, alone}) {
    const Layout layout = xpbd::make_layout(sheet);
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
    compare_steps<float>(narrow.step_in_single, wide->step_in_single, layout, single);
    const xpbd::ConstBatches batches = xpbd::all_of(layout);
    const auto tally_a = narrow.add_elastic_forces(batches, places.data(), force_a.data());
    const auto tally_b = wide->add_elastic_forces(batches, places.data(), force_b.data());
    EXPECT_EQ(tally_a.energy, tally_b.energy);
    EXPECT_EQ(tally_a.carried, tally_b.carried);
    EXPECT_EQ(static_cast<std::size_t>(tally_a.carried),
              sheet.distances.size() + sheet.triangles.size() + sheet.bendings.size());
    EXPECT_EQ(std::memcmp(force_a.data(), force_b.data(), force_a.size() * sizeof(xpbd::Slot)), 0);
  }
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
