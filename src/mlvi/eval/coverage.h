// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "mlvi/geometry/stamped_pose.h"

namespace mlvi {

struct TimeGap {
  Time from;
  Time to;
};

// How much of the truth's time the estimate describes: an estimate that stops when it gets hard
// must not look good.
struct Coverage {
  double truth_duration = 0.0;  // s, from the first to the last pose of the truth
  double covered = 0.0;         // s of it without a gap in the estimate
  double share = 0.0;  // covered / truth_duration; 1 for a truth of one instant that is covered
  std::vector<TimeGap>
      gaps{};  // within the truth's time, in order; late starts and early ends are gaps too
};

// `max_gap` (s): a longer interval between two poses of the estimate (or to the truth's ends) is a
// gap. `offset` is added to the stamps of the estimate. Stamps need not be sorted. Contract:
// neither is empty.
Coverage ComputeCoverage(const Trajectory& estimate, const Trajectory& truth, double max_gap,
                         Duration offset);

}  // namespace mlvi
