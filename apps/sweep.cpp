// vstent sweep: the pressure drop that stents of several diameters leave.
#include <algorithm>
#include <iostream>
#include <memory>
#include <nlohmann/json.hpp>

#include "apps/commands.hpp"
#include "apps/flow_run.hpp"
#include "apps/side_by_side.hpp"
#include "apps/sweep_results.hpp"
#include "apps/terminal.hpp"
#include "deployment/case.hpp"
#include "deployment/result_folder.hpp"
#include "vessels/error.hpp"
#include "vessels/file_guard.hpp"
#include "vessels/json_object.hpp"
#include "vessels/text.hpp"

namespace vstent::apps {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

constexpr int kMostSearched = 8;

struct Arguments {
  std::string case_file, diameters, target, gradient = "mean", out = "vstent-sweep";
  ConditionOptions conditions;
  bool allow_unconverged = false, pictures = true;
  ThreadLimit threads;
};

std::optional<Target> target_of(const Arguments& a) {
  if (a.target.empty()) return std::nullopt;
  const std::string key = "command line: --target-gradient";
  Target target;
  target.drop =
      flow::parse_quantity(a.target, flow::Dimension::pressure, key) / flow::kDynPerCm2PerMmHg;
  if (!(target.drop > 0)) throw Error(ExitCode::usage, key + ": must be positive, is " + a.target);
  for (const Gradient g : {Gradient::peak, Gradient::peak_to_peak})
    if (a.gradient == name(g)) target.gradient = g;
  return target;
}

std::string replaced(std::string text, const std::string& what, const std::string& with) {
  for (std::size_t at = text.find(what); at != std::string::npos;
       at = text.find(what, at + with.size()))
    text.replace(at, what.size(), with);
  return text;
}

/// Deploys and looks at the flow; all diameters are measured at the same places.
class Sweeper {
 public:
  Sweeper(const Arguments& a, const std::vector<double>& diameters, const fs::path& stage)
      : a_(a),
        given_(deployment::read_case(a.case_file)),
        largest_(diameters.back()),
        stage_(stage) {
    sweep_.case_file = fs::absolute(a.case_file).string();
    sweep_.conditions = a.conditions.file.empty() ? "inflow " + a.conditions.inflow
                                                  : fs::absolute(a.conditions.file).string();
    sweep_.target = target_of(a);
  }

  void add(const std::vector<double>& diameters, bool searched) {
    std::vector<SweepEntry> entries = deploy(diameters, searched);
    for (SweepEntry& entry : entries) {
      if (entry.refusal.empty()) {
        look_at(entry);
      } else {
        std::cerr << "warning: " << entry.folder << ": " << entry.refusal << '\n';
      }
      const auto place = std::upper_bound(
          sweep_.entries.begin(), sweep_.entries.end(), entry,
          [](const SweepEntry& x, const SweepEntry& y) { return x.diameter < y.diameter; });
      sweep_.entries.insert(place, std::move(entry));
    }
  }

  void search() {
    for (int k = 0; sweep_.target && k < kMostSearched; ++k) {
      const auto between =
          bracket(trials(sweep_.entries, sweep_.target->gradient), sweep_.target->drop);
      const auto next = between ? next_diameter(*between, sweep_.target->drop) : std::nullopt;
      if (!next || tried(*next)) break;
      add({*next}, true);
    }
    if (sweep_.target) judge(*sweep_.target, sweep_.entries);
  }

  bool any() const {
    return std::any_of(sweep_.entries.begin(), sweep_.entries.end(),
                       [](const SweepEntry& e) { return e.answer.has_value(); });
  }
  const Sweep& sweep() const { return sweep_; }

 private:
  bool tried(double diameter) const {
    return std::any_of(sweep_.entries.begin(), sweep_.entries.end(),
                       [&](const SweepEntry& e) { return e.diameter == diameter; });
  }

  std::vector<SweepEntry> deploy(const std::vector<double>& diameters, bool searched) const {
    std::vector<Job> jobs;
    std::vector<SweepEntry> entries;
    for (const double diameter : diameters) {
      SweepEntry entry;
      entry.diameter = diameter;
      entry.folder = vessels::number(diameter) + "mm";
      entry.searched = searched;
      deployment::Case one = given_;
      one.diameter = diameter;
      const fs::path case_file = stage_ / (entry.folder + ".json");
      vessels::write_whole(case_file, deployment::to_json(one).dump(2) + "\n");
      Job job{{"deploy", case_file.string(), "-o", (stage_ / entry.folder).string(),
               "--no-pictures", "--no-report"},
              stage_ / (entry.folder + ".log"),
              entry.folder};
      if (a_.allow_unconverged) job.arguments.push_back("--allow-unconverged");
      jobs.push_back(std::move(job));
      entries.push_back(std::move(entry));
    }
    const std::vector<JobOutcome> outcomes = run_side_by_side(jobs, a_.threads.count());
    for (std::size_t i = 0; i < entries.size(); ++i) {
      if (outcomes[i].exit_code == static_cast<int>(ExitCode::interrupted) || interrupted())
        throw Error(ExitCode::interrupted, "stopped on request");
      entries[i].exit_code = outcomes[i].exit_code;
      entries[i].refusal = replaced(outcomes[i].error, jobs[i].arguments[1], a_.case_file);
      fs::remove(jobs[i].log);
      fs::remove(jobs[i].arguments[1]);
    }
    return entries;
  }

