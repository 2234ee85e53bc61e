// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <CLI/CLI.hpp>

// mlvi simulate SEQUENCE -o DIR: a recording of a simulated rig with its ground truth.
void AddSimulateCommand(CLI::App& app, int& exit_code);
