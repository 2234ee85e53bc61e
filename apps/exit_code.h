// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <fmt/format.h>

#include "mlvi/base/error.h"

inline constexpr int kExitDone = 0;
inline constexpr int kExitUsage = 1;       // usage or configuration
inline constexpr int kExitInput = 2;       // unreadable or insufficient input
inline constexpr int kExitEstimation = 3;  // estimation failed
// Ended by a signal, as shells report it; results until then are kept.
inline constexpr int kExitInterrupted = 130;

inline int ExitCodeOf(mlvi::ErrorKind kind) {
  switch (kind) {
    case mlvi::ErrorKind::kConfiguration: return kExitUsage;
    case mlvi::ErrorKind::kInput: return kExitInput;
    case mlvi::ErrorKind::kEstimation: return kExitEstimation;
  }
  return kExitEstimation;
}

// The exit code of a command's outcome; prints its error.
inline int Report(const mlvi::Expected<int>& outcome) {
  if (outcome) return *outcome;
  fmt::print(stderr, "mlvi: {}\n", outcome.error().message);
  return ExitCodeOf(outcome.error().kind);
}
