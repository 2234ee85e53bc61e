// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <CLI/CLI.hpp>

// `mlvi rig`: rig files from calibrations by Kalibr, copies of built-in rigs.
void AddRigCommand(CLI::App& app, int& exit_code);
