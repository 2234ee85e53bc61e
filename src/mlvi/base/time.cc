// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#include "mlvi/base/time.h"

#include <fmt/format.h>

#include <cstdlib>

namespace mlvi {
namespace {

constexpr std::int64_t kNanosecondsPerSecond = 1'000'000'000;
// What 64 bits of nanoseconds hold, about 292 years.
constexpr std::int64_t kMaxSeconds = 9'223'372'036;

bool IsDigit(char c) { return c >= '0' && c <= '9'; }

}  // namespace

std::string ToString(Time time) {
  if (!time.valid()) return "invalid";
  const std::int64_t ns = time.nanoseconds();
  const std::int64_t whole = ns / kNanosecondsPerSecond;
  const std::int64_t fraction = std::abs(ns % kNanosecondsPerSecond);
  const char* sign = (ns < 0 && whole == 0) ? "-" : "";
  return fmt::format("{}{}.{:09d}", sign, whole, fraction);
}

Time ParseTime(const std::string& text) {
  std::size_t i = 0;
  const bool negative = !text.empty() && text[0] == '-';
  if (negative) ++i;
  const std::size_t digits_begin = i;
  while (i < text.size() && IsDigit(text[i])) ++i;
  const std::size_t digits_end = i;
  bool plain = digits_end > digits_begin && digits_end - digits_begin <= 10;
  std::int64_t fraction = 0;
  if (plain && i < text.size() && text[i] == '.') {
    std::int64_t scale = kNanosecondsPerSecond / 10;
    for (++i; i < text.size() && IsDigit(text[i]); ++i, scale /= 10) {
      fraction += scale * (text[i] - '0');
    }
  }
  const std::int64_t whole = plain ? std::strtoll(text.c_str() + digits_begin, nullptr, 10) : 0;
  if (plain && i == text.size() && whole < kMaxSeconds) {
    const std::int64_t ns = whole * kNanosecondsPerSecond + fraction;
    return Time::FromNanoseconds(negative ? -ns : ns);
  }
  // Exponents ("1.403715e+09", as numpy writes them) have only double precision to lose.
  char* end = nullptr;
  const double seconds = std::strtod(text.c_str(), &end);
  const bool parsed = !text.empty() && end == text.c_str() + text.size();
  if (!parsed || !std::isfinite(seconds) || std::abs(seconds) > 9e9) return Time();
  return Time::FromSeconds(seconds);
}

}  // namespace mlvi
