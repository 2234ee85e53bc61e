// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
//
// From the raw per-point times of a sweep to nanoseconds since its first firing. Drivers differ in
// unit (s, ms, us, ns), in origin (since the header's stamp, before it, absolute, since the sensor
// was switched on) and in what the header's stamp means (first or last firing); all of it shows in
// the data.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "mlvi/base/time.h"

namespace mlvi {

enum class TimeUnit : int { kSeconds = 0, kMilliseconds = 1, kMicroseconds = 2, kNanoseconds = 3 };
double SecondsPer(TimeUnit unit);
const char* NameOf(TimeUnit unit);

// The unit in which a span of raw times comes nearest to the period of a sweep. Units are a factor
// of 1000 apart, so that a part of a turn does as well. `span` > 0.
TimeUnit GuessTimeUnit(double span, Duration period);

enum class TimeOrigin {
  kSweepStart,  // times count from the header's stamp on
  kSweepEnd,    // times are negative: the header's stamp is the end of the sweep
  kAbsolute,    // times are on the clock of the header's stamp
  kOtherClock,  // times count from some other instant: only differences are used
};

// What was found in the times of one sweep.
struct PointTimes {
  TimeUnit unit = TimeUnit::kSeconds;
  TimeOrigin origin = TimeOrigin::kSweepStart;
  Time stamp;  // the first firing
  // Nanoseconds since `stamp`, one per point; -1: an outlier, to be dropped.
  std::vector<std::int32_t> offsets;
  Duration span;  // of the points that are kept
  std::int64_t outliers = 0;
  // Span beyond 1.5 periods: the rate in the rig file is probably wrong.
  bool longer_than_period = false;
};

// Why there are no usable times.
enum class TimesFailure { kNone, kConstant, kTooLong };

class PointTimer {
 public:
  // `period` of a sweep, from the rig.
  explicit PointTimer(Duration period) : period_(period) {}

  // `raw` is finite and not empty. The unit is settled by the first sweep of about full span and
  // kept from then on.
  std::optional<PointTimes> Interpret(const std::vector<double>& raw, Time header_stamp);
  // The reason when the last call returned nothing, and the span that it saw.
  TimesFailure failure() const { return failure_; }
  Duration failed_span() const { return failed_span_; }

 private:
  Duration period_;
  std::optional<TimeUnit> unit_;
  TimesFailure failure_ = TimesFailure::kNone;
  Duration failed_span_;
};

// The share of steps that go backwards in time between consecutive points of one ring, or forwards
// if those are fewer: near 0 for a sensor's times in any storage order, near 0.5 for a field that
// is no time.
double DisorderOfTimes(const std::vector<double>& raw, const std::vector<std::uint16_t>& rings);

}  // namespace mlvi
