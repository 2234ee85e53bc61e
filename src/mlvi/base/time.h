// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
//
// Time on the wire of every sensor is integer nanoseconds; seconds exist only as durations in
// formulas.
#pragma once

#include <cmath>
#include <compare>
#include <cstdint>
#include <limits>
#include <string>

namespace mlvi {

// A signed span of time, exact to the nanosecond.
class Duration {
 public:
  constexpr Duration() = default;
  static constexpr Duration FromNanoseconds(std::int64_t ns) { return Duration(ns); }
  // Rounds to the nearest nanosecond. `seconds` must be finite and within +-292 years.
  static Duration FromSeconds(double seconds) { return Duration(std::llround(seconds * 1e9)); }
  static constexpr Duration FromMilliseconds(std::int64_t ms) { return Duration(ms * 1'000'000); }

  constexpr std::int64_t nanoseconds() const { return ns_; }
  constexpr double seconds() const { return static_cast<double>(ns_) * 1e-9; }

  constexpr auto operator<=>(const Duration&) const = default;
  constexpr Duration operator-() const { return Duration(-ns_); }
  constexpr Duration operator+(Duration other) const { return Duration(ns_ + other.ns_); }
  constexpr Duration operator-(Duration other) const { return Duration(ns_ - other.ns_); }
  constexpr Duration operator*(std::int64_t factor) const { return Duration(ns_ * factor); }
  constexpr Duration operator/(std::int64_t divisor) const { return Duration(ns_ / divisor); }

 private:
  explicit constexpr Duration(std::int64_t ns) : ns_(ns) {}
  std::int64_t ns_ = 0;
};

// An instant on the clock of the recording, nanoseconds since its epoch (Unix time in ROS bags).
class Time {
 public:
  constexpr Time() = default;  // The invalid instant: earlier than every valid one.
  static constexpr Time FromNanoseconds(std::int64_t ns) { return Time(ns); }
  // Loses precision for large values (about 0.2 us at Unix times): only for data that exists in
  // seconds.
  static Time FromSeconds(double seconds) { return Time(std::llround(seconds * 1e9)); }

  constexpr bool valid() const { return ns_ != std::numeric_limits<std::int64_t>::min(); }
  constexpr std::int64_t nanoseconds() const { return ns_; }
  constexpr double seconds() const { return static_cast<double>(ns_) * 1e-9; }

  constexpr auto operator<=>(const Time&) const = default;
  constexpr Duration operator-(Time other) const {
    return Duration::FromNanoseconds(ns_ - other.ns_);
  }
  constexpr Time operator+(Duration d) const { return Time(ns_ + d.nanoseconds()); }
  constexpr Time operator-(Duration d) const { return Time(ns_ - d.nanoseconds()); }

 private:
  explicit constexpr Time(std::int64_t ns) : ns_(ns) {}
  std::int64_t ns_ = std::numeric_limits<std::int64_t>::min();
};

// "1625132069.158812160": seconds with nine decimals, without a detour over double.
std::string ToString(Time time);
// Reads what ToString writes, and any plain decimal number of seconds with up to nine decimals
// used. Returns the invalid Time when `text` is no such number.
Time ParseTime(const std::string& text);

}  // namespace mlvi
