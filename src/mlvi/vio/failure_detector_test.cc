// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#include "mlvi/vio/failure_detector.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <limits>

#include "mlvi/imu/imu_testing.h"

namespace mlvi {
namespace {

using ::testing::HasSubstr;
using ::testing::IsEmpty;

constexpr double kPeriod = 0.1;  // s, between sets of images

class FailureDetectorTest : public ::testing::Test {
 protected:
  // A window that does well, at set `k`.
  static WindowEstimate Good(int k) {
    WindowEstimate estimate{.solved = true, .features = 80, .imu_chi_square = 15.0};
    estimate.newest.state = mlvi::testing::Walk().State(kPeriod * k);
    estimate.newest.covariance = 1e-4 * Matrix15d::Identity();
    return estimate;
  }
  // Checked against a prediction that agrees.
  std::string Check(const WindowEstimate& estimate) {
    return detector_.Check(estimate, estimate.newest.state);
  }

  FailureConfig config_;
  ImuSpec imu_ = mlvi::testing::TestImu();
  FailureDetector detector_{config_, imu_};
};

TEST_F(FailureDetectorTest, LetsAGoodWindowGoOn) {
  for (int k = 0; k < 50; ++k) EXPECT_THAT(Check(Good(k)), IsEmpty());
}

TEST_F(FailureDetectorTest, NamesWhatFailsAtOnce) {
  WindowEstimate unsolved = Good(0);
  unsolved.solved = false;
  EXPECT_THAT(Check(unsolved), HasSubstr("window of 80 features cannot be solved"));

  WindowEstimate biased = Good(0);
  biased.newest.state.bias.gyroscope.x() =
      1.01 * config_.max_bias_sigmas * imu_.initial_gyroscope_bias_sigma;
  EXPECT_THAT(Check(biased), HasSubstr("rad/s, above 10 times the initial sigmas"));
  biased.newest.state.bias.gyroscope *= 0.98;
  EXPECT_THAT(Check(biased), IsEmpty());

  WindowEstimate vague = Good(0);
  vague.newest.covariance(nav_index::kPosition, nav_index::kPosition) = 60.0 * 60.0;
  EXPECT_THAT(Check(vague), HasSubstr("known to 60.0 m only"));
}

TEST_F(FailureDetectorTest, ComparesWithThePredictionOfTheImu) {
  const WindowEstimate estimate = Good(0);
  const auto predicted = [&](double position, double rotation) {
    NavState state = estimate.newest.state;
    Vector6d step = Vector6d::Zero();
    step[1] = position;
    step[5] = rotation;
    state.T_world_body = BoxPlus(state.T_world_body, step);
    return state;
  };
  EXPECT_THAT(detector_.Check(estimate, predicted(0.49, 0.19)), IsEmpty());
  EXPECT_THAT(detector_.Check(estimate, predicted(0.51, 0.0)), HasSubstr("what the IMU predicts"));
  EXPECT_THAT(detector_.Check(estimate, predicted(0.0, 0.21)), HasSubstr("what the IMU predicts"));
}

TEST_F(FailureDetectorTest, WhateverIsNotANumberFails) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  WindowEstimate estimate = Good(0);
  estimate.newest.state.v_world_body.z() = nan;
  EXPECT_THAT(Check(estimate), HasSubstr("cannot be solved"));
  estimate = Good(0);
  estimate.newest.state.bias.accelerometer.x() = nan;
  EXPECT_THAT(Check(estimate), HasSubstr("cannot be solved"));
  estimate = Good(0);
  estimate.newest.covariance(nav_index::kPosition, nav_index::kPosition) = nan;
  EXPECT_THAT(Check(estimate), HasSubstr("known to nan m"));
}

TEST_F(FailureDetectorTest, BearsWhatMayPassForItsPatienceOnly) {
  const auto few = [](WindowEstimate& estimate) { estimate.features = 5; };
  const auto contradicting = [](WindowEstimate& estimate) { estimate.imu_chi_square = 4000.0; };
  const auto spoil = [&](int k, auto what) {
    WindowEstimate estimate = Good(k);
    what(estimate);
    return Check(estimate);
  };
  // Five sets after a good one lie within 0.5 s, the sixth does not.
  ASSERT_THAT(Check(Good(0)), IsEmpty());
  for (int k = 1; k <= 5; ++k) EXPECT_THAT(spoil(k, few), IsEmpty()) << k;
  EXPECT_THAT(spoil(6, few), HasSubstr("5 features for 0.60 s, below 12"));
  // A good set in between begins the time anew; reasons of both kinds add up.
  ASSERT_THAT(Check(Good(7)), IsEmpty());
  for (int k = 8; k <= 10; ++k) EXPECT_THAT(spoil(k, few), IsEmpty()) << k;
  for (int k = 11; k <= 12; ++k) EXPECT_THAT(spoil(k, contradicting), IsEmpty()) << k;
  EXPECT_THAT(spoil(13, contradicting), HasSubstr("chi square 4000 of 15) for 0.60 s"));
  // So does a new start.
  detector_.Reset();
  for (int k = 14; k <= 19; ++k) EXPECT_THAT(spoil(k, few), IsEmpty()) << k;
  EXPECT_THAT(spoil(20, few), HasSubstr("5 features"));
}

}  // namespace
}  // namespace mlvi
