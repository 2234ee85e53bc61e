// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#include "mlvi/factors/prior_factor.h"

#include <gtest/gtest.h>

#include "mlvi/base/error.h"
#include "mlvi/base/random.h"
#include "mlvi/factors/factor_testing.h"

namespace mlvi {
namespace {

TEST(PosePriorFactor, JacobianIsCorrect) {
  RandomStream random(1, "prior");
  const PoseManifold manifold;
  const auto draw = [&](double scale) {
    Vector6d v;
    for (double& x : v) x = scale * random.Normal();
    return v;
  };
  for (const double noise : {0.0, 1e-7, 1e-3, 0.1, 1.0}) {
    for (int i = 0; i < 20; ++i) {
      const Pose3 prior = ExpSe3(draw(2.0));
      FactorBlock block{Eigen::VectorXd(kPoseBlockSize), &manifold};
      StorePose(prior * ExpSe3(draw(noise)), block.value.data());
      Matrix6d W;
      for (double& x : W.reshaped()) x = random.Normal();
      EXPECT_TRUE(JacobiansAreCorrect(PosePriorFactor(prior, W), {block}));
    }
  }
}

TEST(VectorPriorFactor, WeighsTheDifference) {
  const Eigen::Vector3d mean(1.0, -2.0, 3.0), x(2.0, 0.0, 0.0);
  Eigen::MatrixXd W(2, 3);
  W << 1.0, 2.0, 3.0, 0.0, -1.0, 4.0;
  const VectorPriorFactor factor(mean, W);
  EXPECT_TRUE(JacobiansAreCorrect(factor, {{x, nullptr}}));
  Eigen::VectorXd residual;
  ASSERT_TRUE(internal::EvaluateFactor(factor, {{x, nullptr}}, &residual, nullptr));
  EXPECT_EQ(residual, Eigen::VectorXd(W * (x - mean)));
  EXPECT_THROW(VectorPriorFactor(mean, Eigen::MatrixXd::Identity(2, 2)), ContractViolation);
}

}  // namespace
}  // namespace mlvi
