// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
//
// At which rate a stream delivers, against what the rig says of it, in constant memory.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <utility>

#include "mlvi/base/time.h"

namespace mlvi {

struct RateLimits {
  double tolerance = 0.2;      // relative difference of rates
  double missing_share = 0.1;  // of the measurements that were due
  double pause_periods = 5.0;  // a longer interval is a pause, not a matter of rate
};

// Intervals are sorted into classes of 1 %, from 10 us to 1000 s. Two causes are told apart: a
// stream whose shorter intervals are as stated but which is too slow on the whole loses
// measurements; one that is regular at another rate has a wrong rate in the rig file. Bursts
// (drivers that stamp on arrival) are neither, as long as the mean is right.
class RateWatch {
 public:
  // `stated_hz`: the rate in the rig, positive.
  RateWatch(double stated_hz, const RateLimits& limits);

  // The time between two successive measurements; positive.
  void Add(Duration interval);

  std::int64_t intervals() const { return intervals_; }
  // Mean rate in Hz without pauses; empty below 20 intervals.
  std::optional<double> Measured() const;
  // What is wrong, with both rates; empty when nothing is, or when too little was seen to tell.
  // `what` are the measurements ("samples"), `key` the rig's field.
  std::string Finding(const std::string& what, const std::string& key) const;

 private:
  // Classes of 1 % over eight decades.
  static constexpr int kClasses = 1852;

  double Quantile(double share) const;  // s
  double MissingShare(double period) const;
  // Sum of the intervals up to `longest` (s), and their number.
  std::pair<double, std::int64_t> Upto(double longest) const;
  double LongestInterval() const;  // s, which is no pause

  double stated_period_;
  RateLimits limits_;
  std::array<std::int64_t, kClasses> counts_{};
  std::array<double, kClasses> seconds_{};  // sum of the intervals of each class
  std::int64_t intervals_ = 0;
};

}  // namespace mlvi
