// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#include "mlvi/factors/point_factors.h"

#include <gtest/gtest.h>

#include "mlvi/base/error.h"
#include "mlvi/base/random.h"
#include "mlvi/factors/factor_testing.h"

namespace mlvi {
namespace {

const PoseManifold kPoseManifold;

Eigen::Vector3d RandomVector(RandomStream& random, double sigma) {
  return sigma * Eigen::Vector3d(random.Normal(), random.Normal(), random.Normal());
}

Pose3 RandomPose(RandomStream& random) {
  return Pose3(ExpSo3(RandomVector(random, 1.5)), RandomVector(random, 5.0));
}

FactorBlock PoseBlock(const Pose3& pose) {
  Eigen::VectorXd value(kPoseBlockSize);
  StorePose(pose, value.data());
  return {value, &kPoseManifold};
}

Eigen::VectorXd Residuals(const ceres::CostFunction& factor, const Pose3& pose) {
  Eigen::VectorXd residuals;
  EXPECT_TRUE(internal::EvaluateFactor(factor, {PoseBlock(pose)}, &residuals, nullptr));
  return residuals;
}

TEST(PointFactorsTest, JacobiansAreCorrect) {
  RandomStream random(1, "points");
  for (int trial = 0; trial < 30; ++trial) {
    const Eigen::Vector3d p = RandomVector(random, 5.0), a = RandomVector(random, 5.0);
    const Eigen::Vector3d n = RandomVector(random, 1.0).normalized();
    const FactorBlock pose = PoseBlock(RandomPose(random));
    EXPECT_TRUE(JacobiansAreCorrect(PointToPlaneFactor(p, n, -n.dot(a), 0.5), {pose}));
    EXPECT_TRUE(JacobiansAreCorrect(PointToLineFactor(p, a, n, 0.5), {pose}));
  }
}

TEST(PointFactorsTest, ResidualsAreDistancesOverSigma) {
  RandomStream random(2, "points");
  for (int trial = 0; trial < 30; ++trial) {
    const Eigen::Vector3d p = RandomVector(random, 5.0), a = RandomVector(random, 5.0);
    const Eigen::Vector3d n = RandomVector(random, 1.0).normalized();
    const Pose3 pose = RandomPose(random);
    const Eigen::Vector3d offset = pose * p - a;
    EXPECT_NEAR(Residuals(PointToPlaneFactor(p, n, -n.dot(a), 0.02), pose)(0), n.dot(offset) / 0.02,
                1e-9);
    EXPECT_NEAR(Residuals(PointToLineFactor(p, a, n, 0.02), pose).norm(),
                n.cross(offset).norm() / 0.02, 1e-9);
    // A point on the feature has no residual, wherever along it.
    const Eigen::Vector3d on_line = pose.inverse() * (a + 3.0 * n);
    EXPECT_LT(Residuals(PointToLineFactor(on_line, a, n, 1.0), pose).norm(), 1e-12);
    const Eigen::Vector3d on_plane = pose.inverse() * (a + 3.0 * n.unitOrthogonal());
    EXPECT_LT(Residuals(PointToPlaneFactor(on_plane, n, -n.dot(a), 1.0), pose).norm(), 1e-12);
  }
}

TEST(PointFactorsTest, BrokenContractsThrow) {
  const Eigen::Vector3d p(1.0, 2.0, 3.0), n(0.0, 0.0, 1.0);
  EXPECT_THROW(PointToPlaneFactor(p, 2.0 * n, 0.0, 0.1), ContractViolation);
  EXPECT_THROW(PointToPlaneFactor(p, n, 0.0, 0.0), ContractViolation);
  EXPECT_THROW(PointToLineFactor(p, p, 0.5 * n, 0.1), ContractViolation);
}

}  // namespace
}  // namespace mlvi
