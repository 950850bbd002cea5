// Random vessels, stents and walls, sensible or not: each run ends in a sound result or in one
// clear line that says why not.
#include <gtest/gtest.h>

#include <chrono>
#include <cstdlib>
#include <iomanip>
#include <iostream>
#include <map>

#include "stents/catalogue.hpp"
#include "tests/abuse/damage.hpp"
#include "tests/deployment/whole_run.hpp"
#include "vessels/error.hpp"

namespace vstent::deployment {
namespace {

using nlohmann::json;
using tests::Dice;
using tests::TemporaryFolder;

json random_tube(const vessels::IdealisedVessel& vessel, Dice& dice) {
  const double diameter = 2 * vessel.radius * dice.uniform(0.6, 2);
  const double length = vessel.length * dice.uniform(0.1, 0.6);
  json stent = {{"diameter", length_text(diameter)}, {"length", length_text(length)}};
  if (dice.chance(0.05)) stent["diameter"] = "auto";
  stent["shape"] =
      dice.one_of<std::string>({"tube", "tube", "tube", "capsule", "capsule", "paper"});
  if (dice.chance(0.4)) {
    stent["cell"] = "closed";
    if (dice.chance(0.7)) stent["straightening"] = dice.uniform(0, 1);
  }
  if (dice.chance(0.2)) stent["distal_diameter"] = length_text(diameter * dice.uniform(0.7, 1.2));
  if (dice.chance(0.2)) {
    stent["flare"] = {{"diameter", length_text(diameter * dice.uniform(0.9, 1.4))},
                      {"length", length_text(length * dice.uniform(0.05, 0.5))}};
  }
  return stent;
}

/// As few rings as make a stent that can be opened to about its own diameter.
json random_struts(const stents::Specification& design, Dice& dice) {
  return {{"design", design.name},
          {"diameter", length_text(design.nominal_diameter * dice.uniform(0.7, 1.2))},
          {"length", length_text(design.nominal_diameter * dice.uniform(0.5, 2.5))}};
}

json random_wall(double radius, Dice& dice) {
  json wall = {
      {"preset", dice.one_of<std::string>({"elastic", "elastic", "elastic", "paper", "aorta",
                                           "pulmonary", "coronary", "carotid", "iliofemoral"})}};
  if (dice.chance(0.2)) wall["tissue_support_MPa_per_mm"] = dice.over_decades(1e-4, 10);
  if (wall["preset"] == "paper") return wall;
  if (dice.chance(0.7)) wall["youngs_modulus_MPa"] = dice.over_decades(1e-3, 1e3);
  if (dice.chance(0.7)) wall["thickness"] = length_text(radius * dice.over_decades(0.01, 1));
  if (dice.chance(0.7)) wall["poisson_ratio"] = dice.chance(0.2) ? 0.4999 : dice.uniform(0, 0.4999);
  if (dice.chance(0.2)) wall["membrane"] = "springs";
  return wall;
}

void add_numerics(json& all, const vessels::IdealisedVessel& vessel, Dice& dice) {
  // Bounds the time of a run more often than a person would.
  all["solver"]["max_settling_steps"] = dice.chance(0.06) ? static_cast<int>(dice.below(5)) : 80;
  if (dice.chance(0.6)) all["solver"]["tolerance"] = dice.over_decades(1e-3, 0.1);
  if (dice.chance(0.2)) all["solver"]["iterations"] = 1 + static_cast<int>(dice.below(12));
  if (dice.chance(0.2)) {
    all["solver"]["growth_per_step"] = length_text(vessel.edge_length * dice.over_decades(0.1, 3));
  }
  if (dice.chance(0.2))
    all["contact"]["distance"] = length_text(vessel.radius * dice.over_decades(0.01, 0.4));
  if (dice.chance(0.15))
    all["patch"]["margin"] = length_text(vessel.radius * dice.over_decades(0.05, 10));
  if (dice.chance(0.15))
    all["level_set"]["voxel_size"] = length_text(vessel.radius * dice.over_decades(0.04, 0.3));
}

/// Self-collision and friction, where the rest of the case allows them.
void add_surface_forces(json& all, Dice& dice) {
  const json& stent = all["stent"];
  if (stent.contains("design")) return;
  if (all["wall"]["preset"] != "paper" && dice.chance(0.15)) all["wall"]["self_collision"] = true;
  const bool straightens =
      stent.value("cell", "open") == "closed" && stent.value("straightening", 1.0) > 0;
  const bool is_soft = all.value("contact", json::object()).contains("stiffness_N_per_mm");
  if (straightens || is_soft || stent.contains("gives_way")) return;
  if (dice.chance(0.25)) all["contact"]["friction"] = dice.over_decades(0.01, 2);
}

/// Writes the vessel, and returns the case that stents it.
json random_case(std::uint64_t seed, const std::filesystem::path& surface) {
  Dice dice(seed);
  const bool of_struts = dice.chance(0.07);
  const stents::Specification& design = dice.one_of(stents::catalogue());
  const double radius =
      of_struts ? 0.5 * design.nominal_diameter * dice.uniform(0.8, 1.3) : dice.over_decades(1, 15);
  const vessels::IdealisedVessel vessel = tests::random_vessel(dice, radius);
  TriangleMesh mesh = vessels::idealised_vessel(vessel);
  tests::damage(mesh, vessel, dice);
  tests::write_obj(mesh, surface);

  json all = {{"vessel", {{"surface", surface.string()}, {"units", "mm"}}}};
  json& stent = all["stent"] = of_struts ? random_struts(design, dice) : random_tube(vessel, dice);
  if (vessel.stenosis > 0.3 && dice.chance(0.7)) {
    stent["at"] = "lesion";
  } else {
    const Polyline axis = vessels::idealised_axis(vessel, 0.1 * radius);
    const Vec3 middle =
        axis[static_cast<std::size_t>(dice.uniform(0.35, 0.65) * static_cast<double>(axis.size()))];
    stent["at"] = {middle.x(), middle.y(), middle.z()};
  }
  const bool gives_way = dice.chance(0.18);
  if (gives_way) {
    stent["gives_way"] = true;
    if (dice.chance(0.8)) stent["bending_stiffness_N_mm2"] = dice.over_decades(1e-2, 1e5);
    if (dice.chance(0.8)) stent["radial_stiffness_N_per_mm2"] = dice.over_decades(1e-3, 1e2);
  }
  all["wall"] = random_wall(radius, dice);
  add_numerics(all, vessel, dice);
  if (!of_struts && !gives_way && dice.chance(0.15))
    all["contact"]["stiffness_N_per_mm"] = dice.over_decades(1e-3, 1e3);
  if (of_struts) {
    // The wall between struts is not looked at here: coarser than they are wide, runs are short.
    all["patch"]["edge_length"] = length_text(0.6 * vessel.edge_length);
    all["patch"]["keep_refined"] = dice.chance(0.5);
    all["solver"]["tolerance"] = 0.05;
  }
  add_surface_forces(all, dice);
  return all;
}

bool finite(double x) { return std::isfinite(x); }
bool finite(const Vec3& x) { return x.allFinite(); }
template <class Value>
bool all_finite(const std::vector<Value>& values) {
  return std::all_of(values.begin(), values.end(), [](const Value& x) { return finite(x); });
}

void expect_numbers(const Outcome& outcome) {
  EXPECT_TRUE(all_finite(outcome.positions));
  EXPECT_TRUE(all_finite(outcome.axis));
  EXPECT_TRUE(all_finite(outcome.radii));
  EXPECT_FALSE(outcome.history.empty());
  EXPECT_TRUE(finite(outcome.contact_force));
}

/// What the files say must be numbers as well.
void expect_numbers_in(const std::filesystem::path& folder) {
  for (const char* name : {"history.csv", "profiles.csv"}) {
    const std::string text = tests::read_text(folder / name);
    EXPECT_FALSE(text.empty()) << name;
    std::istringstream lines(text);
    std::string line;
    std::getline(lines, line);  // the names of the columns
    while (std::getline(lines, line)) {
      if (line.find("nan") != std::string::npos || line.find("inf") != std::string::npos)
        ADD_FAILURE() << name << ": " << line;
    }
  }
}

void expect_clear(const Error& refusal) {
  const std::string line = refusal.what();
  EXPECT_FALSE(line.empty());
  EXPECT_EQ(line.find('\n'), std::string::npos) << line;
  EXPECT_GE(static_cast<int>(refusal.code()), static_cast<int>(ExitCode::usage)) << line;
  EXPECT_LE(static_cast<int>(refusal.code()), static_cast<int>(ExitCode::resources)) << line;
}

/// =57 runs that one alone, and shows its case.
constexpr const char* kChosenSeed = "VSTENT_ABUSE_SEED";

struct Ending {
  std::string kind, line;
};

Ending ending_of(std::uint64_t seed) {
  const TemporaryFolder folder;
  const json specification = random_case(seed, folder / "vessel.obj");
  if (std::getenv(kChosenSeed)) std::cout << specification << '\n';
  try {
    const tests::WholeRun r = tests::run(folder, parse_case(specification, "case.json", "/"));
    expect_numbers(r.outcome);
    expect_numbers_in(folder.path());
    // As the command goes on.
    if (!r.outcome.converged) return {"refused, exit code 5, forces are not balanced", ""};
    require_sound(r.metrics, "vessel.obj");
    return {"result", ""};
  } catch (const Error& refusal) {
    expect_clear(refusal);
    return {"refused, exit code " + std::to_string(static_cast<int>(refusal.code())),
            refusal.what()};
  } catch (const std::exception& unforeseen) {
    ADD_FAILURE() << unforeseen.what() << "\n" << specification.dump(2);
    return {"failed", unforeseen.what()};
  }
}

constexpr int kBlock = 25;

class Abuse : public testing::TestWithParam<int> {};

TEST_P(Abuse, EndsInAResultOrAClearRefusal) {
  const char* chosen = std::getenv(kChosenSeed);
  std::map<std::string, int> endings;
  for (int seed = GetParam(); seed < GetParam() + kBlock; ++seed) {
    if (chosen && seed != std::atoi(chosen)) continue;
    SCOPED_TRACE("seed " + std::to_string(seed));
    std::cout << "seed " << seed << ": " << std::flush;  // what crashes has been named
    const auto begin = std::chrono::steady_clock::now();
    const Ending ending = ending_of(static_cast<std::uint64_t>(seed));
    const std::chrono::duration<double> taken = std::chrono::steady_clock::now() - begin;
    std::cout << ending.kind << (ending.line.empty() ? "" : ": ") << ending.line << " ("
              << std::setprecision(2) << taken.count() << " s)" << std::endl;
    ++endings[ending.kind];
  }
  for (const auto& [kind, count] : endings)
    std::cout << std::setw(4) << count << "  " << kind << '\n';
  if (chosen) return;
  EXPECT_GE(endings["result"], 0.4 * kBlock) << "too few runs get far enough";
}

INSTANTIATE_TEST_SUITE_P(Seeds, Abuse, testing::Values(0, 25, 50, 75));

}  // namespace
}  // namespace vstent::deployment
