// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <CLI/CLI.hpp>

// mlvi run BAG... --rig RIG.yaml -o DIR: trajectory, map and report from recordings.
void AddRunCommand(CLI::App& app, int& exit_code);
