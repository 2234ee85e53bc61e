// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <map>
#include <string>

#include "mlvi/state/health.h"

namespace mlvi {

// Figures of one stream or subsystem for the report.
struct StreamReport {
  std::int64_t received = 0;
  std::int64_t used = 0;
  std::map<std::string, std::int64_t> dropped;  // reason -> count
  std::int64_t gaps = 0;
  double longest_gap = 0.0;  // s
  Health health;
};

}  // namespace mlvi
