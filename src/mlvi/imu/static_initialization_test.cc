// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/Cholesky>

#include "mlvi/imu/imu_testing.h"
#include "mlvi/imu/initialization.h"
#include "mlvi/imu/levelling.h"

namespace mlvi {
namespace {

using testing::AddImuNoise;
using testing::kGravity;
using testing::NormalVector;
using testing::TestImu;
using testing::Walk;

std::vector<ImuSample> RestingSamples(const Eigen::Quaterniond& R_world_body, double seconds) {
  const Eigen::Vector3d force = R_world_body.conjugate() * Eigen::Vector3d(0.0, 0.0, kGravity);
  std::vector<ImuSample> samples;
  for (int k = 0; k <= std::lround(200.0 * seconds); ++k) {
    samples.push_back({Walk::At(k / 200.0), Eigen::Vector3d::Zero(), force});
  }
  return samples;
}

TEST(StaticInitializationTest, LevelsEveryAttitude) {
  RandomStream random(3, "attitudes");
  for (int trial = 0; trial < 50; ++trial) {
    const Eigen::Quaterniond R = ExpSo3(NormalVector(random, 2.0));
    const auto start = InitializeAtRest(RestingSamples(R, 1.0), TestImu(), kGravity);
    ASSERT_TRUE(start.has_value());
    ASSERT_EQ(start->states.size(), 2U);
    const NavState& state = start->states.back();
    EXPECT_EQ(state.stamp, Walk::At(1.0));
    EXPECT_EQ(start->method, "static");
    const Eigen::Vector3d up = R.conjugate() * Eigen::Vector3d::UnitZ();
    EXPECT_LT((state.T_world_body.rotation() * up - Eigen::Vector3d::UnitZ()).norm(), 1e-9);
    EXPECT_NEAR(Heading(up).Of(state.T_world_body.R()), 0.0, 1e-12);
    EXPECT_EQ(state.T_world_body.translation(), Eigen::Vector3d(Eigen::Vector3d::Zero()));
    EXPECT_EQ(start->covariance.llt().info(), Eigen::Success);
  }
}

TEST(StaticInitializationTest, ErrorsAreConsistentWithTheCovariance) {
  const ImuSpec imu = TestImu();
  constexpr int kTrials = 500;
  RandomStream random(5, "rest");
  double nees = 0.0;
  for (int trial = 0; trial < kTrials; ++trial) {
    Eigen::Vector3d up = NormalVector(random, 1.0).normalized();
    // Where the definition of heading changes from one axis to the other, truth and estimate may
    // fall on either side.
    while (std::abs(std::abs(up.x()) - 0.9) < 0.05) up = NormalVector(random, 1.0).normalized();
    NavState truth;
    truth.T_world_body = Pose3(LevelRotation(up), Eigen::Vector3d::Zero());
    auto samples = RestingSamples(truth.T_world_body.rotation(), 1.0);
    truth.bias =
        AddImuNoise(imu,
                    {.accelerometer = NormalVector(random, imu.initial_accelerometer_bias_sigma),
                     .gyroscope = NormalVector(random, imu.initial_gyroscope_bias_sigma)},
                    random, samples);
    std::string why;
    const auto start = InitializeAtRest(samples, imu, kGravity, &why);
    ASSERT_TRUE(start.has_value()) << why;
    const Vector15d error = BoxMinus(truth, start->states.back());
    // Position, velocity and heading are given by definition: eight degrees of freedom are random.
    nees += error.dot(start->covariance.llt().solve(error)) / kTrials;
  }
  // The variance of the means is the larger of the specified and the sampled one, so the covariance
  // errs a little on the large side.
  EXPECT_LT(nees, 8.0 + 4.0 * std::sqrt(2.0 * 8.0 / kTrials));
  EXPECT_GT(nees, 7.0 - 4.0 * std::sqrt(2.0 * 8.0 / kTrials));
}

TEST(StaticInitializationTest, FindsTheGyroscopeBias) {
  const ImuSpec imu = TestImu();
  auto samples = RestingSamples(Eigen::Quaterniond::Identity(), 2.0);
  RandomStream random(1, "bias");
  const Eigen::Vector3d bias(0.01, -0.015, 0.02);
  AddImuNoise(imu, {.accelerometer = Eigen::Vector3d::Zero(), .gyroscope = bias}, random, samples);
  const auto start = InitializeAtRest(samples, imu, kGravity);
  ASSERT_TRUE(start.has_value());
  EXPECT_LT((start->states.back().bias.gyroscope - bias).norm(), 5.0 * imu.noise.gyroscope_density);
  EXPECT_EQ(start->states.back().bias.accelerometer, Eigen::Vector3d(Eigen::Vector3d::Zero()));
}

// Why `samples` are refused; fails the test when they are not.
std::string Refusal(std::span<const ImuSample> samples) {
  std::string why;
  EXPECT_FALSE(InitializeAtRest(samples, TestImu(), kGravity, &why).has_value());
  return why;
}

TEST(StaticInitializationTest, SeesMotion) {
  EXPECT_THAT(Refusal(Walk().Samples(0.0, 2.0, 200.0)),
              ::testing::HasSubstr("rate of turn varies"));
  // A walk at a steady heading without sway: only the accelerometer shows it.
  Walk plain;
  plain.yaw_rate = 0.0;
  plain.sway_amplitude.setZero();
  EXPECT_THAT(Refusal(plain.Samples(0.0, 2.0, 200.0)), ::testing::HasSubstr("acceleration varies"));
  // A turntable: nothing varies, but no bias is that large.
  plain.yaw_rate = 0.3;
  plain.velocity.setZero();
  plain.position_amplitude.setZero();
  EXPECT_THAT(Refusal(plain.Samples(0.0, 2.0, 200.0)), ::testing::HasSubstr("mean rate of turn"));
  // Setting off at a constant 0.25 m/s^2 half way.
  auto starting = RestingSamples(Eigen::Quaterniond::Identity(), 1.0);
  for (std::size_t k = starting.size() / 2; k < starting.size(); ++k)
    starting[k].linear_acceleration.x() += 0.25;
  EXPECT_THAT(Refusal(starting), ::testing::HasSubstr("drifts"));
}

TEST(StaticInitializationTest, RefusesWrongUnitsAndTooLittleData) {
  auto samples = RestingSamples(Eigen::Quaterniond::Identity(), 1.0);
  EXPECT_THAT(Refusal(std::span(samples).first(80)), ::testing::HasSubstr("too short"));
  EXPECT_THAT(Refusal(std::span(samples).first(5)), ::testing::HasSubstr("too few"));
  for (ImuSample& sample : samples) sample.linear_acceleration /= 9.81;
  EXPECT_THAT(Refusal(samples), ::testing::HasSubstr("unit"));
}

TEST(HeadingTest, DerivativeMatchesNumericDifferentiation) {
  RandomStream random(9, "heading");
  for (int trial = 0; trial < 50; ++trial) {
    const Eigen::Quaterniond R = ExpSo3(NormalVector(random, 2.0));
    const Heading heading(R.conjugate() * Eigen::Vector3d::UnitZ());
    for (int i = 0; i < 3; ++i) {
      const Eigen::Quaterniond d = ExpSo3(1e-6 * Eigen::Vector3d::Unit(i));
      const double plus = heading.Of((R * d).toRotationMatrix());
      const double minus = heading.Of((R * d.conjugate()).toRotationMatrix());
      EXPECT_NEAR(std::remainder(plus - minus, 2.0 * M_PI) / 2e-6,
                  heading.Derivative(R.toRotationMatrix())(i), 1e-6);
    }
  }
}

}  // namespace
}  // namespace mlvi
