// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <nlohmann/json.hpp>
#include <string>

#include "mlvi/eval/evaluation.h"

// Names of AlignmentKind in its order: none, se3, sim3, yaw.
std::vector<std::string> AlignmentNames();

// The result as a table for reading; angles in degrees.
std::string ToTable(const mlvi::Evaluation& evaluation, const mlvi::EvaluationOptions& options);
// The same as JSON, with units in the keys.
nlohmann::ordered_json ToJson(const mlvi::Evaluation& evaluation,
                              const mlvi::EvaluationOptions& options);
