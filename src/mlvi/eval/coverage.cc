// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#include "mlvi/eval/coverage.h"

#include <algorithm>

#include "mlvi/base/error.h"

namespace mlvi {

Coverage ComputeCoverage(const Trajectory& estimate, const Trajectory& truth, double max_gap,
                         Duration offset) {
  MLVI_CHECK(!estimate.empty() && !truth.empty(), "{} estimates, {} truths", estimate.size(),
             truth.size());
  const auto [first, last] = std::minmax_element(
      truth.begin(), truth.end(),
      [](const StampedPose& a, const StampedPose& b) { return a.stamp < b.stamp; });
  const Time begin = first->stamp, end = last->stamp;
  const Duration reach = Duration::FromSeconds(max_gap);
  std::vector<Time> stamps;
  for (const StampedPose& p : estimate) {
    const Time stamp = p.stamp + offset;
    // Poses a little outside of the truth's time reach into it.
    if (stamp >= begin - reach && stamp <= end + reach)
      stamps.push_back(std::clamp(stamp, begin, end));
  }
  std::sort(stamps.begin(), stamps.end());
  Coverage coverage{.truth_duration = (end - begin).seconds()};
  if (stamps.empty()) {
    coverage.gaps.push_back({begin, end});
    return coverage;
  }
  stamps.push_back(end);
  Duration covered;
  Time from = begin;
  for (const Time stamp : stamps) {
    if (stamp - from > reach) {
      coverage.gaps.push_back({from, stamp});
    } else {
      covered = covered + (stamp - from);
    }
    from = stamp;
  }
  coverage.covered = covered.seconds();
  coverage.share = coverage.truth_duration > 0.0 ? coverage.covered / coverage.truth_duration : 1.0;
  return coverage;
}

}  // namespace mlvi
