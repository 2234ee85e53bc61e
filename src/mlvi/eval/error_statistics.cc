// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#include "mlvi/eval/error_statistics.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "mlvi/base/error.h"

namespace mlvi {

ErrorStatistics Summarize(std::span<const double> errors) {
  MLVI_CHECK(!errors.empty(), "statistics of {} errors", errors.size());
  std::vector<double> sorted(errors.begin(), errors.end());
  std::sort(sorted.begin(), sorted.end());
  const std::size_t n = sorted.size();
  ErrorStatistics statistics{.count = n, .min = sorted.front(), .max = sorted.back()};
  double sum = 0.0;
  for (const double error : sorted) {
    sum += error;
    statistics.sse += error * error;
  }
  statistics.mean = sum / static_cast<double>(n);
  statistics.rmse = std::sqrt(statistics.sse / static_cast<double>(n));
  statistics.median = 0.5 * (sorted[(n - 1) / 2] + sorted[n / 2]);
  double squares = 0.0;
  for (const double error : sorted)
    squares += (error - statistics.mean) * (error - statistics.mean);
  statistics.std = std::sqrt(squares / static_cast<double>(n));
  return statistics;
}

}  // namespace mlvi
