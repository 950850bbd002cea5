// vstent report: a result folder as one page for the browser.
#include "apps/report.hpp"

#include <cstdio>
#include <iostream>
#include <memory>

#include "apps/commands.hpp"
#include "apps/terminal.hpp"
#include "report/report.hpp"
#include "vessels/error.hpp"

namespace vstent::apps {
namespace {

namespace fs = std::filesystem;

struct Arguments {
  std::string folder, out, name;
  double size_limit = report::Options().size_limit;
  ThreadLimit threads;
};

report::Options options_for(const fs::path& shown_folder) {
  report::Options options;
  options.name = fs::absolute(shown_folder / "").lexically_normal().parent_path().filename();
  options.shown_folder = shown_folder;
  options.version = VSTENT_VERSION;
  options.disclaimer = kDisclaimer;
  return options;
}

void run(const Arguments& a) {
  a.threads.apply();
  report::Options options = options_for(a.folder);
  options.size_limit = a.size_limit;
  if (!a.name.empty()) options.name = a.name;
  const fs::path file = a.out.empty() ? fs::path(a.folder) / "report.html" : fs::path(a.out);
  Progress progress;
  progress.show("writing the report ...");
  const report::Written written = report::write_report(a.folder, file, options);
  progress.clear();
  for (const std::string& warning : written.warnings) std::cerr << "warning: " << warning << '\n';
  std::printf("report            %s (%.1f MB)\n", file.c_str(),
              static_cast<double>(written.bytes) / 1e6);
}

}  // namespace

void add_report_page(const fs::path& stage, const fs::path& out) {
  try {
    const report::Written written =
        report::write_report(stage, stage / "report.html", options_for(out));
    for (const std::string& warning : written.warnings)
      std::cerr << "warning: report.html: " << warning << '\n';
  } catch (const Error& error) {
    if (error.code() == ExitCode::output) throw;
    std::cerr << "warning: no report.html: " << error.what() << '\n';
  }
}

void add_report(CLI::App& app) {
  auto* command = app.add_subcommand(
      "report", std::string("A result folder as one page for the browser. ") + kDisclaimer);
  auto a = std::make_shared<Arguments>();
  command->add_option("folder", a->folder, "A folder that `vstent deploy` wrote")->required();
  command->add_option("-o,--out", a->out, "The page; default: report.html in the folder");
  command->add_option("--name", a->name, "The page's title; default: the folder's name");
  command
      ->add_option("--size-limit", a->size_limit,
                   "MB; saved steps are left out evenly to stay below")
      ->check(CLI::PositiveNumber)
      ->capture_default_str();
  a->threads.add_option(*command);
  command->footer("Example:\n  vstent report OUT -o report.html");
  command->callback([a] { run(*a); });
}

}  // namespace vstent::apps
