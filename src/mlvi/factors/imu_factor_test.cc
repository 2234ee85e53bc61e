// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#include "mlvi/factors/imu_factor.h"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>

#include "mlvi/factors/factor_testing.h"
#include "mlvi/imu/imu_residual.h"
#include "mlvi/imu/imu_testing.h"

namespace mlvi {
namespace {

using testing::kGravity;
using testing::TestImu;
using testing::Walk;

const PoseManifold kPoseManifold;

PreintegratedImu Motion() {
  const ImuBias bias{.accelerometer = {0.05, -0.08, 0.1}, .gyroscope = {0.01, -0.02, 0.015}};
  return Preintegrate(Walk().Samples(0.0, 0.5, 200.0), bias, TestImu());
}

std::vector<FactorBlock> Blocks(const NavState& first, const NavState& second) {
  std::vector<FactorBlock> blocks;
  for (const NavState& state : {first, second}) {
    Eigen::VectorXd pose(7), bias(6);
    StorePose(state.T_world_body, pose.data());
    bias << state.bias.accelerometer, state.bias.gyroscope;
    blocks.push_back({pose, &kPoseManifold});
    blocks.push_back({Eigen::VectorXd(state.v_world_body)});
    blocks.push_back({bias});
  }
  return blocks;
}

NavState Disturbed(const NavState& state, double scale, RandomStream& random) {
  Vector15d d;
  for (int i = 0; i < 15; ++i) d(i) = (i < 9 ? scale : 0.1 * scale) * random.Normal();
  return BoxPlus(state, d);
}

TEST(ImuFactorTest, JacobiansAreCorrect) {
  RandomStream random(4, "imu factor");
  // A covariance of order one in place of the sensor's, so that residuals and Jacobians are of
  // order one as well.
  PreintegratedImu motion = Motion();
  motion.covariance = Matrix15d::Identity() + 0.01 * Motion().covariance;
  const ImuFactor factor(motion, kGravity);
  for (int trial = 0; trial < 20; ++trial) {
    const NavState first = Disturbed(Walk().State(0.0), 0.3, random);
    const NavState second = Disturbed(Walk().State(0.5), 0.3, random);
    EXPECT_TRUE(JacobiansAreCorrect(factor, Blocks(first, second)));
  }
}

TEST(ImuFactorTest, JacobiansAreCorrectWithTheSensorsCovariance) {
  RandomStream random(5, "imu factor");
  const ImuFactor factor(Motion(), kGravity);
  for (int trial = 0; trial < 5; ++trial) {
    const NavState first = Disturbed(Walk().State(0.0), 1e-3, random);
    const NavState second = Disturbed(Walk().State(0.5), 1e-3, random);
    EXPECT_TRUE(JacobiansAreCorrect(factor, Blocks(first, second)));
  }
}

TEST(ImuFactorTest, CostIsTheMahalanobisDistance) {
  RandomStream random(6, "imu factor");
  const PreintegratedImu motion = Motion();
  const NavState first = Disturbed(Walk().State(0.0), 0.01, random);
  const NavState second = Disturbed(Walk().State(0.5), 0.01, random);
  Eigen::VectorXd residuals;
  ASSERT_TRUE(internal::EvaluateFactor(ImuFactor(motion, kGravity), Blocks(first, second),
                                       &residuals, nullptr));
  const Vector15d r = EvaluateImuResidual(first, second, motion, kGravity).value;
  const double expected = r.dot(motion.covariance.llt().solve(r));
  EXPECT_NEAR(residuals.squaredNorm(), expected, 1e-6 * expected);
}

}  // namespace
}  // namespace mlvi
