// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#include "mlvi/factors/map_step_factor.h"

#include <gtest/gtest.h>

#include "mlvi/factors/factor_testing.h"

namespace mlvi {
namespace {

Pose3 RandomPose(double scale) { return ExpSe3(scale * Vector6d::Random()); }

std::vector<FactorBlock> Blocks(const std::vector<Pose3>& poses) {
  static const PoseManifold manifold;
  std::vector<FactorBlock> blocks(poses.size(), {Eigen::VectorXd(kPoseBlockSize), &manifold});
  for (std::size_t i = 0; i < poses.size(); ++i) StorePose(poses[i], blocks[i].value.data());
  return blocks;
}

Vector6d Residual(const MapStepFactor& factor, const std::vector<Pose3>& poses) {
  Eigen::VectorXd residual;
  EXPECT_TRUE(internal::EvaluateFactor(factor, Blocks(poses), &residual, nullptr));
  return residual;
}

TEST(MapStepFactor, JacobiansAreCorrectAlsoFarFromTheOdometry) {
  for (const double noise : {0.0, 1e-7, 1e-3, 0.1, 1.0}) {
    for (int i = 0; i < 20; ++i) {
      const Pose3 map_i = RandomPose(1.0), T_i_j = RandomPose(1.0);
      const Pose3 body_i = map_i * RandomPose(noise);
      const Pose3 map_j = map_i * RandomPose(noise) * T_i_j;
      const Matrix6d W = Matrix6d::Identity() + 0.3 * Matrix6d::Random();
      const MapStepFactor factor(T_i_j, 0.4, W);
      EXPECT_TRUE(JacobiansAreCorrect(factor, Blocks({map_i, body_i, map_j}))) << "noise " << noise;
    }
  }
}

// As much of the map follows the body as was made there; the motion to j is the odometry's, in any
// frame.
TEST(MapStepFactor, VanishesWhereTheShareOfTheMapHasFollowedTheBody) {
  for (const double share : {0.0, 0.3, 1.0}) {
    const Pose3 map_i = RandomPose(2.0), T_i_j = RandomPose(2.0);
    const Vector6d off = 0.1 * Vector6d::Random();
    const Pose3 body_i = map_i * ExpSe3(off), map_j = map_i * ExpSe3(share * off) * T_i_j;
    const Pose3 world = RandomPose(2.0);
    const MapStepFactor factor(T_i_j, share, Matrix6d::Identity());
    EXPECT_LT(Residual(factor, {map_i, body_i, map_j}).norm(), 1e-12);
    const Pose3 elsewhere = map_j * RandomPose(0.1);
    const Vector6d residual = Residual(factor, {map_i, body_i, elsewhere});
    EXPECT_GT(residual.norm(), 0.01);
    EXPECT_LT(
        (residual - Residual(factor, {world * map_i, world * body_i, world * elsewhere})).norm(),
        1e-12);
  }
}

}  // namespace
}  // namespace mlvi
