// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#include "mlvi/pipeline/imu_watch.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

namespace mlvi {
namespace {

using ::testing::HasSubstr;

constexpr double kGravity = 9.81;

// Ten seconds at 100 Hz; `change` alters each sample of an IMU that swings about its x axis.
template <typename Change>
std::vector<Health> FindingsOf(const Change& change) {
  ImuSpec spec;
  spec.rate_hz = 100.0;
  ImuWatch watch(spec, kGravity);
  for (int k = 0; k < 1000; ++k) {
    const double t = 0.01 * k;
    ImuSample sample{.stamp = Time::FromSeconds(50.0 + t),
                     .angular_velocity = {0.3 * std::cos(t), 0.01 * std::sin(90.0 * t), 0.0},
                     .linear_acceleration = {0.1 * std::sin(70.0 * t), 3.0 * std::sin(t), 9.3}};
    change(k, sample);
    watch.Observe(sample);
  }
  return watch.Findings();
}

void ExpectOne(const std::vector<Health>& findings, HealthLevel level, const std::string& word) {
  ASSERT_EQ(findings.size(), 1U);
  EXPECT_EQ(findings[0].level, level);
  EXPECT_THAT(findings[0].reason, HasSubstr(word));
}

TEST(ImuWatch, AGoodImuGivesNoFindings) {
  EXPECT_TRUE(FindingsOf([](int, ImuSample&) {}).empty());
}

TEST(ImuWatch, AccelerationWithoutGravityIsAFailure) {
  const auto findings =
      FindingsOf([](int, ImuSample& s) { s.linear_acceleration.z() -= kGravity; });
  ExpectOne(findings, HealthLevel::kFailed, "specific force");
}

TEST(ImuWatch, AScaleThatGravityContradictsDegrades) {
  for (const double scale : {0.8, 2.0}) {
    const auto findings = FindingsOf([&](int, ImuSample& s) { s.linear_acceleration *= scale; });
    ExpectOne(findings, HealthLevel::kDegraded, "acceleration_unit");
  }
}

TEST(ImuWatch, ADeadGyroscopeIsAFailure) {
  const auto findings = FindingsOf([](int, ImuSample& s) { s.angular_velocity.setZero(); });
  ExpectOne(findings, HealthLevel::kFailed, "gyroscope");
}

TEST(ImuWatch, AnAccelerometerFilledUpToTheRateOfTheGyroscopeDegrades) {
  Eigen::Vector3d held = Eigen::Vector3d::Zero();
  const auto findings = FindingsOf([&](int k, ImuSample& s) {
    if (k % 3 == 0) held = s.linear_acceleration;
    s.linear_acceleration = held;
  });
  ExpectOne(findings, HealthLevel::kDegraded, "67 %");
}

TEST(ImuWatch, SaturationDegrades) {
  const auto findings = FindingsOf([](int k, ImuSample& s) {
    if (k == 500) s.linear_acceleration.x() = 150.0;
  });
  ExpectOne(findings, HealthLevel::kDegraded, "1 samples at saturation");
}

}  // namespace
}  // namespace mlvi
