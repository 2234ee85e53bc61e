// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#include "mlvi/io/point_times.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

namespace mlvi {
namespace {

constexpr std::array<TimeUnit, 4> kUnits = {TimeUnit::kSeconds, TimeUnit::kMilliseconds,
                                            TimeUnit::kMicroseconds, TimeUnit::kNanoseconds};
// Offsets are int32 nanoseconds.
constexpr double kLongestSpan = 2.1;
// A sensor clock that agrees with the header's stamp to this is taken as the same clock.
constexpr double kSameClock = 5.0;

struct Extent {
  double min = std::numeric_limits<double>::infinity();
  double max = -std::numeric_limits<double>::infinity();
  double span() const { return max - min; }
};

Extent ExtentOf(const std::vector<double>& raw, const std::vector<bool>& outlier) {
  Extent extent;
  for (std::size_t i = 0; i < raw.size(); ++i) {
    if (!outlier.empty() && outlier[i]) continue;
    extent.min = std::min(extent.min, raw[i]);
    extent.max = std::max(extent.max, raw[i]);
  }
  return extent;
}

// The unit in which the times are on the clock of the header's stamp, if they are. The middle one
// of three samples decides, so that a single stale point does not.
std::optional<TimeUnit> UnitOfAbsolute(const std::vector<double>& times, Time header_stamp) {
  const double header = header_stamp.seconds();
  if (header < 1e6) return std::nullopt;  // a clock near zero cannot be told from offsets
  std::array<double, 3> samples = {times.front(), times[times.size() / 2], times.back()};
  std::sort(samples.begin(), samples.end());
  const double raw = samples[1];
  for (const TimeUnit unit : kUnits) {
    if (std::abs(raw * SecondsPer(unit) - header) < kSameClock) return unit;
  }
  return std::nullopt;
}

// The span without the outermost hundredth on either side.
double RobustSpan(const std::vector<double>& raw) {
  std::vector<double> sorted = raw;
  const auto tail = static_cast<std::ptrdiff_t>(sorted.size() / 100);
  std::nth_element(sorted.begin(), sorted.begin() + tail, sorted.end());
  const double low = sorted[static_cast<std::size_t>(tail)];
  std::nth_element(sorted.begin(), sorted.end() - 1 - tail, sorted.end());
  return sorted[sorted.size() - 1 - static_cast<std::size_t>(tail)] - low;
}

// Points farther than one period from the median time. A few of them are bit errors or stale
// points; many are none.
std::vector<bool> FindOutliers(const std::vector<double>& raw, double period_raw) {
  std::vector<double> sorted = raw;
  const auto middle = sorted.begin() + static_cast<std::ptrdiff_t>(sorted.size() / 2);
  std::nth_element(sorted.begin(), middle, sorted.end());
  std::vector<bool> outlier(raw.size());
  std::transform(raw.begin(), raw.end(), outlier.begin(),
                 [&](double t) { return std::abs(t - *middle) > period_raw; });
  const auto count = std::count(outlier.begin(), outlier.end(), true);
  if (static_cast<std::size_t>(count) * 10 > raw.size()) outlier.clear();
  return outlier;
}

void SetOrigin(const Extent& extent, bool absolute, Time header, Duration period,
               PointTimes& times) {
  const double unit = SecondsPer(times.unit);
  const double first = extent.min * unit, last = extent.max * unit, near = 2.0 * period.seconds();
  if (absolute) {
    times.origin = TimeOrigin::kAbsolute;
    // Whole units and the rest apart: a product near 1.6e18 would be rounded to 256 ns.
    const double whole = std::floor(extent.min), ns_per_unit = std::round(unit * 1e9);
    times.stamp = Time::FromNanoseconds(static_cast<std::int64_t>(whole) *
                                            static_cast<std::int64_t>(ns_per_unit) +
                                        std::llround((extent.min - whole) * ns_per_unit));
  } else if (std::abs(first) <= near && std::abs(last) <= near) {
    const bool from_end = first < -0.3 * period.seconds() && last < 0.3 * period.seconds();
    times.origin = from_end ? TimeOrigin::kSweepEnd : TimeOrigin::kSweepStart;
    times.stamp = header + Duration::FromSeconds(first);
  } else {
    times.origin = TimeOrigin::kOtherClock;
    times.stamp = header;
  }
}

}  // namespace

double SecondsPer(TimeUnit unit) {
  constexpr std::array<double, 4> kSeconds = {1.0, 1e-3, 1e-6, 1e-9};
  return kSeconds[static_cast<std::size_t>(unit)];
}

const char* NameOf(TimeUnit unit) {
  constexpr std::array<const char*, 4> kNames = {"s", "ms", "us", "ns"};
  return kNames[static_cast<std::size_t>(unit)];
}

TimeUnit GuessTimeUnit(double span, Duration period) {
  const auto distance = [&](TimeUnit unit) {
    return std::abs(std::log(span * SecondsPer(unit) / period.seconds()));
  };
  return *std::min_element(kUnits.begin(), kUnits.end(),
                           [&](TimeUnit a, TimeUnit b) { return distance(a) < distance(b); });
}

std::optional<PointTimes> PointTimer::Interpret(const std::vector<double>& raw, Time header_stamp) {
  failure_ = TimesFailure::kNone;
  std::vector<bool> outlier;
  Extent extent = ExtentOf(raw, outlier);
  const auto absolute = UnitOfAbsolute(raw, header_stamp);
  if (extent.span() <= 0.0) {
    failure_ = TimesFailure::kConstant;
    return std::nullopt;
  }
  PointTimes times;
  if (!absolute && !unit_) times.unit = GuessTimeUnit(std::max(RobustSpan(raw), 1e-12), period_);
  if (absolute || unit_) times.unit = absolute ? *absolute : *unit_;
  const double unit = SecondsPer(times.unit), period = period_.seconds();
  if (extent.span() * unit > 1.5 * period) {
    outlier = FindOutliers(raw, period / unit);
    times.outliers = std::count(outlier.begin(), outlier.end(), true);
    extent = ExtentOf(raw, outlier);
    times.longer_than_period = extent.span() * unit > 1.5 * period;
  }
  const double span = extent.span() * unit;
  if (span > 5.0 * period || span > kLongestSpan) {
    failure_ = TimesFailure::kTooLong;
    failed_span_ = Duration::FromSeconds(std::min(span, 1e9));
    return std::nullopt;
  }
  if (span > 0.5 * period && !unit_) unit_ = times.unit;
  SetOrigin(extent, absolute.has_value(), header_stamp, period_, times);
  times.offsets.resize(raw.size());
  for (std::size_t i = 0; i < raw.size(); ++i) {
    const bool drop = !outlier.empty() && outlier[i];
    times.offsets[i] =
        drop ? -1 : static_cast<std::int32_t>(std::llround((raw[i] - extent.min) * (unit * 1e9)));
  }
  times.span =
      Duration::FromNanoseconds(*std::max_element(times.offsets.begin(), times.offsets.end()));
  return times;
}

double DisorderOfTimes(const std::vector<double>& raw, const std::vector<std::uint16_t>& rings) {
  std::vector<double> last(65536, std::numeric_limits<double>::quiet_NaN());
  std::int64_t forwards = 0, backwards = 0;
  for (std::size_t i = 0; i < raw.size(); ++i) {
    double& before = last[rings[i]];
    forwards += raw[i] > before ? 1 : 0;
    backwards += raw[i] < before ? 1 : 0;
    before = raw[i];
  }
  const std::int64_t steps = forwards + backwards;
  return steps == 0
             ? 0.0
             : static_cast<double>(std::min(forwards, backwards)) / static_cast<double>(steps);
}

}  // namespace mlvi
