// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <span>

namespace mlvi {

// Statistics of error magnitudes, all in the unit of the errors (sse: squared).
struct ErrorStatistics {
  std::size_t count = 0;
  double rmse = 0.0, mean = 0.0, median = 0.0;
  double std = 0.0;  // around the mean, division by count
  double min = 0.0, max = 0.0, sse = 0.0;
};

// Contract: at least one error, so that no figure is ever made of nothing.
ErrorStatistics Summarize(std::span<const double> errors);

}  // namespace mlvi
