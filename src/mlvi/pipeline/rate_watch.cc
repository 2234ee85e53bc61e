// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#include "mlvi/pipeline/rate_watch.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "mlvi/base/error.h"

namespace mlvi {
namespace {

constexpr double kShortest = 1e-5;                // s
constexpr double kLogStep = 0.00995033085316808;  // ln 1.01
// A judgement from fewer would be one on the ends of a recording.
constexpr std::int64_t kEnough = 20;

int ClassOf(double seconds, int classes) {
  const double position = std::log(std::max(seconds, kShortest) / kShortest) / kLogStep;
  return std::min(static_cast<int>(position), classes - 1);
}

}  // namespace

RateWatch::RateWatch(double stated_hz, const RateLimits& limits)
    : stated_period_(1.0 / stated_hz), limits_(limits) {
  MLVI_CHECK(stated_hz > 0.0, "rate of {} Hz", stated_hz);
}

void RateWatch::Add(Duration interval) {
  MLVI_CHECK(interval > Duration(), "interval of {} s", interval.seconds());
  const auto index = static_cast<std::size_t>(ClassOf(interval.seconds(), kClasses));
  ++counts_[index];
  seconds_[index] += interval.seconds();
  ++intervals_;
}

double RateWatch::Quantile(double share) const {
  std::int64_t below = 0;
  for (std::size_t i = 0; i < kClasses; ++i) {
    below += counts_[i];
    if (static_cast<double>(below) >= share * static_cast<double>(intervals_) && counts_[i] > 0) {
      return seconds_[i] / static_cast<double>(counts_[i]);
    }
  }
  return stated_period_;
}

double RateWatch::LongestInterval() const {
  return limits_.pause_periods * std::max(stated_period_, Quantile(0.5));
}

std::pair<double, std::int64_t> RateWatch::Upto(double longest) const {
  double seconds = 0.0;
  std::int64_t count = 0;
  for (std::size_t i = 0; i < kClasses; ++i) {
    if (seconds_[i] > longest * static_cast<double>(counts_[i])) break;
    seconds += seconds_[i];
    count += counts_[i];
  }
  return {seconds, count};
}

double RateWatch::MissingShare(double period) const {
  const double longest = LongestInterval();
  std::int64_t missing = 0, due = 0;
  for (std::size_t i = 0; i < kClasses; ++i) {
    if (counts_[i] == 0) continue;
    const double mean = seconds_[i] / static_cast<double>(counts_[i]);
    if (mean > longest) break;
    const std::int64_t periods = std::max<std::int64_t>(1, std::llround(mean / period));
    due += periods * counts_[i];
    missing += (periods - 1) * counts_[i];
  }
  return due > 0 ? static_cast<double>(missing) / static_cast<double>(due) : 0.0;
}

std::optional<double> RateWatch::Measured() const {
  if (intervals_ < kEnough) return std::nullopt;
  const auto [seconds, count] = Upto(LongestInterval());
  if (count == 0) return std::nullopt;
  return static_cast<double>(count) / seconds;
}

std::string RateWatch::Finding(const std::string& what, const std::string& key) const {
  const std::optional<double> measured = Measured();
  if (!measured) return {};
  const double stated = 1.0 / stated_period_;
  // Losses lengthen intervals: the shorter ones tell at which rate the sensor works.
  const double period = Quantile(0.25);
  if (std::abs(period / stated_period_ - 1.0) <= limits_.tolerance) {
    const double missing = MissingShare(period);
    if (missing <= limits_.missing_share) return {};
    return fmt::format(
        "{:.0f} % of the {} are missing between others ({:.1f} Hz arrive, {} is {:g}): lost by the "
        "driver, the network or the recorder",
        100.0 * missing, what, *measured, key, stated);
  }
  if (std::abs(*measured / stated - 1.0) <= limits_.tolerance) return {};
  return fmt::format(
      "{} come at {:.1f} Hz, but {} is {:g}: set it to {:.3g}, or find out where {} are lost", what,
      *measured, key, stated, *measured, what);
}

}  // namespace mlvi
