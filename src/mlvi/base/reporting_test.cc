// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
//
// Stage times, the progress bar and errors: what users come to see.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdio>
#include <memory>
#include <thread>

#include "mlvi/base/error.h"
#include "mlvi/base/progress.h"
#include "mlvi/base/stage_times.h"

namespace mlvi {
namespace {

using ::testing::HasSubstr;

TEST(StageTimes, SummariseByStage) {
  StageTimes times;
  for (int i = 100; i >= 1; --i) times.Record("deskew", i);
  times.Record("map", 2.5);
  const auto summary = times.Summarize();
  ASSERT_EQ(summary.size(), 2U);
  const StageTimes::Statistics& s = summary.at("deskew");
  EXPECT_EQ(s.count, 100U);
  EXPECT_DOUBLE_EQ(s.mean_ms, 50.5);
  EXPECT_EQ(s.p50_ms, 50.0);
  EXPECT_EQ(s.p95_ms, 95.0);
  EXPECT_EQ(s.p99_ms, 99.0);
  EXPECT_EQ(s.max_ms, 100.0);
  const StageTimes::Statistics& one = summary.at("map");
  EXPECT_EQ(one.p50_ms, 2.5);
  EXPECT_EQ(one.p99_ms, 2.5);
  EXPECT_TRUE(StageTimes().Summarize().empty());
}

TEST(StageTimes, ScopeMeasuresWallTime) {
  StageTimes times;
  {
    const StageTimes::Scope scope(times, "sleep");
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
  }
  const auto s = times.Summarize().at("sleep");
  EXPECT_EQ(s.count, 1U);
  EXPECT_GE(s.max_ms, 20.0);
}

class ProgressLog : public ::testing::Test {
 protected:
  std::string Text() const {
    std::fflush(file_.get());
    std::rewind(file_.get());
    std::string text(10'000, '\0');
    text.resize(std::fread(text.data(), 1, text.size(), file_.get()));
    return text;
  }
  struct Closer {
    void operator()(std::FILE* file) const { std::fclose(file); }
  };
  std::unique_ptr<std::FILE, Closer> file_{std::tmpfile()};
};

TEST_F(ProgressLog, IsOnePlainLinePerTenPercent) {
  {
    ProgressBar bar("reading", file_.get());
    for (int i = 0; i <= 1000; ++i) bar.Update(i / 1000.0, "note");
    bar.Finish();
    bar.Finish();
    bar.Update(0.5);  // nothing after the end
  }
  const std::string text = Text();
  EXPECT_EQ(std::count(text.begin(), text.end(), '\n'), 11) << text;
  EXPECT_EQ(text.find('\r'), std::string::npos);
  EXPECT_EQ(text.find('\033'), std::string::npos);
  for (const char* part : {"reading: 0 %", "reading: 50 %", "reading: 100 %", "note"})
    EXPECT_THAT(text, HasSubstr(part));
}

TEST_F(ProgressLog, FinishSaysHundredPercentOnce) {
  ProgressBar bar("writing", file_.get());
  bar.Update(0.42);
  bar.Update(0.1);  // progress never runs backwards in a log
  bar.Update(7.0);  // clamped
  bar.Finish();
  const std::string text = Text();
  EXPECT_EQ(std::count(text.begin(), text.end(), '\n'), 2) << text;
  EXPECT_THAT(text, HasSubstr("42 %"));
  EXPECT_THAT(text, HasSubstr("100 %"));
}

TEST(ProgressBar, IsSilentWithoutAStream) {
  ProgressBar bar("nothing", nullptr);
  bar.Update(0.5);
  bar.Finish();
}

TEST(Error, ChecksThrowWithPlaceAndValues) {
  try {
    MLVI_CHECK(1 + 1 == 3, "sum is {}", 1 + 1);
    FAIL();
  } catch (const ContractViolation& violation) {
    EXPECT_THAT(violation.what(), HasSubstr("reporting_test.cc"));
    EXPECT_THAT(violation.what(), HasSubstr("1 + 1 == 3"));
    EXPECT_THAT(violation.what(), HasSubstr("sum is 2"));
  }
  EXPECT_NO_THROW(MLVI_CHECK(true, "never"));
  const Expected<int> failed = MakeError(ErrorKind::kInput, "found {} of {}", 3, 4);
  EXPECT_EQ(failed.error().message, "found 3 of 4");
}

}  // namespace
}  // namespace mlvi
