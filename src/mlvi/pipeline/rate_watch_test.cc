// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#include "mlvi/pipeline/rate_watch.h"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <functional>

namespace mlvi {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

// `arrives(k)`: whether measurement k of a sensor of `actual` Hz arrives; `jitter` of its stamp in
// periods.
RateWatch Watch(
    double stated, double actual, const std::function<bool(int)>& arrives,
    const std::function<double(int)>& jitter = [](int) { return 0.0; }) {
  RateWatch watch(stated, RateLimits{});
  Time previous;
  for (int k = 0; k < 600; ++k) {
    if (!arrives(k)) continue;
    const Time now = Time::FromSeconds(100.0 + (k + jitter(k)) / actual);
    if (previous.valid() && now > previous) watch.Add(now - previous);
    previous = std::max(previous, now);
  }
  return watch;
}

std::string FindingOf(const RateWatch& watch) { return watch.Finding("samples", "imu.rate_hz"); }
bool Always(int) { return true; }

class RatesWithinTolerance : public ::testing::TestWithParam<double> {};

TEST_P(RatesWithinTolerance, AreNotWorthAWord) {
  const RateWatch watch = Watch(200.0, 200.0 * GetParam(), Always);
  EXPECT_THAT(FindingOf(watch), IsEmpty());
  EXPECT_NEAR(*watch.Measured(), 200.0 * GetParam(), 1e-4);
}

INSTANTIATE_TEST_SUITE_P(Rates, RatesWithinTolerance,
                         ::testing::Values(0.82, 0.95, 1.0, 1.05, 1.18));

class WrongRates : public ::testing::TestWithParam<double> {};

TEST_P(WrongRates, AreNamedWithBothNumbersAndTheKey) {
  const RateWatch watch = Watch(200.0, 200.0 * GetParam(), Always);
  EXPECT_THAT(FindingOf(watch), AllOf(HasSubstr(fmt::format("{:.1f} Hz", 200.0 * GetParam())),
                                      HasSubstr("200"), HasSubstr("imu.rate_hz")));
}

INSTANTIATE_TEST_SUITE_P(Rates, WrongRates,
                         ::testing::Values(0.001, 0.1, 0.5, 0.75, 1.3, 2.0, 10.0, 100.0));

TEST(RateWatch, EveryThirdSampleMissing) {
  EXPECT_THAT(FindingOf(Watch(200.0, 200.0, [](int k) { return k % 3 != 0; })),
              AllOf(HasSubstr("33 %"), HasSubstr("missing"), HasSubstr("133.")));
}

TEST(RateWatch, AFewLostSamplesAreNoMatterOfRate) {
  EXPECT_THAT(FindingOf(Watch(200.0, 200.0, [](int k) { return k % 20 != 0; })), IsEmpty());
}

TEST(RateWatch, PausesAreNoMatterOfRate) {
  const RateWatch watch = Watch(200.0, 200.0, [](int k) { return k % 200 < 100; });
  EXPECT_THAT(FindingOf(watch), IsEmpty());
  EXPECT_NEAR(*watch.Measured(), 200.0, 1e-4);
}

TEST(RateWatch, JitterOfATenthOfThePeriodIsNoLoss) {
  EXPECT_THAT(FindingOf(Watch(200.0, 200.0, Always, [](int k) { return 0.1 * std::sin(2.4 * k); })),
              IsEmpty());
}

// Four samples at once, stamped on arrival.
TEST(RateWatch, BurstsOfTheRightMeanRateAreTolerated) {
  EXPECT_THAT(FindingOf(Watch(200.0, 200.0, Always, [](int k) { return -0.95 * (k % 4); })),
              IsEmpty());
}

TEST(RateWatch, TooFewIntervalsAreNotJudged) {
  const RateWatch watch = Watch(200.0, 10.0, [](int k) { return k < 15; });
  EXPECT_THAT(FindingOf(watch), IsEmpty());
  EXPECT_FALSE(watch.Measured().has_value());
}

}  // namespace
}  // namespace mlvi
