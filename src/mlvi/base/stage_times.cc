// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#include "mlvi/base/stage_times.h"

#include <algorithm>
#include <cmath>
#include <numeric>

namespace mlvi {

std::map<std::string, StageTimes::Statistics> StageTimes::Summarize() const {
  std::map<std::string, Statistics> summary;
  for (const auto& [stage, samples] : samples_) {
    std::vector<float> sorted = samples;
    std::sort(sorted.begin(), sorted.end());
    // The smallest value that at least the share q of the samples do not exceed.
    const auto quantile = [&](double q) {
      const auto rank = static_cast<std::size_t>(std::ceil(q * static_cast<double>(sorted.size())));
      return static_cast<double>(sorted[std::max<std::size_t>(rank, 1) - 1]);
    };
    const double sum = std::accumulate(sorted.begin(), sorted.end(), 0.0);
    summary[stage] = {.count = sorted.size(),
                      .mean_ms = sum / static_cast<double>(sorted.size()),
                      .p50_ms = quantile(0.50),
                      .p95_ms = quantile(0.95),
                      .p99_ms = quantile(0.99),
                      .max_ms = static_cast<double>(sorted.back())};
  }
  return summary;
}

}  // namespace mlvi