  void look_at(SweepEntry& entry) {
    FlowInput input = read_result(stage_ / entry.folder);
    if (!stretch_) {
      stretch_ = input.stretch;
      stretch_->diameter = std::max(stretch_->diameter, largest_);
      conditions_ = a_.conditions.read(input);
    }
    input.stretch = stretch_;
    flow::Study study = flow::study(input.question(), conditions_);
    if (sweep_.notes.empty()) {
      sweep_.notes = input.notes;
      sweep_.notes.insert(sweep_.notes.end(), study.notes.begin(), study.notes.end());
    }
    const fs::path folder = stage_ / entry.folder / "flow";
    fs::create_directory(folder);
    write_flow(study, conditions_, given_.unit, folder, false);
    const json metrics = vessels::read_json(stage_ / entry.folder / "metrics.json");
    entry.narrowest_after = metrics.at("lumen").at("narrowest_after_mm").get<double>();
    if (!sweep_.before) sweep_.before = std::move(study.before);
    entry.answer = std::move(study.after);
  }

  const Arguments& a_;
  deployment::Case given_;
  double largest_ = 0;
  fs::path stage_;
  std::optional<flow::Stretch> stretch_;
  flow::BoundaryConditions conditions_;
  Sweep sweep_;
};

void run(const Arguments& a) {
  a.threads.apply();
  const std::vector<double> diameters = parse_diameters(a.diameters);
  a.conditions.check();
  deployment::ResultFolder folder(a.out);
  Sweeper sweeper(a, diameters, folder.stage());
  sweeper.add(diameters, false);
  const Sweep& sweep = sweeper.sweep();
  if (!sweeper.any()) {
    throw Error(static_cast<ExitCode>(sweep.entries.front().exit_code),
                a.case_file + ": no diameter could be deployed; " + sweep.entries.front().refusal);
  }
  sweeper.search();
  vessels::write_whole(folder.stage() / "sweep.json", sweep_json(sweep).dump(2) + "\n");
  vessels::write_whole(folder.stage() / "sweep.csv", sweep_csv(sweep));
  const Figure figure = sweep_figure(sweep);
  vessels::write_whole(folder.stage() / "sweep.svg", svg(figure));
  if (a.pictures) draw(figure, folder.stage() / "sweep.png");
  folder.publish();
  std::cout << sweep_table(sweep) << "result " << folder.final_folder().string() << '\n'
            << kDisclaimer << '\n';
  std::string refused;
  int code = 0;
  for (const SweepEntry& e : sweep.entries) {
    if (e.refusal.empty()) continue;
    refused += (refused.empty() ? "" : ", ") + e.folder;
    code = e.exit_code;
  }
  if (code != 0)
    throw Error(static_cast<ExitCode>(code), "not deployed: " + refused + " (see the warnings)");
}

}  // namespace

void add_sweep(CLI::App& app) {
  auto* command = app.add_subcommand(
      "sweep", std::string("Pressure drop against stent diameter, and the diameter that reaches a "
                           "target. ") +
                   kDisclaimer);
  auto a = std::make_shared<Arguments>();
  command->add_option("case", a->case_file, "CASE.json; its diameter is set aside")->required();
  command
      ->add_option("--diameter", a->diameters,
                   "first:last:how many (6mm:12mm:7), or a list (6mm,7.5mm,9mm)")
      ->required();
  a->conditions.add_options(*command, "--flow");
  command->add_option("--target-gradient", a->target,
                      "Find the smallest diameter that leaves this pressure drop (10mmHg)");
  command
      ->add_option("--gradient", a->gradient, "What the target is about: mean, peak, peak-to-peak")
      ->check(CLI::IsMember({"mean", "peak", "peak-to-peak"}))
      ->capture_default_str();
  command->add_option("-o,--out", a->out, "Folder for the results")->capture_default_str();
  command->add_flag("--allow-unconverged", a->allow_unconverged,
                    "Keep results whose forces do not balance");
  command->add_flag("!--no-pictures", a->pictures, "Do not draw sweep.png (sweep.svg is written)");
  a->threads.add_option(*command);
  command->footer(
      "Examples:\n"
      "  vstent sweep CASE.json --diameter 6mm:12mm:7 --flow bc.json -o OUT\n"
      "  vstent sweep CASE.json --diameter 8mm,12mm --inflow \"70 mL/s\" --target-gradient 5mmHg\n"
      "Deployments run side by side as far as memory and threads allow. OUT holds sweep.csv, "
      "sweep.json, sweep.svg, sweep.png and a folder of results with its flow for each diameter;\n"
      "it appears when all is done. A diameter that is refused is left out, and the exit code "
      "says so.");
  command->callback([a] { run(*a); });
}

}  // namespace vstent::apps
