// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>

#include "mlvi/state/health.h"

namespace mlvi {

// reason -> count, by stream ("imu", "lidar", the name of a camera).
using DropCounts = std::map<std::string, std::map<std::string, std::int64_t>>;

// Figures of one stream or subsystem for the report.
struct StreamReport {
  std::int64_t received = 0;
  std::int64_t used = 0;
  std::map<std::string, std::int64_t> dropped;  // reason -> count
  std::int64_t gaps = 0;
  double longest_gap = 0.0;       // s
  std::optional<double> rate_hz;  // without gaps; empty: too little came, or not measured
  Health health;
};

// The number of measurements that were dropped, for whatever reason.
std::int64_t DroppedTotal(const StreamReport& report);
// "14 of 60 sweeps dropped ('no valid point' 10, 'unreadable message' 4)": the most frequent reason
// first. `what` are the measurements.
std::string DroppedText(const StreamReport& report, const std::string& what);
// Whether a stream is worse off for what was dropped: more than `share` of it, or anything that
// shows the recording itself to be bad.
bool SuffersFromDrops(const StreamReport& report, double share);
// Adds a finding to what is known: the worst level counts, all reasons stay.
void Worsen(Health& health, const Health& finding);

}  // namespace mlvi
