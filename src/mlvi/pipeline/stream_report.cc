// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#include "mlvi/pipeline/stream_report.h"

#include <fmt/format.h>

#include <algorithm>
#include <vector>

namespace mlvi {

std::int64_t DroppedTotal(const StreamReport& report) {
  std::int64_t sum = 0;
  for (const auto& [reason, count] : report.dropped) sum += count;
  return sum;
}

std::string DroppedText(const StreamReport& report, const std::string& what) {
  std::vector<std::pair<std::int64_t, std::string>> reasons;
  for (const auto& [reason, count] : report.dropped) {
    reasons.emplace_back(-count, fmt::format("'{}' {}", reason, count));
  }
  std::sort(reasons.begin(), reasons.end());
  std::string list;
  for (const auto& [order, text] : reasons) list += (list.empty() ? "" : ", ") + text;
  return fmt::format("{} of {} {} dropped ({})", DroppedTotal(report), report.received, what, list);
}

bool SuffersFromDrops(const StreamReport& report, double share) {
  const auto limit = share * static_cast<double>(report.received);
  return static_cast<double>(DroppedTotal(report)) > limit ||
         report.dropped.contains("unreadable message") || report.dropped.contains("wrong size");
}

void Worsen(Health& health, const Health& finding) {
  health.level = std::max(health.level, finding.level);
  health.reason += (health.reason.empty() ? "" : ", ") + finding.reason;
}

}  // namespace mlvi
