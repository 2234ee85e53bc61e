// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <span>
#include <vector>

#include "mlvi/imu/preintegration.h"
#include "mlvi/sensors/measurements.h"

namespace mlvi {

// The recent IMU samples in one contiguous run, trimmed as the estimate moves on.
class ImuBuffer {
 public:
  // Samples older than the newest by more than `longest` are forgotten, needed or not: an estimate
  // that does not move on (a start that never comes about, a LiDAR that has died) must not fill
  // memory.
  explicit ImuBuffer(Duration longest) : longest_(longest) {}

  // `sample` must be newer than all before.
  void Add(const ImuSample& sample) {
    samples_.push_back(sample);
    TrimBefore(sample.stamp - longest_);
  }

  // The samples of [from, to], interpolated at both ends (SamplesBetween).
  std::vector<ImuSample> Between(Time from, Time to) const {
    const auto first = FirstNeeded(from);
    const auto behind = std::upper_bound(first, samples_.end(), to, StampIsLater);
    const auto last = behind == samples_.end() ? behind : behind + 1;
    return SamplesBetween(std::span(first, last), from, to);
  }

  // Forgets what no interval from `time` on needs.
  void TrimBefore(Time time) {
    const auto first = FirstNeeded(time);
    // Erasing moves the rest: wait until it is worth it.
    if (first - samples_.begin() >= 1024) samples_.erase(samples_.begin(), first);
  }

  std::size_t size() const { return samples_.size(); }

 private:
  static bool StampIsLater(Time t, const ImuSample& sample) { return t < sample.stamp; }
  // The last sample at or before `time`, so that the start can be interpolated.
  std::vector<ImuSample>::const_iterator FirstNeeded(Time time) const {
    const auto later = std::upper_bound(samples_.begin(), samples_.end(), time, StampIsLater);
    return later == samples_.begin() ? later : later - 1;
  }

  Duration longest_;
  std::vector<ImuSample> samples_;
};

}  // namespace mlvi
