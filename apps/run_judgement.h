// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
//
// What a run is worth: its status, the reason of it, and the exit code.
#pragma once

#include <optional>
#include <string>

#include "mlvi/base/error.h"
#include "mlvi/io/ros_bag_source.h"
#include "mlvi/pipeline/slam.h"

enum class RunStatus {
  kOk,
  kDegraded,        // there is an estimate, but something was wrong
  kInterrupted,     // by a signal
  kInputUnusable,   // a sensor delivered nothing usable
  kInputTruncated,  // a bag without end
  kInputDamaged,    // damage within a bag
  kFailed,          // no estimate to rely on
};

// As in summary.json: "ok", "degraded", "interrupted", "input_unusable", ...
std::string ToString(RunStatus status);

struct Verdict {
  RunStatus status = RunStatus::kOk;
  std::string reason;  // empty when ok, and only then
  int exit_code = 0;
};

// Judges a run that has ended. `input_error`: what the source ended with, if not with the end.
Verdict Judge(const mlvi::Slam& slam, const mlvi::Rig& rig, const mlvi::RosBagSource& source,
              bool interrupted, const std::optional<mlvi::Error>& input_error);
