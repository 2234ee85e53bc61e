// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#include "mlvi/base/time.h"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include "mlvi/base/id.h"

namespace mlvi {
namespace {

RC_GTEST_PROP(Time, PrintedTimesReadBackExactly, (std::int64_t bits)) {
  constexpr std::int64_t bound = 9'223'372'036'000'000'000;
  const Time time = Time::FromNanoseconds(bits % bound);
  RC_ASSERT(ParseTime(ToString(time)) == time);
}

TEST(Time, PrintsNineDecimals) {
  EXPECT_EQ(ToString(Time::FromNanoseconds(1625132069158812160)), "1625132069.158812160");
  EXPECT_EQ(ToString(Time::FromNanoseconds(0)), "0.000000000");
  EXPECT_EQ(ToString(Time::FromNanoseconds(5)), "0.000000005");
  EXPECT_EQ(ToString(Time::FromNanoseconds(-5)), "-0.000000005");
  EXPECT_EQ(ToString(Time::FromNanoseconds(-1'500'000'000)), "-1.500000000");
  EXPECT_EQ(ToString(Time()), "invalid");
}

TEST(Time, ReadsWhatTrajectoryFilesHold) {
  const auto ns = [](const char* text) { return ParseTime(text).nanoseconds(); };
  EXPECT_EQ(ns("1305031102.175304"), 1305031102175304000);
  EXPECT_EQ(ns("1403715529.1121435175"), 1403715529112143517);  // more than nine decimals are cut
  EXPECT_EQ(ns("12"), 12'000'000'000);
  EXPECT_EQ(ns("12."), 12'000'000'000);
  EXPECT_EQ(ns("-0.25"), -250'000'000);
  EXPECT_EQ(ns("1.5e1"), 15'000'000'000);
  // As numpy writes stamps: a double, good to 0.12 us at Unix times.
  EXPECT_NEAR(static_cast<double>(ns("1.403715529112143517e+09") - 1403715529112143517), 0.0,
              240.0);
}

TEST(Time, RefusesWhatIsNoTime) {
  for (const char* text : {"", "-", ".", "abc", "1.5x", "1,5", "nan", "inf", "1e30",
                           "1403715529112143517", "0x10s", "1 2", "9999999999", "-9999999999.5"}) {
    EXPECT_FALSE(ParseTime(text).valid()) << text;
  }
  EXPECT_FALSE(Time().valid());
}

RC_GTEST_PROP(Time, DifferencesAreExact, (std::int32_t a, std::int32_t b)) {
  const Time base = Time::FromNanoseconds(1'700'000'000'000'000'000);
  const Time s = base + Duration::FromNanoseconds(a), t = base + Duration::FromNanoseconds(b);
  RC_ASSERT((s - t).nanoseconds() == std::int64_t{a} - b);
  RC_ASSERT(t + (s - t) == s);
  RC_ASSERT(s - (s - t) == t);
  RC_ASSERT((s < t) == (a < b));
}

TEST(Duration, RoundsToTheNearestNanosecond) {
  EXPECT_EQ(Duration::FromSeconds(1.4e-9).nanoseconds(), 1);
  EXPECT_EQ(Duration::FromSeconds(-1.6e-9).nanoseconds(), -2);
  EXPECT_EQ(Duration::FromSeconds(0.1).nanoseconds(), 100'000'000);
  EXPECT_EQ(Duration::FromMilliseconds(3), Duration::FromSeconds(0.003));
  EXPECT_DOUBLE_EQ(Duration::FromNanoseconds(250'000'000).seconds(), 0.25);
  EXPECT_EQ((-Duration::FromMilliseconds(3)).nanoseconds(), -3'000'000);
}

TEST(Id, IsInvalidUntilGiven) {
  using TestId = Id<struct TestTag>;
  EXPECT_FALSE(TestId().valid());
  EXPECT_TRUE(TestId(0).valid());
  EXPECT_LT(TestId(1), TestId(2));
  EXPECT_EQ(std::hash<TestId>()(TestId(7)), std::hash<TestId>()(TestId(7)));
}

}  // namespace
}  // namespace mlvi
