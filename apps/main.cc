// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <CLI/CLI.hpp>
#include <cstdio>
#include <string>
#include <vector>

#include "evaluate_command.h"
#include "exit_code.h"
#include "info_command.h"
#include "mlvi/base/suggestion.h"
#include "rig_command.h"
#include "run_command.h"
#include "simulate_command.h"

namespace {

// CLI11 would only say that a subcommand is missing. Empty: the first argument is one, or an
// option.
std::string UnknownSubcommand(const CLI::App& app, int argc, char** argv) {
  if (argc < 2 || argv[1][0] == '-') return "";
  std::vector<std::string> names;
  for (const CLI::App* command : app.get_subcommands({})) {
    if (command->get_name() == argv[1]) return "";
    if (!command->get_group().empty()) names.push_back(command->get_name());
  }
  return fmt::format("no subcommand is called '{}', there are {}{}", argv[1],
                     fmt::join(names, ", "), mlvi::DidYouMean(argv[1], names));
}

// Whether all that was printed has arrived: a full disk shows no sooner than here.
bool OutputArrived() { return std::fflush(stdout) == 0 && std::ferror(stdout) == 0; }

int Fail(int exit_code, const std::string& message) {
  fmt::print(stderr, "mlvi: {}\n", message);
  return exit_code;
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app("LiDAR-visual-inertial odometry and mapping for multi-fisheye rigs", "mlvi");
  app.set_version_flag("--version", "mlvi " MLVI_VERSION);
  app.require_subcommand(1);
  int exit_code = 0;
  AddSimulateCommand(app, exit_code);
  AddInfoCommand(app, exit_code);
  AddRunCommand(app, exit_code);
  AddEvaluateCommand(app, exit_code);
  AddRigCommand(app, exit_code);
  if (const std::string unknown = UnknownSubcommand(app, argc, argv); !unknown.empty()) {
    return Fail(kExitUsage, unknown);
  }
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    // Help and version are successes; everything else is a usage error.
    exit_code = app.exit(error) == 0 ? kExitDone : kExitUsage;
  } catch (const std::exception& error) {
    if (OutputArrived())
      return Fail(kExitEstimation, fmt::format("internal error: {}", error.what()));
  }
  if (!OutputArrived())
    return Fail(kExitUsage, "cannot write to the standard output: is the disk full?");
  return exit_code;
}
