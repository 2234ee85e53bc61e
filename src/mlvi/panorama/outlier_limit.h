// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cmath>
#include <vector>

namespace mlvi {

// The error (>= 0, any unit) beyond which one of many is an outlier: `factor` times their scatter,
// but not less than `least`. The scatter is one sigma of a normal variable by the median, so up to
// half of them may be outliers, and what disturbs all of them (a wrong mount, a wrong prediction)
// widens the limit rather than ending everything.
inline double OutlierLimit(std::vector<double> errors, double least, double factor) {
  constexpr double kMedianOfNormal = 0.6745;  // of |x|, x standard normal
  if (errors.empty()) return least;
  const auto middle = errors.begin() + static_cast<std::ptrdiff_t>(errors.size() / 2);
  std::nth_element(errors.begin(), middle, errors.end());
  return std::max(least, factor * *middle / kMedianOfNormal);
}

}  // namespace mlvi
