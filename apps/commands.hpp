// The subcommands of vstent: each adds itself to the command line and says what to run.
#pragma once

#include <CLI/CLI.hpp>

namespace vstent::apps {

void add_deploy(CLI::App& app);
void add_compare(CLI::App& app);
void add_cfd(CLI::App& app);
void add_check(CLI::App& app);
void add_centerline(CLI::App& app);
void add_designs(CLI::App& app);
void add_stent(CLI::App& app);
void add_measure(CLI::App& app);
void add_demo(CLI::App& app);
void add_report(CLI::App& app);
void add_render(CLI::App& app);
void add_view(CLI::App& app);
void add_flow(CLI::App& app);
void add_sweep(CLI::App& app);

/// Printed wherever a person meets results.
inline constexpr const char* kDisclaimer = "Research tool, not for clinical use.";

}  // namespace vstent::apps
