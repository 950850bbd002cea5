// vstent: the command.
#include <signal.h>

#include <exception>
#include <iostream>
#include <new>

#include "apps/commands.hpp"
#include "apps/terminal.hpp"
#include "vessels/error.hpp"

namespace {

int run(int argc, char** argv) {
  CLI::App app(
      std::string("vstent: deploy stents, virtually, in patient-specific vessel surfaces.\n") +
      vstent::apps::kDisclaimer);
  app.require_subcommand(1);
  app.set_version_flag("--version", VSTENT_VERSION);
  app.get_formatter()->column_width(34);
  app.footer(
      "Examples:\n"
      "  vstent deploy wall.stl --units mm --at 0.36,0.16,-3.78 --length 30mm --diameter 11mm -o "
      "OUT\n"
      "  vstent deploy case.json -o OUT\n"
      "  vstent compare case.json --designs xience_s,cypher,smooth -o OUT\n"
      "  vstent check wall.stl --units mm\n"
      "  vstent centerline wall.stl --units mm -o cl.vtp\n"
      "  vstent designs\n"
      "  vstent stent xience_s --diameter 3mm -o stent.stl\n"
      "  vstent report OUT\n"
      "  vstent measure wall.stl OUT/stented.vtp --units mm --stent OUT/stent.vdb -o metrics.json\n"
      "  vstent cfd OUT --edge 0.6mm --boundary-conditions bc.json -o CASE\n"
      "  vstent flow OUT --inflow \"85 mL/s\"\n"
      "  vstent sweep CASE.json --diameter 6mm:12mm:7 --flow bc.json -o OUT\n"
      "  vstent demo -o demo\n"
      "`vstent SUBCOMMAND --help` says more.");
  vstent::apps::add_deploy(app);
  vstent::apps::add_compare(app);
  vstent::apps::add_check(app);
  vstent::apps::add_cfd(app);
  vstent::apps::add_centerline(app);
  vstent::apps::add_designs(app);
  vstent::apps::add_stent(app);
  vstent::apps::add_report(app);
  vstent::apps::add_render(app);
  vstent::apps::add_view(app);
  vstent::apps::add_measure(app);
  vstent::apps::add_flow(app);
  vstent::apps::add_sweep(app);
  vstent::apps::add_demo(app);
  try {
    app.parse(argc, argv);
  } catch (const CLI::Success& asked) {
    return app.exit(asked);
  } catch (const CLI::ParseError& error) {
    std::cerr << "error: command line: " << error.what() << " (see --help)\n";
    return static_cast<int>(vstent::ExitCode::usage);
  }
  return static_cast<int>(vstent::ExitCode::ok);
}

}  // namespace

int main(int argc, char** argv) {
  signal(SIGPIPE, SIG_IGN);
  signal(SIGXFSZ, SIG_IGN);
  vstent::apps::watch_for_interrupts();
  try {
    return run(argc, argv);
  } catch (const vstent::Error& error) {
    std::cerr << "error: " << error.what() << '\n';
    return static_cast<int>(error.code());
  } catch (const std::bad_alloc&) {
    std::cerr << "error: out of memory\n";
    return static_cast<int>(vstent::ExitCode::resources);
  } catch (const std::length_error& error) {
    std::cerr << "error: " << error.what() << '\n';
    return static_cast<int>(vstent::ExitCode::resources);
  } catch (const std::exception& error) {
    std::cerr << "error: internal: " << error.what() << '\n';
    return static_cast<int>(vstent::ExitCode::numerical);
  }
}
