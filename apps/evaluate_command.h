// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <CLI/CLI.hpp>

// mlvi evaluate ESTIMATE TRUTH: errors of a trajectory against ground truth, as a table or as JSON.
void AddEvaluateCommand(CLI::App& app, int& exit_code);
