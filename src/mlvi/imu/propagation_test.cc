// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#include "mlvi/imu/propagation.h"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>

#include "mlvi/base/error.h"
#include "mlvi/imu/imu_testing.h"
#include "mlvi/imu/preintegration.h"

namespace mlvi {
namespace {

using testing::AddImuNoise;
using testing::kGravity;
using testing::TestImu;
using testing::Walk;

NavState StartState() {
  NavState start = Walk().State(0.0);
  start.bias = {.accelerometer = {0.1, -0.05, 0.02}, .gyroscope = {0.01, 0.02, -0.01}};
  return start;
}

TEST(PropagationTest, EqualsPredictionByPreintegration) {
  const auto samples = Walk().Samples(0.0, 1.0, 200.0);
  const NavState start = StartState();
  const auto propagation = Propagate(start, Matrix15d::Zero(), samples, TestImu(), kGravity);
  ASSERT_EQ(propagation.states.size(), samples.size());
  for (const std::size_t k : {1U, 60U, 200U}) {
    const auto delta = Preintegrate(std::span(samples).first(k + 1), start.bias, TestImu());
    EXPECT_LT(BoxMinus(Predict(start, delta, kGravity), propagation.states[k]).norm(), 1e-11);
    EXPECT_EQ(propagation.states[k].stamp, samples[k].stamp);
  }
  // From an exact start, the covariance is the preintegrated one turned into the world.
  const auto delta = Preintegrate(samples, start.bias, TestImu());
  Matrix15d turn = Matrix15d::Identity();
  turn.block<3, 3>(0, 0) = turn.block<3, 3>(3, 3) = start.T_world_body.R();
  EXPECT_LT((turn * delta.covariance * turn.transpose() - propagation.covariance).norm(),
            1e-9 * delta.covariance.norm());
}

TEST(PropagationTest, OneSampleKeepsTheStart) {
  const auto samples = Walk().Samples(0.0, 0.0, 200.0);
  const Matrix15d covariance = 2.0 * Matrix15d::Identity();
  const auto propagation = Propagate(StartState(), covariance, samples, TestImu(), kGravity);
  ASSERT_EQ(propagation.states.size(), 1U);
  EXPECT_EQ(propagation.covariance, covariance);
  EXPECT_EQ(propagation.transition, Matrix15d(Matrix15d::Identity()));
}

TEST(PropagationTest, TransitionMatchesNumericDifferentiation) {
  const auto samples = Walk().Samples(0.0, 0.5, 200.0);
  const NavState start = StartState();
  const auto end = [&](const NavState& state) {
    return Propagate(state, Matrix15d::Zero(), samples, TestImu(), kGravity).states.back();
  };
  const auto propagation = Propagate(start, Matrix15d::Zero(), samples, TestImu(), kGravity);
  constexpr double kStep = 1e-5;
  for (int i = 0; i < 15; ++i) {
    const Vector15d d = kStep * Vector15d::Unit(i);
    const Vector15d numeric = (BoxMinus(end(BoxPlus(start, d)), propagation.states.back()) -
                               BoxMinus(end(BoxPlus(start, -d)), propagation.states.back())) /
                              (2.0 * kStep);
    EXPECT_LT((propagation.transition.col(i) - numeric).norm(), 1e-7) << "component " << i;
  }
}

TEST(PropagationTest, CovarianceMatchesMonteCarlo) {
  const ImuSpec imu = TestImu();
  const auto clean = Walk().Samples(0.0, 0.5, imu.rate_hz);
  const NavState true_start = StartState();
  Vector15d sigma;
  sigma << Eigen::Vector3d::Constant(0.02), Eigen::Vector3d::Constant(0.03),
      Eigen::Vector3d::Constant(0.005), Eigen::Vector3d::Constant(0.05),
      Eigen::Vector3d::Constant(0.002);
  const Matrix15d covariance = sigma.cwiseAbs2().asDiagonal();
  NavState unbiased = true_start;
  unbiased.bias = ImuBias();
  const NavState true_end = Propagate(unbiased, covariance, clean, imu, kGravity).states.back();
  constexpr int kTrials = 500;
  RandomStream random(11, "propagation");
  double nees = 0.0;
  for (int trial = 0; trial < kTrials; ++trial) {
    Vector15d error;
    for (int i = 0; i < 15; ++i) error(i) = sigma(i) * random.Normal();
    auto noisy = clean;
    NavState truth = true_end;
    truth.bias = AddImuNoise(imu, true_start.bias, random, noisy);
    const auto propagation =
        Propagate(BoxPlus(true_start, -error), covariance, noisy, imu, kGravity);
    const Vector15d end_error = BoxMinus(truth, propagation.states.back());
    nees += end_error.dot(propagation.covariance.llt().solve(end_error)) / kTrials;
  }
  EXPECT_NEAR(nees, 15.0, 4.0 * std::sqrt(2.0 * 15.0 / kTrials));
}

TEST(PropagationTest, StartMustLieOnTheFirstSample) {
  NavState start = StartState();
  start.stamp = start.stamp + Duration::FromMilliseconds(1);
  EXPECT_THROW(
      Propagate(start, Matrix15d::Zero(), Walk().Samples(0.0, 0.1, 200.0), TestImu(), kGravity),
      ContractViolation);
}

TEST(InterpolatePoseTest, FollowsTheWalkBetweenStatesAndClampsOutside) {
  const Walk walk;
  std::vector<NavState> states;
  for (int k = 0; k <= 20; ++k) states.push_back(walk.State(0.01 * k));
  for (double t = 0.0; t < 0.2; t += 0.0013) {
    const Vector6d error =
        BoxMinus(InterpolatePose(states, Walk::At(t)), walk.State(t).T_world_body);
    EXPECT_LT(error.head<3>().norm(), 1e-6);  // fourth derivative of the walk x dt^4 / 384
    EXPECT_LT(error.tail<3>().norm(), 5e-4);  // angular acceleration x dt^2 / 8
  }
  EXPECT_EQ(InterpolatePose(states, Walk::At(-1.0)).translation(),
            states.front().T_world_body.translation());
  EXPECT_EQ(InterpolatePose(states, Walk::At(9.0)).translation(),
            states.back().T_world_body.translation());
  EXPECT_LT(BoxMinus(InterpolatePose(states, states[7].stamp), states[7].T_world_body).norm(),
            1e-15);
}

}  // namespace
}  // namespace mlvi
