// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <CLI/CLI.hpp>

// `mlvi info BAG...`: what is in recordings.
void AddInfoCommand(CLI::App& app, int& exit_code);
