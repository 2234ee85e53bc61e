// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0

#include <fmt/format.h>

#include <CLI/CLI.hpp>

#include "evaluate_command.h"
#include "info_command.h"
#include "run_command.h"
#include "simulate_command.h"

int main(int argc, char** argv) {
  CLI::App app("LiDAR-visual-inertial odometry and mapping for multi-fisheye rigs", "mlvi");
  app.set_version_flag("--version", "mlvi " MLVI_VERSION);
  app.require_subcommand(1);
  int exit_code = 0;
  AddSimulateCommand(app, exit_code);
  AddInfoCommand(app, exit_code);
  AddRunCommand(app, exit_code);
  AddEvaluateCommand(app, exit_code);
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    // Help and version are successes; everything else is a usage error.
    return app.exit(error) == 0 ? 0 : 1;
  } catch (const std::exception& error) {
    fmt::print(stderr, "mlvi: internal error: {}\n", error.what());
    return 3;
  }
  return exit_code;
}
