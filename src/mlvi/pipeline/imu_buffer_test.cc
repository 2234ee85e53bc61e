// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#include "mlvi/pipeline/imu_buffer.h"

#include <gtest/gtest.h>

namespace mlvi {
namespace {

constexpr double kRate = 200.0;

ImuSample SampleAt(double t) {
  return {
      .stamp = Time::FromSeconds(t), .angular_velocity = {t, 0.0, 0.0}, .linear_acceleration = {}};
}

TEST(ImuBuffer, IsBoundedThoughNobodyTrimsIt) {
  ImuBuffer buffer(Duration::FromSeconds(10.0));
  std::size_t most = 0;
  for (int k = 0; k < 100'000; ++k) {
    buffer.Add(SampleAt(k / kRate));
    most = std::max(most, buffer.size());
  }
  EXPECT_LE(most, 2001U + 1024U);  // ten seconds, and what is not yet worth erasing
  const double newest = 99'999 / kRate;
  const auto window = buffer.Between(Time::FromSeconds(newest - 9.9), Time::FromSeconds(newest));
  EXPECT_EQ(window.size(), 1981U);
}

TEST(ImuBuffer, WindowsAreInterpolatedAtBothEnds) {
  ImuBuffer buffer(Duration::FromSeconds(10.0));
  for (int k = 0; k < 5000; ++k) buffer.Add(SampleAt(k / kRate));
  const Time from = Time::FromSeconds(20.0012), to = Time::FromSeconds(20.1031);
  const auto window = buffer.Between(from, to);
  EXPECT_EQ(window.front().stamp, from);
  EXPECT_EQ(window.back().stamp, to);
  for (const ImuSample& sample : window) {
    EXPECT_NEAR(sample.angular_velocity.x(), sample.stamp.seconds(), 1e-6);
  }
}

}  // namespace
}  // namespace mlvi
