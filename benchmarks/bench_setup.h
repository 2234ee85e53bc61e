// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
//
// What the programs that run estimators on simulated sequences have in common on their command
// lines.
#pragma once

#include <CLI/CLI.hpp>
#include <string>
#include <vector>

#include "mlvi/base/config.h"
#include "mlvi/io/rig_file.h"

namespace mlvi {

struct BenchSetup {
  std::string sequence, rig = "newer_college";
  double seconds = 60.0, rest = 2.0;
  int threads = 0;
  std::vector<std::string> assignments;
};

inline void AddSetupOptions(CLI::App& app, BenchSetup& setup) {
  app.add_option("--sequence", setup.sequence, "Name of the sequence (mlvi simulate --list)");
  app.add_option("--rig", setup.rig, "Rig file or name");
  app.add_option("--seconds", setup.seconds, "Length");
  app.add_option("--rest", setup.rest, "Seconds at rest at the beginning");
  app.add_option("--threads", setup.threads, "Threads (0: all)");
  app.add_option("--set", setup.assignments, "Configuration: key=value");
}

// Loads the rig and sets the configuration.
template <typename Config>
Expected<Rig> Resolve(const BenchSetup& setup, Config& config) {
  ConfigDeclaration declaration = ConfigDeclaration::Of(config);
  for (const std::string& assignment : setup.assignments) {
    if (const auto set = declaration.SetAssignment(assignment); !set)
      return tl::unexpected(set.error());
  }
  if (const auto agree = declaration.Check(); !agree) return tl::unexpected(agree.error());
  return LoadRig(setup.rig);
}

}  // namespace mlvi
