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

TEST(NavPriorFactor, JacobianIsCorrect) {
  RandomStream random(2, "nav prior");
  const PoseManifold manifold;
  const auto draw = [&](Eigen::Index n, double scale) {
    Eigen::VectorXd v(n);
    for (double& x : v) x = scale * random.Normal();
    return v;
  };
  for (const double noise : {0.0, 1e-3, 1.0}) {
    const NavState prior = BoxPlus(NavState(), Vector15d(draw(15, 1.0)));
    Matrix15d W;
    for (double& x : W.reshaped()) x = random.Normal();
    FactorBlock pose{Eigen::VectorXd(kPoseBlockSize), &manifold};
    StorePose(prior.T_world_body * ExpSe3(draw(6, noise)), pose.value.data());
    EXPECT_TRUE(JacobiansAreCorrect(NavPriorFactor(prior, W),
                                    {pose, {draw(3, 1.0), nullptr}, {draw(6, 1.0), nullptr}}));
  }
}

TEST(NavPriorFactor, CountsErrorsInTheOrderOfItsDocumentation) {
  NavState prior;
  prior.T_world_body = Pose3(ExpSo3({0.3, -0.2, 1.0}), {1.0, 2.0, 3.0});
  Vector15d error;
  for (int i = 0; i < 15; ++i) error(i) = 0.01 * (i + 1);
  Eigen::VectorXd pose(kPoseBlockSize), residual;
  StorePose(prior.T_world_body * ExpSe3(error.head<6>()), pose.data());
  const std::vector<FactorBlock> blocks = {
      {pose, nullptr}, {error.segment<3>(6), nullptr}, {error.tail<6>(), nullptr}};
  ASSERT_TRUE(internal::EvaluateFactor(NavPriorFactor(prior, Matrix15d::Identity()), blocks,
                                       &residual, nullptr));
  EXPECT_LT((residual - error).norm(), 1e-12);
}

}  // namespace
}  // namespace mlvi
